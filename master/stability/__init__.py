"""What a step of a scheme does to a linear system: growth and the largest stable step."""
