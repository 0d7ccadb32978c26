"""Machines of several axes on one clock: today `xy`, two of the machine `axis`."""
