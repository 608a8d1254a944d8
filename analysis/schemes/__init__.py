"""Coupling schemes on the pair: how far they are stable, what they cost, how exact they are."""
