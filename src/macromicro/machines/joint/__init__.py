"""Machines of several axes on one clock: `xy`."""
