"""Kernels as C99: laws, guards, observers, hysteresis and plants for a microcontroller."""
