"""What the law finds out about a wire that is not its model."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control.inverse import learned
from macromicro.control.inverse.learned import BASE, HEAT, LAG, LOSS, Learned
from macromicro.control.inverse.model import Inverse, prepare
from macromicro.kernel import compiled
from macromicro.models import stressed
from macromicro.models.stressed import StressedState

from .wires import DT, GAINS, SURE, Wire

PLACES = (1.0, 2.0, 3.0, 2.0, 1.0, 1.5, 2.5, 0.5, 3.0, 1.0)
P = prepare(GAINS)


def moved(law: Inverse, plant: Inverse) -> Wire:
    """A wire after some moves."""
    w = Wire(law, plant)
    for goal in PLACES:
        w.go(goal, 1.0)
    return w


def over(law: Inverse, plant: Inverse) -> float:
    """How far a contraction goes beyond its goal after these moves, mm."""
    w = moved(law, plant)
    return float(w.go(2.0, 1.0).max() - 2.0)


@pytest.mark.slow
def test_a_wire_as_told_teaches_little() -> None:
    w = moved(GAINS, GAINS)
    values = w.memory.learned.values
    assert abs(values[BASE]) < 1.0 and abs(values[HEAT]) < 0.02 and abs(values[LOSS]) < 0.04
    assert abs(values[LAG]) < 5e-4


def test_no_doubt_learns_nothing() -> None:
    w = moved(SURE, GAINS._replace(ambient=30.0))
    assert not w.memory.learned.values.any() and not w.memory.learned.spread.any()


@pytest.mark.parametrize("warmer", [-8.0, 8.0])
def test_a_room_that_is_warmer_than_told_is_found(warmer: float) -> None:
    plant = GAINS._replace(ambient=GAINS.ambient + warmer)
    w = moved(GAINS, plant)
    assert w.memory.learned.values[BASE] == pytest.approx(warmer, abs=2.5)
    # The model's place is right, not only what is added to it.
    assert abs(w.memory.offset) < 0.1 * abs(moved(SURE, plant).memory.offset)


@pytest.mark.parametrize("share", [-0.1, 0.1])
def test_heat_that_is_more_than_told_is_found(share: float) -> None:
    plant = GAINS._replace(heat=tuple(v * (1.0 + share) for v in GAINS.heat))
    values = moved(GAINS, plant).memory.learned.values
    assert values[HEAT] == pytest.approx(share, abs=0.04)


def test_longer_lags_are_found_and_it_goes_over_by_less() -> None:
    slow = GAINS._replace(lag=GAINS.lag + 2e-3, sensor=GAINS.sensor + 2e-3)
    w = moved(GAINS, slow)
    assert 1e-3 < w.memory.learned.values[LAG] < 5e-3
    assert over(GAINS, slow) < 0.6 * over(SURE, slow)


def test_a_hold_teaches_nothing() -> None:
    w = Wire(GAINS, GAINS._replace(ambient=30.0))
    w.go(2.0, 1.0)
    before = w.memory.learned.values.copy()
    w.go(2.0, 1.0)
    assert np.abs(w.memory.learned.values - before).max() < 1e-2


def test_what_was_found_stays_in_a_rest_and_the_sensitivities_fade() -> None:
    w = moved(GAINS, GAINS._replace(ambient=30.0))
    before, heat = w.memory.learned.values.copy(), w.memory.learned.heat
    for _ in range(3000):
        w.pause()
    assert np.array_equal(w.memory.learned.values, before)
    assert abs(w.memory.learned.heat) < 0.2 * abs(heat)


def test_more_heat_by_the_same_map_is_the_corrected_model() -> None:
    """Against a model whose map has the heat."""
    share, known = 0.1, learned.nothing(P.doubts)
    known.values[HEAT] = share
    mine = learned.corrected(P.model, known)
    told = P.model._replace(heat=P.model.heat * (1.0 + share))
    course = np.where(np.arange(3000) < 1500, 1.6, 1.4)
    assert stressed.simulate(mine, course, DT)[0] == pytest.approx(
        stressed.simulate(told, course, DT)[0], abs=1e-7
    )


def test_more_loss_base_and_lag_are_where_they_belong() -> None:
    known = learned.nothing(P.doubts)
    known.values[:] = (3.0, 0.0, 0.25, -1.0)
    mine, told = learned.corrected(P.model, known), P.model
    assert mine.ambient == told.ambient + 3.0 and mine.lag == 0.0
    assert mine.ladder == told.ladder._replace(r1=told.ladder.r1 / 1.25)
    known.values[LAG] = 2e-3
    assert learned.corrected(P.model, known).lag == pytest.approx(told.lag + 1e-3)


def states(way: float, turn: float, cut: float = 0.0) -> tuple[StressedState, StressedState]:
    """A period in which the place went a way (mm) as the relays' input turned (K)."""
    a = stressed.cold(P.model)._replace(wire=40.0, plates=10.0, x=1.0, heat=100.0)
    memory = a.memory._replace(u=a.memory.u + turn)
    return a, a._replace(x=1.0 + way, memory=memory, cut=cut)


def taught(
    way: float,
    turn: float,
    beyond: float,
    known: Learned | None = None,
    cut: float = 0.0,
    gone: float = 0.0,
) -> tuple[Learned, float]:
    """One reading."""
    known = known or learned.nothing(P.doubts)._replace(heat=10.0, loss=-5.0)
    a, b = states(way, turn, cut)
    return compiled(learned.learn)(P.model, a, b, known, P.doubts, P.forget, beyond, gone, DT)


@pytest.mark.parametrize(
    ("way", "turn", "beyond", "cut"),
    [
        (0.01, 0.1, math.nan, 0.0),
        (1e-4, 0.9 * learned.MOVES * DT, 0.1, 0.0),
        (0.9 * learned.STEEP * P.model.hysteresis.span * 0.1, 0.1, 0.1, 0.0),
        (-0.01, 0.1, 0.1, 0.0),
        (0.01, 0.1, 0.1, 1.0),
    ],
    ids=["no reading", "at rest", "flat", "against", "cut"],
)
def test_what_tells_nothing(way: float, turn: float, beyond: float, cut: float) -> None:
    now, content = taught(way, turn, beyond, cut=cut)
    assert content == 0.0 and not now.values.any()
    assert np.array_equal(now.spread, np.diag(P.doubts**2))


def test_one_reading_by_hand() -> None:
    way, turn, beyond = 0.01, 0.1, 1e-3
    now, content = taught(way, turn, beyond)
    slope, m = way / turn, P.model
    loose = 1.0 / (1.0 + (m.latent / m.hysteresis.span + m.stiffening) * slope)
    h = np.array([slope * loose, slope * loose * now.heat, slope * loose * now.loss, -way / DT])
    before = np.diag(P.doubts**2)
    scatter = (learned.ERROR**2 + (learned.WRONG * beyond) ** 2) * learned.ALIKE / DT
    scatter += h @ before @ h
    gain = before @ h / scatter
    assert now.values == pytest.approx(gain * beyond, rel=1e-9)
    assert now.spread == pytest.approx(before - np.outer(gain, before @ h), rel=1e-9, abs=1e-15)
    assert content == pytest.approx((now.heat * gain[HEAT] + now.loss * gain[LOSS]) * beyond)


FLAT = 0.5 * learned.STEEP * P.model.hysteresis.span  # mm/K
STEEP = 0.02 * P.model.hysteresis.span


def test_far_from_a_flat_model_the_stage_shows_how_steep_its_branch_is() -> None:
    """The same as of a model that is as steep, but for what its own way tells of the lag."""
    turn, beyond = 0.1, -0.4
    now, _ = taught(FLAT * turn, turn, beyond, gone=STEEP * turn)
    steep, _ = taught(STEEP * turn, turn, beyond)
    assert now.values[BASE] < 0.0
    assert now.values[BASE] == pytest.approx(steep.values[BASE], rel=0.02)


@pytest.mark.parametrize(
    ("beyond", "gone"),
    [(-0.9 * learned.FAR, STEEP * 0.1), (-0.4, -STEEP * 0.1), (-0.4, 0.0)],
    ids=["near", "against", "standing"],
)
def test_a_flat_model_learns_nothing_else(beyond: float, gone: float) -> None:
    now, content = taught(FLAT * 0.1, 0.1, beyond, gone=gone)
    assert content == 0.0 and not now.values.any()


def test_no_branch_is_taken_for_steeper_than_any() -> None:
    turn, most = 0.1, learned.STEEPEST * P.model.hysteresis.span
    now, _ = taught(FLAT * turn, turn, -0.4, gone=5.0 * most * turn)
    limit, _ = taught(FLAT * turn, turn, -0.4, gone=most * turn)
    assert now.values == pytest.approx(limit.values, rel=1e-9)


def test_a_loop_that_lies_far_lower_than_told_is_found_where_the_model_has_none_left() -> None:
    plant = GAINS._replace(ambient=GAINS.ambient + 14.0)
    w = moved(GAINS, plant)
    assert w.memory.learned.values[BASE] == pytest.approx(14.0, abs=2.5)
    assert abs(w.memory.offset) < 0.1


def test_it_is_as_doubtful_again_after_a_time_of_motion() -> None:
    known = Learned(np.zeros(4), np.zeros((4, 4)), 0.0, 0.0)
    a, b = states(0.01, 0.1)
    compiled(learned.learn)(P.model, a, b, known, P.doubts, P.forget, 0.0, 0.0, DT)
    assert known.spread[BASE, BASE] == pytest.approx(P.doubts[BASE] ** 2 * DT / P.forget, rel=0.01)


@given(
    st.lists(
        st.tuples(st.floats(1e-3, 0.03), st.floats(0.01, 0.4), st.floats(-3.0, 3.0), st.booleans()),
        min_size=1,
        max_size=40,
    )
)
def test_it_stays_within_its_bounds(readings: list[tuple[float, float, float, bool]]) -> None:
    """No correction turns the input back, values end three doubts away, variances stay."""
    known = learned.nothing(P.doubts)
    for way, turn, beyond, up in readings:
        sign, before = 1.0 if up else -1.0, known.values.copy()
        known, content = taught(sign * way, sign * turn, beyond, known)
        by = known.values[BASE] - before[BASE] + content
        assert abs(by) <= learned.SHARE * turn * (1.0 + 1e-9) + _cut(known, before)
        assert np.all(np.abs(known.values) <= learned.FARTHEST * P.doubts * (1.0 + 1e-12))
        assert np.all(np.diag(known.spread) <= P.doubts**2 * (1.0 + 1e-12))
        scaled = known.spread / np.outer(P.doubts, P.doubts)
        assert np.linalg.eigvalsh(scaled).min() > -1e-9
        assert np.array_equal(known.spread, known.spread.T) or known.spread == pytest.approx(
            known.spread.T, rel=1e-6, abs=1e-12
        )


def _cut(known: Learned, before: np.ndarray) -> float:
    """What a bound took off the base's change, K."""
    at = abs(known.values[BASE]) >= learned.FARTHEST * P.doubts[BASE]
    return float(learned.FARTHEST * P.doubts[BASE]) if at else 0.0
