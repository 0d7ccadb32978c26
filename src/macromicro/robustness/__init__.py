"""Robustness of the positioner: yields with confidence intervals, influences, worst cases."""
