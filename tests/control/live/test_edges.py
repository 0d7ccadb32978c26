"""Phase and slope of the encoder's edges, from crossings."""

from __future__ import annotations

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
