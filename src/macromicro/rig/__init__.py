"""Machines to control: the guard, the virtual twin, and later real boards."""
