"""Calls that are made in every step, ready to be made, and many of them at once."""
