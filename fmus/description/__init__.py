"""What an FMU says of itself: model description, terminals, documentation."""
