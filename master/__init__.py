"""Couples and linearises FMUs, anyone's: knows FMI, nothing of railways."""
