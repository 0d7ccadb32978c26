"""Wiping-out and congruency in recordings (Section 2.4.1)."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.hysteresis import FodTable, Preisach, congruency, from_density, wiping_out
from macromicro.hysteresis.diagnostics import reversals

TABLE = FodTable.from_everett(
    from_density(np.tril(np.random.default_rng(1).random((40, 40))), 0.0, 0.25, 41), 0.0, 5.0
)
# Two loops between 3 and 6 after different pasts, and nested ones inside the major loop.
TURNS = [0.0, 6.0, 3.0, 6.0, 1.0, 4.0, 3.0, 9.0, 3.0, 6.0, 3.0, 7.0, 5.0, 10.0, 0.0]


def path(turns: list[float], steps: int = 20) -> np.ndarray:
    """Through the turns in steps of 1/steps, every one a sample, so that nothing is between."""
    whole = [round(turn * steps) for turn in turns]
    parts = [np.arange(a, b, 1 if b > a else -1) for a, b in pairwise(whole)]
    return np.concatenate([*parts, whole[-1:]]) / steps


def test_reversals() -> None:
    u = path([0.0, 5.0, 4.95, 8.0, 1.0, 2.0])
    assert u[reversals(u, 0.5)].tolist() == [8.0, 1.0]
    assert u[reversals(u, 0.01)].tolist() == [5.0, 4.95, 8.0, 1.0]
    assert reversals(np.linspace(0.0, 1.0, 9), 0.1).size == 0


def test_a_preisach_model_has_neither_gap() -> None:
    u = path(TURNS)
    f = Preisach(TABLE).run(u)
    wiped, alike = wiping_out(u, f), congruency(u, f)
    assert wiped.largest < 1e-12
    assert alike.largest < 1e-12
    assert len(wiped.gaps) >= 5
    assert len(alike.gaps) >= 3


@given(st.lists(st.integers(0, 40), min_size=6, max_size=30))
@settings(max_examples=60, deadline=None)
def test_no_history_of_a_preisach_model_shows_a_gap(nodes: list[int]) -> None:
    """On the grid, where the table's corners are, only rounding is left."""
    walk = np.concatenate(
        [np.arange(a, b, 1 if b > a else -1) for a, b in pairwise(nodes) if a != b] + [nodes[-1:]]
    )
    u = 0.25 * walk
    f = Preisach(TABLE).run(u)
    for check in (wiping_out, congruency):
        try:
            found = check(u, f, swing=0.2)
        except InputError:
            continue
        assert found.largest < 1e-12


def test_creep_breaks_wiping_out_by_as_much() -> None:
    u = path(TURNS)
    f = Preisach(TABLE).run(u)
    creeping = f + 0.5 * np.arange(u.size) / u.size
    found = wiping_out(u, creeping)
    # A corner and the return to it: the share of the time between, of half a unit.
    expected = 0.5 * np.diff(found.samples, axis=1)[:, 0] / u.size / np.ptp(creeping)
    assert np.allclose(found.gaps, expected, atol=1e-12)
    assert found.rms == pytest.approx(np.sqrt(np.mean(found.gaps**2)))


def test_output_dependent_loops_are_not_congruent() -> None:
    """Squaring the output keeps wiping-out and breaks congruency."""
    u = path(TURNS)
    f = Preisach(TABLE).run(u)
    bent = f**2
    assert wiping_out(u, bent).largest < 1e-12
    assert congruency(u, bent).largest > 0.03


def test_noise_of_the_input_makes_no_reversals() -> None:
    rng = np.random.default_rng(2)
    u = path(TURNS, 200)
    f = Preisach(TABLE).run(u)
    noisy = u + 0.01 * rng.normal(size=u.size)
    found = wiping_out(noisy, f, swing=0.2)
    assert len(found.gaps) == len(wiping_out(u, f).gaps)
    assert found.largest < 0.01


RISE = np.linspace(0.0, 1.0, 20)


@pytest.mark.parametrize("check", [wiping_out, congruency])
@pytest.mark.parametrize(
    ("u", "f", "options", "named"),
    [
        (RISE, RISE, {}, "no "),
        (path([0.0, 1.0, 0.5]), path([0.0, 1.0, 0.5]), {}, "no "),
        (np.ones(20), RISE, {}, "constant"),
        (RISE, np.ones(20), {}, "constant"),
        (RISE, RISE[:-1], {}, "equally long"),
        (RISE[:2], RISE[:2], {}, "3 samples"),
        (RISE, np.where(RISE > 0.5, np.nan, RISE), {}, "sample 10"),
        (RISE, RISE, {"swing": 0.0}, "above 0"),
        (RISE, RISE, {"swing": 2.0}, "above 0"),
        (["warm"], ["cold"], {}, "numbers"),
    ],
)
def test_recordings_that_tell_nothing_are_refused(
    check: Any, u: Any, f: Any, options: Any, named: str
) -> None:
    with pytest.raises(InputError, match=named):
        check(u, f, **options)
