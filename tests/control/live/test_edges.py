"""Phase and slope of the encoder's edges, from crossings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from macromicro.control.live import edges
from macromicro.control.live.edges import Phase

from .bench import PITCH

SCALE, NOISE = 2e-4, 5e-6


def crossed(e: Phase, places: range, phase: float, slope: float = 0.0, seed: int = 0) -> Phase:
    """Edges at these counts crossed, seen with `NOISE`."""
    rng = np.random.default_rng(seed)
    for n in places:
        z = phase + slope * n + NOISE * float(rng.standard_normal())
        e = edges.taken(e, float(n), z, NOISE * NOISE)
    return e


def test_a_count_alone_knows_the_phase_to_half_a_count() -> None:
    e = edges.begin(700.0, 3e-6, PITCH, SCALE)
    assert edges.at(e, 700.0) == 3e-6
    assert edges.error(e, 700.0) == pytest.approx(PITCH / 12.0**0.5)
    assert edges.error(e, 700.0 + 1e4) > SCALE * PITCH * 1e4


@pytest.mark.parametrize("seed", range(10))
def test_edges_tell_the_phase_as_well_as_their_number_lets_them(seed: int) -> None:
    e = crossed(edges.begin(0.0, 0.0, PITCH, SCALE), range(-150, 1), 20e-6, seed=seed)
    assert e.number > 140
    error = edges.error(e, 0.0)
    assert NOISE / 151**0.5 <= error < 1.2e-6
    assert abs(edges.at(e, 0.0) - 20e-6) < 4.0 * error


def test_a_pitch_that_is_wrong_becomes_a_slope_and_leaves_home_where_it_was() -> None:
    slope = 3e-4 * PITCH
    e = crossed(edges.begin(0.0, 0.0, PITCH, SCALE), range(-150, 1), 10e-6, slope)
    far = edges.error(e, 0.0)
    e = edges.blurred(e, 1e-10)  # the laser was reset badly, or often
    assert edges.error(e, 0.0) > 5.0 * far
    e = crossed(e, range(0, 2800, 10), 10e-6, slope, seed=1)
    assert e.b == pytest.approx(slope, abs=4.0 * e.bb**0.5)
    assert e.bb**0.5 < 0.03 * SCALE * PITCH
    assert edges.at(e, 0.0) == pytest.approx(10e-6, abs=4.0 * edges.error(e, 0.0))
    assert edges.error(e, 0.0) < 1.5e-6


def test_an_edge_that_does_not_belong_is_refused_and_five_are_no_chance() -> None:
    e = crossed(edges.begin(0.0, 0.0, PITCH, SCALE), range(100), 0.0)
    for k in range(1, edges.OUTLIERS + 1):
        assert edges.sure(e)
        after = edges.taken(e, 100.0 + k, PITCH, NOISE * NOISE)  # a count was lost
        assert (after.a, after.aa, after.number, after.refused) == (e.a, e.aa, e.number, k)
        e = after
    assert not edges.sure(e)


def test_one_that_belongs_ends_the_row() -> None:
    e = crossed(edges.begin(0.0, 0.0, PITCH, SCALE), range(100), 0.0)
    for _ in range(edges.OUTLIERS - 1):
        e = edges.taken(e, 101.0, PITCH, NOISE * NOISE)
    e = edges.taken(e, 102.0, edges.at(e, 102.0), NOISE * NOISE)
    assert e.refused == 0 and edges.sure(e)


def test_before_the_first_count_nothing_is_known() -> None:
    assert edges.unknown() == edges.Phase(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1, 0)
    assert not edges.known(edges.unknown())


def test_the_first_count_lets_any_phase_within_half_a_pitch_be_as_likely() -> None:
    """The variance of a uniform distribution, and the slope as the pitch is known."""
    e = edges.begin(700.0, 3e-6, 70e-6, 2e-4)
    assert e == Phase(
        700.0, 3e-6, 0.0, pytest.approx(70e-6**2 / 12.0), 0.0, pytest.approx(14e-9**2), 0, 0
    )
    assert edges.known(e)


# Far from its origin, all of its numbers at work.
FAR = Phase(10.0, 2e-6, -3e-8, 4e-12, -5e-14, 6e-15, 8, 2)


def spread(e: Phase) -> Any:
    return np.array([[e.aa, e.ab], [e.ab, e.bb]])


@pytest.mark.parametrize("count", [10.0, 30.0, -25.0])
def test_phase_and_its_variance_away_from_the_origin(count: float) -> None:
    h = np.array([1.0, count - 10.0])
    assert edges.at(FAR, count) == pytest.approx(2e-6 - 3e-8 * (count - 10.0), rel=1e-12)
    assert edges.variance(FAR, count) == pytest.approx(float(h @ spread(FAR) @ h), rel=1e-12)
    assert edges.error(FAR, count) == pytest.approx(float(h @ spread(FAR) @ h) ** 0.5, rel=1e-12)


def test_a_variance_that_rounding_made_negative_is_no_error() -> None:
    assert edges.error(FAR._replace(aa=-1e-30), 10.0) == 0.0


@pytest.mark.parametrize("edge", [30.0, -25.0])
@pytest.mark.parametrize("off", [9e-6, -9e-6])
def test_an_edge_is_taken_as_a_kalman_filter_takes_it(edge: float, off: float) -> None:
    z, noise, h = edges.at(FAR, edge) + off, 2.5e-11, np.array([1.0, edge - 10.0])
    p = spread(FAR)
    k = p @ h / (h @ p @ h + noise)
    a, b = np.array([FAR.a, FAR.b]) + k * off
    after = p - np.outer(k, h @ p)
    near = {"rel": 1e-9, "abs": 1e-25}
    taken = edges.taken(FAR, edge, z, noise)
    assert (taken.origin, taken.number, taken.refused) == (10.0, 9, 0)
    assert (taken.a, taken.b) == (pytest.approx(a, **near), pytest.approx(b, **near))
    assert taken.aa == pytest.approx(after[0, 0], **near)
    assert taken.ab == pytest.approx(after[0, 1], **near)
    assert taken.bb == pytest.approx(after[1, 1], **near)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_four_standard_errors_are_the_bound_of_what_belongs(sign: float) -> None:
    noise = 2.5e-11
    one = (edges.variance(FAR, 30.0) + noise) ** 0.5
    for errors, belongs in ((3.99, True), (4.01, False)):
        e = edges.taken(FAR, 30.0, edges.at(FAR, 30.0) + sign * errors * one, noise)
        if belongs:
            assert (e.number, e.refused) == (9, 0)
        else:
            assert e == FAR._replace(refused=3)


def test_a_blur_is_added_to_the_phases_variance_alone() -> None:
    assert edges.blurred(FAR, 3e-12) == FAR._replace(aa=FAR.aa + 3e-12)


@pytest.mark.parametrize(("refused", "sure"), [(0, True), (4, True), (5, False), (6, False)])
def test_the_fifth_edge_in_a_row_that_does_not_belong_is_no_chance(
    refused: int, sure: bool
) -> None:
    assert edges.sure(FAR._replace(refused=refused)) == sure
