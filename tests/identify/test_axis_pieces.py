"""Free runs over pieces of a record, their starts as measured or found."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.identify.axis import Axis, late, simulate
from macromicro.identify.axis_inverse import Rows, differences
from macromicro.identify.axis_pieces import Pieces, cleared, cut, restarted, runs, settled, slopes
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


@pytest.mark.parametrize("axis", [TRUTH, TRUTH._replace(lag=3.4 * DT, limit=7.0, back=0.2)])
def test_each_piece_runs_from_its_own_start(axis: Axis) -> None:
    """As a simulation of the piece alone would, under the force that acts late."""
    made, speeds = pieces(False), np.array([0.1, -0.2, 0.3, -0.4])
    found = np.split(runs(made, axis, speeds), made.starts[1:])
    pull = np.split(late(FORCE, axis.lag / DT), made.starts[1:])
    at_once = axis._replace(lag=0.0)
    for one, force, v in zip(found, pull, speeds, strict=True):
        np.testing.assert_allclose(one, simulate(at_once, force, DT, 0.0, v), atol=1e-12)
    free = np.split(runs(made._replace(free=True), axis, speeds), made.starts[1:])
    for one, other in zip(free, found, strict=True):
        np.testing.assert_allclose(one, other - other.mean(), atol=1e-12)


def test_the_kernel_gives_the_same_compiled() -> None:
    made, speeds = pieces(False), np.array([0.1, -0.2, 0.3, -0.4])
    plain, fast = np.empty(3000), np.empty(3000)
    restarted(TRUTH, FORCE, made.starts, speeds, DT, plain)
    compiled(restarted)(TRUTH, FORCE, made.starts, speeds, DT, fast)
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
    np.testing.assert_array_equal(cleared(made, at.slope, T), T)


def test_what_a_free_start_takes_up_is_cleared() -> None:
    """A change of its position or speed leaves nothing; what is left is no such change."""
    made = pieces(True)
    at = settled(made, TRUTH)
    shift = np.repeat([1.0, -2.0, 3.0, 4.0], made.lengths)
    assert np.abs(cleared(made, at.slope, shift * (1.0 + at.slope))).max() < 1e-9
    rest = cleared(made, at.slope, np.sin(40.0 * T))
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
    kept = np.split(cleared(made, held.slope, noise), made.starts[1:])[0]
    np.testing.assert_allclose(kept, noise[: made.starts[1]] - noise[: made.starts[1]].mean())


@pytest.mark.parametrize("free", [True, False])
def test_slopes_are_those_of_errors_whose_starts_follow(free: bool) -> None:
    """By differences of the whole thing, each start found anew."""
    made = [pieces(free, noise=1e-5), pieces(free, 1200)]
    at = np.array([2.0, 3.0, 1.5])

    def model(z: np.ndarray) -> Axis:
        return Axis(*z.tolist(), 0.4)

    far = np.full(3, np.inf)
    found = slopes(made, model, at, 1e-3 * at, (-far, far))
    for k in range(3):
        up, down = at.copy(), at.copy()
        up[k], down[k] = 1.001 * at[k], 0.999 * at[k]
        errors = [np.concatenate([settled(p, model(z)).error for p in made]) for z in (up, down)]
        whole = (errors[0] - errors[1]) / (0.002 * at[k])
        miss = np.abs(np.delete(found[:, k] - whole, [0, 3000]))  # these records begin at rest
        assert miss.max() < 0.03 * np.abs(whole).max()
    # A bound halves the way.
    low = np.array([2.0, -np.inf, -np.inf])
    near = slopes(made, model, at, 1e-3 * at, (low, far))
    np.testing.assert_array_equal(near[:, 1:], found[:, 1:])
    assert (near[:, 0] != found[:, 0]).any()
