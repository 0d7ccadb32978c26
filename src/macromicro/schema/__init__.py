"""Parameters with units, meanings and bounds: their checks and their files."""
