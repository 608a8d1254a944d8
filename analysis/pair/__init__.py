"""A vehicle FMU and a track FMU as one: made, put together, run, judged."""
