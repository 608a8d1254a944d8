"""Linear models of FMUs, their frequency responses, and these coupled."""
