"""The slab track. Knows nothing of FMI."""
