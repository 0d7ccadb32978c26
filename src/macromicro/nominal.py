"""Nominal figures of the machine that several sets of settings share."""

from __future__ import annotations

PITCH = 0.2 / 2800.0  # m per encoder count: 200 mm are 2800 counts (M16)
TRAVEL = 0.2  # m; the way of the carriage that programmes use
COUNTS = 2800.0  # the same in counts
STOP_LOW, STOP_HIGH = -10.0e-3, 214.3e-3  # m; where the carriage meets its end stops
FINE_STOP = 3.98e-3  # m; the micro-stage's mechanical stop
FINE_TRAVEL = 3.9e-3  # m; its contraction that programmes use
AMBIENT = 25.0  # degC; room temperature (Section 5.2.2)
FULL_SCALE = 5.0  # V; D/A and A/D range (Sections 3.1, 3.2.3)
HALL_SUPPLY = 5.0  # V; the Hall sensor's output stays between 0 and this
PERIOD = 1e-3  # s; the control period
PUSH, LEAN = 3.6, 2.9  # V; efforts under which the carriage must move, and should
