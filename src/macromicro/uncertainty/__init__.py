"""Uncertain parameters of a machine: one table, and machines drawn from it."""
