"""Machines of two axes for tests."""

from __future__ import annotations

import math

from macromicro.machines import composite, runs
from macromicro.machines.joint import course, planning
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.joint.settings import DEFAULT
from macromicro.machines.moves import Course

# Scales that are fine, no friction, side by side: what is left is linear and the same on both.
_SMOOTH = {
    "friction.coulomb": "0 N",
    "friction.stribeck": "0 N",
    "friction.viscous": "1 N*s/m",
    "encoder.at": "load",
    "encoder.pitch": "1e-6 um",
    "encoder.rate": "1e15 counts/s",
    "encoder.bits": 48,
    "amplifier.bits": 24,
}


def linear():
    """Two identical linear axes, each alone on its ground."""
    changes = {
        "stack.carries": "nothing",
        "x.load.stop_high": "205 mm",
        "x.arrival.tolerance": "20 um",
        "y.arrival.tolerance": "20 um",
    }
    changes |= {f"{name}.{path}": value for name in "xy" for path, value in _SMOOTH.items()}
    return DEFAULT.with_(changes)


def straight(*points, hold=0.05):
    """A programme of straight moves through points in m."""
    legs, here = [], (0.0, 0.0)
    for point in points:
        legs.append(course._straight(here, point, math.inf, hold))
        here = point
    return Course("test", tuple(legs), "test")


def ran(settings, programme, seed=0):
    """A run, and its plan."""
    plan = planning.plan(programme, settings)
    return plan, runs.record(composite.under(XY_MACHINE, settings), settings, plan, seed=seed)
