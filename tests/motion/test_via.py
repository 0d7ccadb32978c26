"""Through several points: at rest at each, or only where the direction changes."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.motion import s_curve, through, trapezoid

points = st.lists(st.integers(-20, 20).map(lambda n: n / 100.0), min_size=2, max_size=8)


@given(points, st.floats(0.0, 1.0), st.sampled_from([None, 5.0]))
def test_it_rests_at_every_point(places: list[float], dwell: float, jerk: float | None) -> None:
    made = through(places, 0.2, 1.0, jerk, dwell=dwell)
    t = 0.0
    for k, (here, there) in enumerate(itertools.pairwise(places)):
        t += dwell * (k > 0)
        leg = (trapezoid(there - here, 0.2, 1.0) if jerk is None
               else s_curve(there - here, 0.2, 1.0, jerk))  # fmt: skip
        t += leg.duration
        # By its own polynomials, from just before: the velocity there is rounding alone.
        found = made.at(np.nextafter(t, 0.0))
        assert found.position == pytest.approx(there, abs=1e-12)
        assert found.velocity == pytest.approx(0.0, abs=1e-12)
        assert made.at(t + dwell / 2).position == pytest.approx(there, abs=1e-12)
    assert made.duration == pytest.approx(t)
    assert (made.start, made.end) == (places[0], places[-1])
    assert made.at(made.duration).position == places[-1]


def turns(place: np.ndarray) -> list[float]:
    """First, last, and where the sign of the steps changes; steps of rounding left out."""
    kept = [place[0]]
    for here in place[1:]:
        if abs(here - kept[-1]) < 1e-12:
            continue
        if len(kept) > 1 and (here > kept[-1]) == (kept[-1] > kept[-2]):
            kept[-1] = here
        else:
            kept.append(here)
    return [float(x) for x in kept]


@given(points, st.sampled_from([None, 5.0]))
def test_without_stops_it_turns_where_the_points_do(
    places: list[float], jerk: float | None
) -> None:
    made = through(places, 0.2, 1.0, jerk, stop=False)
    assert made.duration <= through(places, 0.2, 1.0, jerk).duration * (1 + 1e-12)
    t = np.unique(np.concatenate([np.linspace(0.0, made.duration, 501), made.borders]))
    place = made.at(t).position
    # Their ends and turning points in their order, so every other point on the way between.
    assert turns(place) == pytest.approx(turns(np.array(places)), abs=1e-12)


def test_points_on_the_way_cost_no_time() -> None:
    straight = s_curve(0.3, 0.2, 1.0, 5.0)
    assert through([0.0, 0.1, 0.1, 0.25, 0.3], 0.2, 1.0, 5.0, stop=False) == straight
    there = through([0.0, 0.1, 0.3, 0.2, 0.0], 0.2, 1.0, 5.0, stop=False, dwell=0.5)
    assert there.duration == pytest.approx(2 * straight.duration + 0.5)
    assert through([0.1, 0.1], 0.2, 1.0).segments == ()


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"points": [0.1]}, "points: there are fewer than two. "),
        ({"points": [0.0, math.nan]}, "points[1]: nan"),
        ({"dwell": -1.0}, "dwell: -1.0"),
        ({"dwell": math.inf}, "dwell: inf"),
        ({"velocity": 0.0}, "velocity: 0.0"),
        ({"jerk": -2.0}, "jerk: -2.0"),
    ],
)
def test_what_is_refused(change: dict[str, object], where: str) -> None:
    given = {"points": [0.0, 0.1], "velocity": 1.0, "acceleration": 1.0, "jerk": 1.0}
    with pytest.raises(InputError) as caught:
        through(**(given | change))  # type: ignore[arg-type]
    assert str(caught.value).startswith((where, where + "; accepted: ")[not where.endswith(". ")])
