"""Speeds along a path: within the limits of each piece, quick, and without a jump."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.motion import s_curve
from macromicro.motion.feed import Limits, feed

limits = st.builds(Limits, st.floats(0.02, 1.0), st.floats(0.2, 20.0), st.floats(5.0, 2000.0))
pieces = st.lists(st.tuples(st.floats(1e-4, 0.2), limits), min_size=1, max_size=7)


def ends(segment):
    h, p, v, a, j = segment
    return (
        p + h * (v + h * (a / 2 + h * j / 6)),
        v + h * (a + h * j / 2),
        a + h * j,
    )


@given(pieces)
def test_every_piece_is_run_from_its_beginning_to_its_end_within_its_limits(chain):
    lengths, most = [c[0] for c in chain], [c[1] for c in chain]
    runs = feed(lengths, most)
    before = 0.0
    for length, own, run in zip(lengths, most, runs, strict=True):
        place, speed, pull = 0.0, before, 0.0
        for segment in run:
            assert segment.position == pytest.approx(place, abs=1e-9 * length + 1e-13)
            assert segment.velocity == pytest.approx(speed, abs=1e-7)
            assert segment.acceleration == pytest.approx(pull, abs=1e-6 * own.acceleration)
            assert abs(segment.jerk) <= own.jerk * (1 + 1e-9)
            place, speed, pull = ends(segment)
            assert speed <= own.speed * (1 + 1e-9) and speed >= -1e-7
            assert abs(pull) <= own.acceleration * (1 + 1e-9)
        assert place == pytest.approx(length, rel=1e-9)
        assert pull == pytest.approx(0.0, abs=1e-6 * own.acceleration)
        before = speed
    assert before == pytest.approx(0.0, abs=1e-7)


def duration(runs):
    return sum(s.duration for run in runs for s in run)


@given(st.floats(1e-3, 0.5), limits)
def test_one_piece_is_the_quickest_profile(length, own):
    run = feed([length], [own])
    assert run[0] == list(s_curve(length, *own).segments)


def test_a_long_path_in_pieces_is_hardly_slower_than_in_one():
    own = Limits(0.2, 2.0, 200.0)
    alone = s_curve(1.0, *own).duration
    assert duration(feed([0.5, 0.5], [own, own])) == pytest.approx(alone, rel=1e-9)


def test_what_follows_is_seen_in_time():
    fast, slow = Limits(1.0, 5.0, 500.0), Limits(0.05, 5.0, 500.0)
    runs = feed([0.3, 0.02, 0.3], [fast, slow, fast])
    speeds = [s.velocity for s in runs[1]]
    assert max(speeds) == pytest.approx(0.05, rel=1e-9)
    assert max(s.velocity for s in runs[0]) > 0.8
    assert min(speeds) == pytest.approx(0.05, rel=1e-9)
    # Through a hundred pieces, too short to brake in, it comes to rest at the end; the
    # acceleration is 0 where they meet, which takes its time (0.7 m/s in one piece).
    many = feed([1e-3] * 100, [fast] * 100)
    last = np.array([ends(run[-1])[1] for run in many])
    assert last[-1] == pytest.approx(0.0, abs=1e-9) and last.max() > 0.25
    assert np.all(np.diff(last[:40]) > 0.0) and np.all(np.diff(last[60:]) < 0.0)


def test_the_fastest_within_a_piece_is_reached():
    own = Limits(1.0, 4.0, 400.0)
    runs = feed([0.05, 0.05], [own, own])
    peak = max(ends(s)[1] for run in runs for s in run)
    # From rest, an S-curve over 50 mm: v (v/a + a/j) / 2 = 0.05 m.
    expected = math.sqrt(0.02**2 + 2.0 * 0.05 * 4.0) - 0.02
    assert peak == pytest.approx(expected, rel=1e-9)
