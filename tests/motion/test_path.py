"""Paths in a plane: lengths, ends, directions that go over into one another, distances."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.motion import path

places = st.floats(-0.3, 0.3)
points = st.tuples(places, places)
angles = st.floats(-7.0, 7.0).filter(lambda a: abs(a) > 1e-3)


def numeric_length(piece, n=4001):
    x, y = piece.at(np.linspace(0.0, piece.length, n))
    return float(np.sum(np.hypot(np.diff(x), np.diff(y))))


@given(points, points)
def test_a_line_goes_straight_from_one_point_to_the_other(begin, end):
    assume(math.dist(begin, end) > 1e-6)
    piece = path.line(begin, end)
    assert piece.length == pytest.approx(math.dist(begin, end), rel=1e-12)
    assert piece.end == pytest.approx(end, abs=1e-12)
    assert math.hypot(piece.ux, piece.uy) == pytest.approx(1.0, rel=1e-12)


def test_a_line_along_an_axis_has_nothing_of_the_other():
    assert path.line((0.1, 0.2), (0.1, 0.5))[2:4] == (0.0, 1.0)
    assert path.line((0.1, 0.2), (-0.3, 0.2))[2:4] == (-1.0, 0.0)


@given(points, points, angles)
def test_an_arc_stays_at_its_radius_and_ends_where_it_is_turned_to(begin, centre, angle):
    radius = math.dist(begin, centre)
    assume(radius > 1e-4)
    piece = path.arc(begin, centre, angle)
    assert piece.length == pytest.approx(radius * abs(angle), rel=1e-12)
    assert numeric_length(piece) == pytest.approx(piece.length, rel=1e-5)
    x, y = piece.at(np.linspace(0.0, piece.length, 50))
    assert np.hypot(x - centre[0], y - centre[1]) == pytest.approx(radius, abs=1e-12)
    first = math.atan2(begin[1] - centre[1], begin[0] - centre[0])
    end = (
        centre[0] + radius * math.cos(first + angle),
        centre[1] + radius * math.sin(first + angle),
    )
    assert piece.end == pytest.approx(end, abs=1e-12)


@given(points, points, angles, st.floats(0.0, 1.0))
def test_the_direction_is_the_derivative_of_the_place(begin, centre, angle, share):
    assume(math.dist(begin, centre) > 1e-3)
    piece = path.arc(begin, centre, angle)
    h, s = 1e-6 * piece.length, share * piece.length
    (xa, xb), (ya, yb) = piece.at(np.array([s - h, s + h]))
    ux, uy = piece.direction(s)
    assert ((xb - xa) / (2 * h), (yb - ya) / (2 * h)) == pytest.approx((ux, uy), abs=1e-5)


@given(points, points, angles)
def test_the_extent_holds_every_place_and_no_more(begin, centre, angle):
    assume(math.dist(begin, centre) > 1e-3)
    piece = path.arc(begin, centre, angle)
    x, y = piece.at(np.linspace(0.0, piece.length, 5001))
    found = (x.min(), x.max(), y.min(), y.max())
    assert piece.extent == pytest.approx(found, abs=2e-6 * piece.length + 1e-9)
    assert piece.extent[0] <= x.min() + 1e-12 and piece.extent[3] >= y.max() - 1e-12


@pytest.mark.parametrize("end", [(0.3, 0.2), (-0.1, 0.1), (0.1, -0.4)])
def test_the_extent_of_a_line_is_that_of_its_ends(end):
    (a, b), (c, d) = sorted((0.1, end[0])), sorted((0.1, end[1]))
    assert path.line((0.1, 0.1), end).extent == pytest.approx((a, b, c, d), abs=1e-15)


@given(points, points, angles, points)
def test_no_place_of_a_piece_is_nearer_than_the_nearest(begin, centre, angle, other):
    assume(math.dist(begin, centre) > 1e-3)
    for piece in (path.arc(begin, centre, angle), path.line(begin, centre)):
        s = piece.nearest(np.array([other[0]]), np.array([other[1]]))
        assert 0.0 <= s[0] <= piece.length * (1 + 1e-12)
        x, y = piece.at(s)
        every = piece.at(np.linspace(0.0, piece.length, 2001))
        least = np.min(np.hypot(every[0] - other[0], every[1] - other[1]))
        assert math.hypot(x[0] - other[0], y[0] - other[1]) <= least + 1e-12


@st.composite
def walks(draw):
    """Points with corners of less than 150 deg, legs of 20 to 80 mm."""
    found, heading = [(0.0, 0.0)], draw(st.floats(0.0, 6.2))
    for _ in range(draw(st.integers(2, 6))):
        way = draw(st.floats(0.02, 0.08))
        x, y = found[-1]
        found.append((x + way * math.cos(heading), y + way * math.sin(heading)))
        heading += draw(st.floats(-2.6, 2.6))
    return found


@given(walks(), st.floats(1e-4, 2e-3))
def test_rounded_corners_keep_the_ends_and_have_no_corner(corners, radius):
    pieces = path.round_corners(corners, radius, "test")
    assert (pieces[0].x, pieces[0].y) == pytest.approx(corners[0], abs=1e-12)
    assert pieces[-1].end == pytest.approx(corners[-1], abs=1e-10)
    for before, after in itertools.pairwise(pieces):
        assert before.end == pytest.approx((after.x, after.y), abs=1e-10)
        assert path.turning(before, after) == pytest.approx(0.0, abs=1e-9)
    bent = [abs(1.0 / p.curvature) for p in pieces if p.curvature]
    assert bent == pytest.approx([radius] * len(bent), rel=1e-9)
    length = sum(p.length for p in pieces)
    legs = list(itertools.pairwise(corners))
    way = sum(math.dist(a, b) for a, b in legs)
    turns = [path.turning(path.line(*a), path.line(*b)) for a, b in itertools.pairwise(legs)]
    cut = sum(radius * (2.0 * math.tan(0.5 * abs(t)) - abs(t)) for t in turns if abs(t) > 1e-9)
    assert length == pytest.approx(way - cut, abs=1e-9)


def test_a_turn_to_the_left_is_positive():
    east, north = path.line((0, 0), (1, 0)), path.line((1, 0), (1, 1))
    assert path.turning(east, north) == pytest.approx(math.pi / 2)
    assert path.turning(north, path.line((1, 1), (2, 1))) == pytest.approx(-math.pi / 2)


@pytest.mark.parametrize(
    ("corners", "radius", "what"),
    [
        ([(0, 0), (0, 0)], 0.1, "point 2: the same as the point before"),
        ([(0, 0), (1, 0), (0, 0)], 0.1, "point 2: a turn by 180 deg"),
        ([(0, 0), (1, 0), (1, 1)], 1.01, "rounding: '1010 mm'; accepted: at most 1000 mm"),
        ([(0, 0), (1, 0), (1, 1), (2, 1)], 0.6, "at most 500 mm between points 2 and 3"),
        ([(0, 0), (3, 0), (3, 0.4)], 0.5, "at most 400 mm between points 2 and 3"),
    ],
)
def test_corners_without_room_are_refused(corners, radius, what):
    with pytest.raises(InputError, match=what):
        path.round_corners(corners, radius, "test")


def test_straight_on_there_is_no_arc():
    pieces = path.round_corners([(0, 0), (1, 0), (2, 0)], 0.5, "test")
    assert [p.curvature for p in pieces] == [0.0, 0.0]
    exact = path.round_corners([(0, 0), (1, 0), (1, 1)], 1.0, "test")
    assert len(exact) == 1 and exact[0].curvature == pytest.approx(1.0)
