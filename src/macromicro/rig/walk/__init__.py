"""Guided first power-up of a rig."""
