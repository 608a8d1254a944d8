"""The track: slabs, ballast, layers of any kind. Knows nothing of FMI."""
