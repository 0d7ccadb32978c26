"""The time constant where strokes do not tell it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from macromicro.arrays import Array
from macromicro.commission import _pole
from macromicro.identify.axis import Axis
from macromicro.machines import feasible

NAMES = ("mass", "viscous", "coulomb", "offset", "lag")
DT = 1e-3
# Mass and lag hang together: a quicker axis that is later.
LOOSE = np.diag([0.004, 0.02, 0.01, 0.002, 0.9e-3]) @ np.array(
    [
        [1.0, 0.3, 0.0, 0.0, -0.95],
        [0.3, 1.0, -0.5, 0.0, -0.2],
        [0.0, -0.5, 1.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0, 0.0],
        [-0.95, -0.2, 0.0, 0.0, 1.0],
    ]
) @ np.diag([0.004, 0.02, 0.01, 0.002, 0.9e-3])  # fmt: skip
QUICK = np.array([0.003, 3.0, 0.5, 0.0, 1.5e-3])


def possible(mean: Array, within: float = 2.0) -> Array:
    return _pole.possible(mean, LOOSE, NAMES, within, DT)


def test_the_likeliest_of_those_that_the_period_is_short_enough_for_are_taken() -> None:
    found = possible(QUICK)
    assert found[0] / found[1] == pytest.approx(feasible.PERIODS * DT, rel=2e-3)
    inverse, unit = np.linalg.inv(LOOSE), np.sqrt(np.diag(LOOSE))

    def unlikely(z: Array) -> float:
        off = z * unit
        return float(off @ inverse @ off)

    best = minimize(
        unlikely,
        np.zeros(5),
        constraints={
            "type": "ineq",
            "fun": lambda z: (QUICK + z * unit)[0] / feasible.PERIODS / DT - (QUICK + z * unit)[1],
        },
    )
    assert found == pytest.approx(QUICK + best.x * unit, rel=5e-3, abs=1e-5)
    assert found[4] < QUICK[4]  # what the mass gains the lag loses
    assert not _pole.told(Axis(*found[:4], lag=found[4]), DT)


def test_what_strokes_refute_is_left_and_so_is_what_is_slow_enough() -> None:
    sure = possible(QUICK, within=0.5)
    assert sure is QUICK
    slow = QUICK.copy()
    slow[0] = 0.05
    assert possible(slow) is slow
    assert _pole.told(Axis(*slow[:4], lag=slow[4]), DT)


def test_no_lag_is_below_none() -> None:
    soon = QUICK.copy()
    soon[4] = 1e-5
    assert possible(soon)[4] == 0.0


@given(st.floats(-0.004, 0.02), st.floats(0.1, 5.0))
def test_either_they_stay_or_the_loop_can_run_them(mass: float, viscous: float) -> None:
    mean = np.array([mass, viscous, 0.5, 0.0, 1.5e-3])
    found = possible(mean)
    if found is not mean:
        assert found[0] >= feasible.PERIODS * DT * found[1]
        assert found[0] > mean[0]
