"""Parameters of a track from what was measured of it."""
