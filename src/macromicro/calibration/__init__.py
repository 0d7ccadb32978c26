"""Calibration: errors of a stage along its travel, measured against a reference and corrected."""
