"""Rigs: the guard, the virtual twin, boards and cards."""
