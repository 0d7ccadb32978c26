"""Measured files as columns by name (`reading.read`) or a `Recording` (`recordings`)."""
