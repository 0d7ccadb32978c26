"""Creep after a step: so much per decade of time, and exact lags."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.plant import creep
from macromicro.plant.creep import Creep, CreepTable

SPEC = Creep(share=0.015, first=0.1, decades=4)


def lags() -> CreepTable:
    """The parameters as the kernels take them."""
    return creep.prepare(SPEC)


def stepped(times: list[float], x: float = 1.0) -> list[float]:
    """Displacement at rising times after a step of `x`, in one move from each to the next."""
    p, now, found = lags(), 0.0, []
    state = creep.fresh(p)
    for t in times:
        found.append(creep.advance(p, state, x, t - now))
        now = t
    return found


def test_one_share_per_decade_of_time() -> None:
    """PI: x(t) = x0 (1 + share log10(t / 0.1 s)), within the decades, to a tenth of a share."""
    times = np.logspace(0.0, 2.5, 11).tolist()
    for t, x in zip(times, stepped(times), strict=True):
        assert x == pytest.approx(1.0 + 0.015 * math.log10(t / 0.1), abs=0.0015)
    tens = np.array(stepped([1.0, 10.0, 100.0]))
    assert np.diff(tens) == pytest.approx(0.015, rel=0.05)


def test_time_constants_are_a_decade_apart() -> None:
    begin = 0.1 * 10.0 ** (0.5 + 0.5772157 / math.log(10.0))
    assert lags().times == pytest.approx(begin * np.array([1.0, 10.0, 100.0, 1000.0]), rel=1e-6)
    assert creep.prepare(SPEC._replace(decades=0)).times.size == 0


def test_creep_ends() -> None:
    """After all decades 4 shares have come, and no more."""
    assert stepped([0.0, 1e6])[0] == 1.0
    assert stepped([1e6])[0] == pytest.approx(1.06)


@given(st.lists(st.floats(-50.0, 50.0), min_size=1, max_size=8), st.floats(1e-4, 3.0))
@settings(max_examples=50, deadline=None)
def test_many_short_steps_equal_a_long_one(values: list[float], dt: float) -> None:
    p = lags()
    one, many = creep.fresh(p), creep.fresh(p)
    for x in values:
        whole = creep.advance(p, one, x, dt)
        for _ in range(4):
            part = creep.advance(p, many, x, dt / 4.0)
        assert part == pytest.approx(whole, abs=1e-9)


@given(st.floats(-100.0, 100.0), st.floats(1e-3, 1e3))
@settings(max_examples=50, deadline=None)
def test_proportional_and_in_the_direction_of_the_step(x: float, t: float) -> None:
    (found,) = stepped([t], x)
    assert found == pytest.approx(x * stepped([t])[0], abs=1e-9)
    assert abs(x) <= abs(found) <= 1.06 * abs(x)
