"""Measures of a response: settling, residual vibration, the actuator's return."""
