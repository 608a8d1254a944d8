"""What is usual of an irregularity where nothing else is said."""

SEED = 1
"""Which track of a class."""
FADE_IN = 10.0
"""Length over which a random profile rises, m; it goes on behind the place where a run starts."""
BLEND = 10.0
"""Length at most over which the ends of a repeated profile are blended, m."""
DEFECTS = ("dip", "joint", "weld", "corrugation", "flat", "fresh-flat")
"""Kinds of single defects."""
