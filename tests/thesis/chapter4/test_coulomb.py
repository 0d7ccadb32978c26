"""Coulomb level from steady speeds (Section 4.2.1, Figure 4.4)."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.plant import bench
from macromicro.plant.bench import Bench, Plant, Sensors
from macromicro.recorded import COLUMNS
from macromicro.recording import Recording
from macromicro.thesis.chapter4 import friction


@pytest.fixture(scope="module")
def plant() -> Plant:
    return bench.prepare(Bench(), Sensors())


def made(volts: float, x: np.ndarray) -> Recording:
    """A run with these positions [counts]."""
    values = {"t": np.arange(len(x)) * 1e-3, "macro_position": x, "motor": np.full(len(x), volts)}
    columns = [c for c in COLUMNS if c.name in values]
    return Recording.from_arrays(columns, [values[c.name] for c in columns], 1e-3, {})


def test_level_of_the_bench(plant: Plant) -> None:
    """What Section 4.2.5 implies: 1700 counts/s at 3.1 V and 3977 at 4 V lie on a line through
    2.43 V of 2530 counts/s/V; the friction is the same at every speed, both ways."""
    runs = friction.push(plant)
    assert all(0.0 < r["macro_position"][-1] < 2800.0 for r in runs)
    found = friction.fit(runs)
    assert found.level == pytest.approx(2.43, abs=0.03)
    assert found.gain == pytest.approx(2530.0, rel=0.02)
    assert sorted(found.volts) == sorted([*friction.PUSHES, *(-v for v in friction.PUSHES)])
    np.testing.assert_allclose(found.taken, np.sign(found.volts) * found.level, atol=0.01)


def test_known_line() -> None:
    """F = 2 V and G = 1000 counts/s/V, put in, come out; the end stop does not count."""
    runs = []
    for volts in (3.0, 4.0, 5.0):
        x = np.minimum(1000.0 * (volts - 2.0) * np.arange(1200) * 1e-3, 2900.0)
        runs += [made(volts, x), made(-volts, 2800.0 - x)]
    found = friction.fit(runs)
    assert found.level == pytest.approx(2.0, abs=1e-9)
    assert found.gain == pytest.approx(1000.0, rel=1e-9)
    assert friction.steady(runs[-1]) == pytest.approx((-5.0, -3000.0))


def test_a_run_that_is_over_at_once_is_refused() -> None:
    with pytest.raises(InputError, match="Lengthen the travel"):
        friction.steady(made(5.0, np.full(400, 3000.0)))


def test_at_rest() -> None:
    """Only runs that stand within the travel count: not one that moves, nor one at its end."""
    still = made(2.5, np.full(700, 400.0))
    stopped = made(-2.7, np.r_[np.arange(200.0), np.full(600, 200.0)])
    moving = made(2.9, np.arange(700.0))
    ended = made(3.2, np.full(700, 3000.0))
    np.testing.assert_array_equal(
        friction.at_rest([still, moving, stopped, ended, still]), [-2.7, 2.5]
    )


def test_stiction_of_the_bench(plant: Plant) -> None:
    """At rest friction takes more than in motion, less than the dead zone's 3 V."""
    runs = friction.probing_runs(plant, (2.7, 2.9, 3.1), (0.0, 1200.0))
    held = friction.at_rest(runs)
    np.testing.assert_allclose(np.unique(np.abs(held)), [2.7, 2.9])
