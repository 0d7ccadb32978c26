"""Identification from recordings. It reads what a rig shows, never the bench's parameters."""
