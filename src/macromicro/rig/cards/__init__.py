"""Data-acquisition cards as rigs."""
