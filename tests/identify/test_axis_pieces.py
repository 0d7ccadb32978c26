"""Free runs over pieces of a record, their starts as measured or found."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.identify._axis_pieces import Pieces, cleared, cut, restarted, runs, settled
from macromicro.identify.axis import Axis, late, simulate
from macromicro.identify.axis_inverse import Rows, differences
from macromicro.identify.runs import Run
from macromicro.kernel import compiled

DT = 2e-3
T = np.arange(3000) * DT
TRUTH = Axis(2.0, 3.0, 1.5, 0.4)
FORCE = 9.0 * np.sin(3.0 * T) + 3.0 * np.sin(11.0 * T)


def rows(noise: float = 0.0) -> Rows:
    x = simulate(TRUTH, FORCE, DT, 0.3) + noise * np.random.default_rng(1).normal(size=3000)
    return differences(Run(T, FORCE, x), FORCE, 40.0, 4)


def pieces(free: bool, length: int = 700, noise: float = 0.0) -> Pieces:
    return cut([rows(noise)], length, free)[0]


@pytest.mark.parametrize(("length", "starts"), [
    (700, [0, 750, 1500, 2250]), (3000, [0]), (9000, [0]), (2000, [0, 1500]), (2001, [0]),
])  # fmt: skip
def test_pieces_are_of_one_length_as_near_as_the_record_allows(
    length: int, starts: list[int]
) -> None:
    made = pieces(True, length)
    assert made.starts.tolist() == starts
    assert made.lengths.tolist() == np.diff([*starts, 3000]).tolist()


@pytest.mark.parametrize("axis", [
    TRUTH, TRUTH._replace(lag=3.4 * DT, limit=7.0, back=0.2), TRUTH._replace(sine=2.0, cosine=5.0),
])  # fmt: skip
def test_each_piece_runs_from_its_own_start(axis: Axis) -> None:
    """As a simulation of the piece alone would, under the force that acts late."""
    made, speeds = pieces(False), np.array([0.1, -0.2, 0.3, -0.4])
    found = np.split(runs(made, axis, speeds), made.starts[1:])
    pull = np.split(late(FORCE, axis.lag / DT), made.starts[1:])
    at_once = axis._replace(lag=0.0)
    at = made.rows.run.x[made.starts]
    for one, force, x, v in zip(found, pull, at, speeds, strict=True):
        np.testing.assert_allclose(one, simulate(at_once, force, DT, x, v) - x, atol=1e-12)
    free = np.split(runs(made._replace(free=True), axis, speeds), made.starts[1:])
    for one, other in zip(free, found, strict=True):
        np.testing.assert_allclose(one, other - other.mean(), atol=1e-12)


def test_the_kernel_gives_the_same_compiled() -> None:
    made, speeds = pieces(False), np.array([0.1, -0.2, 0.3, -0.4])
    at, hung = made.rows.run.x[made.starts], TRUTH._replace(sine=2.0, cosine=5.0)
    plain, fast = np.empty(3000), np.empty(3000)
    restarted(hung, FORCE, made.starts, at, speeds, DT, plain)
    compiled(restarted)(hung, FORCE, made.starts, at, speeds, DT, fast)
    np.testing.assert_allclose(fast, plain, rtol=1e-12, atol=1e-15)


def test_starts_are_found_to_the_noise_and_below_it() -> None:
    noise = 1e-3
    made = pieces(True, noise=noise)
    at = settled(made, TRUTH)
    assert np.sqrt(np.mean(at.error**2)) == pytest.approx(noise, rel=0.05)
    v = np.gradient(simulate(TRUTH, FORCE, DT, 0.3), DT)[made.starts]
    np.testing.assert_allclose(at.speeds[1:], v[1:], atol=2e-3)  # the first one sticks
    assert np.abs(made.rows.v[made.starts] - v).max() > 4e-3
    quiet = settled(pieces(True), TRUTH)
    assert np.abs(quiet.error).max() < 1e-4


def test_measured_starts_are_taken_as_they_are() -> None:
    """Slow ones as rest; nothing of the errors is taken up."""
    made = pieces(False)
    at = settled(made, TRUTH)
    v = made.rows.v[made.starts]
    slow = np.abs(v) <= 0.02 * np.abs(made.rows.v).max()
    np.testing.assert_array_equal(at.speeds, np.where(slow, 0.0, v))
    assert slow[0] and not slow[1:].any()
    assert (at.error[made.starts] == 0.0).all() and not at.slope.any()
    np.testing.assert_array_equal(cleared(made, at, T), T)


def test_what_a_free_start_takes_up_is_cleared() -> None:
    """A change of its position or speed leaves nothing; what is left is no such change."""
    made = pieces(True)
    at = settled(made, TRUTH)
    shift = np.repeat([1.0, -2.0, 3.0, 4.0], made.lengths)
    assert np.abs(cleared(made, at, shift * (1.0 + at.slope))).max() < 1e-9
    rest = cleared(made, at, np.sin(40.0 * T))
    for part, slope in zip(*(np.split(a, made.starts[1:]) for a in (rest, at.slope)), strict=True):
        assert abs(part.sum()) < 1e-8 and abs(part @ slope) < 1e-8
        assert slope @ slope == pytest.approx(1.0)


def test_a_piece_that_begins_at_rest_stays_there_where_rest_is_another_thing() -> None:
    """Elastic friction at rest is in balance; beside the least speed it is at its level."""
    made = pieces(True, noise=1e-5)
    still = made.rows.v.copy()
    still[made.starts[:2]] = 0.0
    made = made._replace(rows=made.rows._replace(v=still))
    held = settled(made._replace(rests=True), TRUTH)
    loose = settled(made, TRUTH)
    assert held.speeds[:2].tolist() == [0.0, 0.0]
    assert (loose.speeds[1:] != 0.0).all()
    np.testing.assert_allclose(held.speeds[2:], loose.speeds[2:], rtol=1e-9)
    first = np.split(held.slope, made.starts[1:])
    assert not first[0].any() and not first[1].any() and first[2].any()
    # What a start at rest does not explain stays, but for the place.
    noise = np.random.default_rng(2).normal(size=3000)
    kept = np.split(cleared(made, held, noise), made.starts[1:])[0]
    np.testing.assert_allclose(kept, noise[: made.starts[1]] - noise[: made.starts[1]].mean())


HUNG = Axis(0.01, 0.08, 0.02, 0.01, sine=0.12, cosine=-0.16)


def hung(noise: float = 1e-4) -> Pieces:
    """Two pieces of a load that gravity pulls at."""
    push = 0.3 * np.sin(3.0 * T) + 0.2 * np.sin(11.0 * T)
    x = simulate(HUNG, push, DT, 0.5) + noise * np.random.default_rng(3).normal(size=3000)
    return cut([differences(Run(T, push, x), push, 40.0, 4, eccentric=True)], 1500, True)[0]


def test_a_load_that_hangs_is_placed_better_than_by_its_first_sample() -> None:
    """Gravity differs from place to place: a start that is off does not shift all that follows."""
    made, true = hung(), hung(0.0)
    assert made.placed and not made._replace(free=False).placed and not pieces(True).placed
    at = settled(made, HUNG)
    wanted = true.rows.run.x[true.starts]
    first = np.abs(made.rows.run.x[made.starts] - wanted)
    assert first.max() > 5e-5 and np.abs(at.at - wanted).max() < 3e-5
    assert np.sqrt(np.mean(at.error**2)) == pytest.approx(1e-4, rel=0.05)
    # Positions, not ways: what is off by a constant is seen.
    off = settled(
        made._replace(rows=made.rows._replace(run=Run(T, T, made.rows.run.x + 0.1))), HUNG
    )
    assert np.sqrt(np.mean(off.error**2)) > 1e-2


def test_what_place_and_speed_of_a_start_take_up_is_cleared() -> None:
    made = hung()
    at = settled(made, HUNG)
    for one, other in ((at.slope, at.slope), (at.shift, at.shift), (at.slope, at.shift)):
        dots = np.add.reduceat(one * other, made.starts)
        assert dots == pytest.approx(np.full(2, float(one is other)), abs=1e-9)
    moved = runs(made, HUNG, at.speeds + 1e-5, at.at - 1e-5) - runs(made, HUNG, at.speeds, at.at)
    left = cleared(made, at, moved)
    assert np.abs(left).max() < 0.05 * np.abs(moved).max()
    assert np.abs(cleared(made, at, np.ones(3000))).max() > 0.5
