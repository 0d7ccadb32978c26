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
from macromicro.hysteresis.diagnostics import reversals, turning_points

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


@pytest.mark.parametrize(
    ("values", "turns"),
    [
        ([0, 10, 0], [0, 1, 2]),
        ([0, 5, 10, 9, 8, 12, 4, 20], [0, 5, 6, 7]),  # a fall by 2 is no leg
        ([10, 0, 10], [0, 1, 2]),
        ([0, 10, 7], [0, 1, 2]),  # a leg of 3 is one
        ([0, 10, 7.1], [0, 1, 2]),  # a shorter one is the rest behind the last extreme
        ([0, 10, 10, 5], [0, 1, 3]),  # the first of equal extremes
        ([0, 1, 2], [0, 2]),
        ([2, 1, 0], [0, 2]),
        ([5, 5], [0, 1]),
        ([5, 6, 1, 9], [0, 1, 2, 3]),
        ([5, 4, 9, 1], [0, 1, 2, 3]),
        ([0, 10, 4, 6, 3, 9], [0, 1, 4, 5]),
        ([10, 0, 6, 4, 7, 1], [0, 1, 4, 5]),
    ],
)
def test_turning_points_of_short_series(values: list[float], turns: list[int]) -> None:
    assert turning_points(values, 3.0) == turns
    assert turning_points([-v for v in values], 3.0) == turns


@pytest.mark.parametrize(("values", "least"), [([1.0], 3.0), ([1.0, 2.0], 0.0), ([], 1.0)])
def test_what_has_no_turning_points_is_refused(values: list[float], least: float) -> None:
    with pytest.raises(InputError, match="turning points"):
        turning_points(values, least)


@given(st.lists(st.floats(5.0, 50.0), min_size=1, max_size=10))
def test_turning_points(legs: list[float]) -> None:
    """Every leg of a zigzag is found, whatever the ripple on it."""
    signs = np.array([1.0, -1.0] * 5)[: len(legs)]
    corners = np.r_[0.0, np.cumsum(signs * legs)]
    y = np.interp(np.arange(50 * len(legs) + 1) / 50.0, np.arange(len(legs) + 1), corners)
    ripple = 0.2 * np.sin(np.arange(len(y)) * 2.0)
    ripple[::50] = 0.0
    found = turning_points(y + ripple, 3.0)
    places = y[found]
    assert len(found) >= len(corners)
    assert len(found) <= len(corners) + 1
    np.testing.assert_allclose(places[: len(corners) - 1], corners[:-1], atol=2.5)


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
        (RISE[:2], RISE[:2], {}, "3 numbers"),
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


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("shift", [0.0, -20.0])
@pytest.mark.parametrize(("away", "closes"), [(3.0, True), (2.0, True), (1.0, False)])
def test_the_first_corner_counts_if_nothing_older_was_wiped_out(
    sign: float, shift: float, away: float, closes: bool
) -> None:
    """From 2 to 5, back and beyond 5: below 2 the recording began with an unknown past."""
    u = sign * (path([2.0, 5.0, away, 6.0]) + shift)
    if closes:
        found = wiping_out(u, u**2)
        corner = int(np.argmax(sign * u[:80]))
        assert found.samples.tolist() == [[corner, corner + 2 * round(20 * (5.0 - away))]]
        assert found.largest < 1e-12
    else:
        with pytest.raises(InputError, match="no minor loop closes"):
            wiping_out(u, u**2)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("shift", [0.0, -20.0])
def test_the_gap_of_a_loop_is_between_the_corner_and_the_return(sign: float, shift: float) -> None:
    """The return is between two samples: 5 lies a quarter of the way from 4.9 to 5.3."""
    u = sign * (np.array([0.0, 3.0, 5.0, 4.0, 3.0, 4.0, 4.9, 5.3, 6.0]) + shift)
    f = np.array([0.0, 1.0, 8.0, 7.0, 6.0, 6.5, 7.0, 9.0, 10.0])
    found = wiping_out(u, f)
    assert found.gaps == pytest.approx([(7.0 + 0.25 * 2.0 - 8.0) / 10.0])
    assert found.samples.tolist() == [[2, 7]]
    assert (found.rms, found.largest) == pytest.approx((0.05, 0.05))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("shift", [0.0, -20.0])
def test_branches_are_compared_from_their_common_input_on(sign: float, shift: float) -> None:
    """One rises from 3 as u, another from 3.1 as u^2 / 10, both to 8, where they are furthest
    apart: 4.9 and 5.439 from 3.1 on."""
    plain = path([0.0, 10.0, 3.0, 8.0, 3.1, 9.0])
    turns = reversals(plain, 0.1)
    f = plain.copy()
    f[turns[3] :] = plain[turns[3] :] ** 2 / 10.0
    u = sign * (plain + shift)
    found = congruency(u, f, swing=0.1, tolerance=0.15)
    assert found.samples.tolist() == [[turns[1], turns[3]]]
    assert found.largest == pytest.approx((5.439 - 4.9) / np.ptp(f))
    with pytest.raises(InputError, match="no two branches"):
        congruency(u, f, swing=0.1, tolerance=0.05)
    with pytest.raises(InputError, match="no two branches"):
        congruency(u, f, swing=0.3)  # a quarter of that is less than 0.1 apart
    assert len(congruency(u, f, swing=0.44).gaps) == 1


def test_branches_that_have_too_little_in_common_are_not_compared() -> None:
    """From 3 both rise, one to 3.8 only: less than the least swing beyond the other's 3.1."""
    plain = path([0.0, 10.0, 3.0, 3.8, 3.1, 9.0])
    with pytest.raises(InputError, match="no two branches"):
        congruency(plain, plain, swing=0.705, tolerance=0.2)
    assert len(congruency(plain, plain, swing=0.695, tolerance=0.2).gaps) == 1
