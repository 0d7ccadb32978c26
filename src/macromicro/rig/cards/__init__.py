"""Data-acquisition cards as rigs: which terminal is what, and the loop's time by this computer."""
