"""Wheel on rail in three dimensions: patch, creep, geometry, law. Needs numpy only."""
