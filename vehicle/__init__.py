"""Vehicles and trains, and how their wheels roll. Knows nothing of FMI."""
