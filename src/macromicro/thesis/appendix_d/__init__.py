"""Appendix D: cycles of the actuator alone."""
