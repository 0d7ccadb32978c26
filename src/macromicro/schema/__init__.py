"""Parameters with units, meaning and bounds: their one check, their files, their words."""
