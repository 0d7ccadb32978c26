"""What the model of an axis leaves out: section "An axis" of docs/commissioning.md."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.commission import _left_out
from macromicro.commission._model import FITTED
from macromicro.identify.axis_inverse import ECCENTRIC

MEAN = np.array([0.005, 0.4, 0.5, 0.01, 1e-3])  # as FITTED
DT = 1e-3
PLACES = np.linspace(0.0, 1.2, 20)
LOADED = (*FITTED, *ECCENTRIC)


def test_an_inductance_hides_mass() -> None:
    shift, covariance = _left_out.beside(MEAN, FITTED, PLACES, DT)
    hidden = 0.25 * 1e-3 * 0.4
    assert shift.tolist() == pytest.approx([hidden, 0.0, 0.0, 0.0, 0.0])
    mass = math.hypot(0.002 * (0.005 + hidden), hidden)
    assert np.sqrt(np.diag(covariance)) == pytest.approx([mass, 0.0012, 0.003, 0.00035, 0.0])
    assert np.count_nonzero(covariance) == 4


def test_a_lag_at_its_bound_may_be_a_part_of_a_period() -> None:
    none = np.array([*MEAN[:4], 0.01 * DT])
    _, covariance = _left_out.beside(none, FITTED, PLACES, DT)
    assert math.sqrt(covariance[4, 4]) == pytest.approx(0.3 * DT)


def test_gravity_on_a_short_way_is_no_surer_than_a_force_at_each_place_lets_it_be() -> None:
    mean = np.array([*MEAN, 3.0, -0.1])
    _, covariance = _left_out.beside(mean, LOADED, PLACES, DT)
    at = [LOADED.index(n) for n in ("offset", *ECCENTRIC)]
    table = np.stack([np.ones(20), np.sin(PLACES), np.cos(PLACES)], axis=1)
    # Another force at each place, whose mean has the standard deviation of a constant one.
    each = 0.0007 * 0.5 * math.sqrt(20.0)
    forces = each * np.random.default_rng(1).standard_normal((20, 20_000))
    found = np.linalg.lstsq(table, forces, rcond=None)[0]
    assert covariance[np.ix_(at, at)] == pytest.approx(np.cov(found), rel=0.05)
    assert math.sqrt(covariance[at[1], at[1]]) > 3.0 * 0.0007 * 0.5


def test_on_a_whole_turn_gravity_and_a_constant_force_are_told_apart() -> None:
    turn = np.arange(20) * 2.0 * math.pi / 20
    _, covariance = _left_out.beside(np.array([*MEAN, 3.0, -0.1]), LOADED, turn, DT)
    at = [LOADED.index(n) for n in ("offset", *ECCENTRIC)]
    expected = (0.0007 * 0.5) ** 2 * np.diag([1.0, 2.0, 2.0])
    assert covariance[np.ix_(at, at)] == pytest.approx(expected, abs=1e-15)
