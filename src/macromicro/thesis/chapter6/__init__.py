"""Chapters 6 and 7: both stages, and the laser."""
