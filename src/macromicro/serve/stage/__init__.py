"""Server parts of a single-stage machine."""
