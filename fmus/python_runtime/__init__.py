"""What travels in an FMU and steps its model; needs numpy only."""
