"""How far from its path a place is."""

import math

import numpy as np
import pytest

from macromicro.machines.joint import contour, planning
from macromicro.machines.joint.course import Leg
from macromicro.machines.joint.settings import DEFAULT
from macromicro.machines.moves import Course
from macromicro.motion import path
from tests.machines.joint.axes import straight


def trace_of(*pieces):
    leg = Leg("path", pieces, (math.inf,) * len(pieces), pieces[-1].end, 0.1)
    to = straight((pieces[0].x, pieces[0].y)).legs
    return planning.plan(Course("test", (*to, leg), "test"), DEFAULT).traces[1]


def places(trace):
    """The set point at each control period."""
    k = np.clip(np.searchsorted(trace.border, trace.s, side="right") - 1, 0, len(trace.pieces) - 1)
    found = [trace.pieces[n].at(s - trace.border[n]) for n, s in zip(k, trace.s, strict=True)]
    return tuple(np.array(each, dtype=float) for each in zip(*found, strict=True))


def test_the_set_point_is_on_its_path():
    trace = trace_of(
        path.line((0.02, 0.02), (0.06, 0.02)), path.arc((0.06, 0.02), (0.06, 0.05), math.pi)
    )
    x, y = places(trace)
    assert x[0] == 0.02 and (x[-1], y[-1]) == pytest.approx((0.06, 0.08), abs=1e-12)
    off = contour.contour_error(trace, x, y)
    assert off.distance.max() < 1e-15


def test_beside_an_arc_the_distance_is_along_the_radius():
    trace = trace_of(path.arc((0.05, 0.02), (0.05, 0.05), path.TURN))
    x, y = places(trace)
    out = 1.0 + 2e-4 / 0.03
    off = contour.contour_error(trace, 0.05 + out * (x - 0.05), 0.05 + out * (y - 0.05))
    assert off.distance == pytest.approx(np.full(len(x), 2e-4), rel=1e-9)
    assert off.x == pytest.approx(x, abs=1e-12) and off.y == pytest.approx(y, abs=1e-12)


def test_what_lags_on_the_path_is_not_beside_it():
    trace = trace_of(path.line((0.02, 0.02), (0.1, 0.06)))
    x, y = places(trace)
    late = contour.contour_error(
        trace, np.r_[np.full(9, x[0]), x[:-9]], np.r_[np.full(9, y[0]), y[:-9]]
    )
    assert late.distance.max() < 1e-15


def test_what_lags_behind_a_corner_is_still_on_the_piece_before():
    trace = trace_of(path.line((0.02, 0.02), (0.06, 0.02)), path.line((0.06, 0.02), (0.06, 0.05)))
    x, y = places(trace)
    late = contour.contour_error(
        trace, np.r_[np.full(9, x[0]), x[:-9]], np.r_[np.full(9, y[0]), y[:-9]]
    )
    assert late.distance.max() < 1e-12
    early = contour.contour_error(
        trace, np.r_[x[9:], np.full(9, x[-1])], np.r_[y[9:], np.full(9, y[-1])]
    )
    assert early.distance.max() < 1e-12


def test_a_path_that_crosses_itself_has_two_branches():
    """Near the crossing of an eight the nearest branch is not the one that is run."""
    first = path.arc((0.1, 0.1), (0.07, 0.1), -path.TURN)
    second = path.arc((0.1, 0.1), (0.13, 0.1), path.TURN)
    trace = trace_of(first, second)
    x, y = places(trace)
    # 3 mm beyond the crossing on the first loop, pushed out by 0.2 mm.
    k = int(np.searchsorted(trace.s, 0.003))
    out = 1.0 + 2e-4 / 0.03
    x[k], y[k] = 0.07 + out * (x[k] - 0.07), 0.1 + out * (y[k] - 0.1)
    off = contour.contour_error(trace, x, y)
    assert off.distance[k] == pytest.approx(2e-4, rel=1e-6)
    # A set point far away does not borrow the other loop's distance.
    far = int(np.searchsorted(trace.s, 0.25 * path.TURN * 0.03))
    x[far], y[far] = x[far] + 1e-4, y[far] + 1e-4
    assert contour.contour_error(trace, x, y).distance[far] > 1e-5


def test_after_its_end_the_end_is_the_nearest():
    trace = trace_of(path.line((0.02, 0.02), (0.06, 0.02)))
    x, y = (np.r_[each, np.full(5, each[-1] + 3e-4)] for each in places(trace))
    off = contour.contour_error(trace, x, y)
    assert off.distance[-1] == pytest.approx(3e-4 * math.sqrt(2.0))
    assert (off.x[-1], off.y[-1]) == pytest.approx((0.06, 0.02), abs=1e-12)
