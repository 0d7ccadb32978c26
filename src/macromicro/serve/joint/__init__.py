"""Server parts of a two-axis machine."""
