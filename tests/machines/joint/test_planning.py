"""Coordinated moves: one profile along the path, within both axes' limits and the path's."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.machines import programmes
from macromicro.machines.joint import course, planning
from macromicro.machines.joint.course import Leg
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.joint.settings import AXES, DEFAULT, of
from macromicro.machines.moves import Course
from macromicro.motion import path, s_curve
from tests.machines.joint.axes import straight

SLACK = 1.0 + 1e-9


def sampled(plan, k, move=0, n=4000):
    """Place, speed and acceleration of one axis over one move."""
    p = plan.plans[k]
    pieces = p.pieces[p.first[move] : p.first[move + 1]]
    t = np.linspace(0.0, p.length[move], n)
    at = np.clip(np.searchsorted(pieces[:, 0], t, side="right") - 1, 0, len(pieces) - 1)
    h, (x, v, a, j) = t - pieces[at, 0], pieces[at, 1:].T
    return (
        t,
        x + h * (v + h * (a / 2 + h * j / 6)),
        v + h * (a + h * j / 2),
        a + h * j,
    )


def arc_course(radius, angle, speed=math.inf):
    begin = (0.1, 0.1 - radius)
    piece = path.arc(begin, (0.1, 0.1), angle)
    leg = Leg("arc", (piece,), (speed,), piece.end, 0.1)
    return Course("test", (*straight(begin).legs, leg), "test")


ends = st.tuples(st.floats(0.0, 0.19), st.floats(0.0, 0.19)).filter(lambda p: math.hypot(*p) > 1e-3)


@given(ends, ends)
def test_both_axes_keep_their_limits_and_one_of_all_is_reached(first, second):
    if math.dist(first, second) < 1e-3:
        return
    plan = planning.plan(straight(first, second), DEFAULT)
    for move, begin, end in ((0, (0.0, 0.0), first), (1, first, second)):
        used = []
        for k, own in enumerate(of(DEFAULT)):
            _, x, v, a = sampled(plan, k, move)
            motion = own.motion
            assert np.abs(v).max() <= motion.velocity * SLACK
            assert np.abs(a).max() <= motion.acceleration * SLACK
            assert np.abs(plan.plans[k].pieces[:, 4]).max() <= motion.jerk * SLACK
            assert (x[0], x[-1]) == pytest.approx((begin[k], end[k]), abs=1e-12)
            way = abs(end[k] - begin[k])
            if way > 1e-9:
                least = s_curve(way, *motion).duration
                used.append(least / plan.plans[k].length[move])
        assert max(used) <= SLACK  # no faster than each axis could alone
    assert np.array_equal(plan.plans[0].length, plan.plans[1].length)
    assert np.array_equal(plan.plans[0].pieces[:, 0], plan.plans[1].pieces[:, 0])


@pytest.mark.parametrize(("end", "slower"), [((0.1, 0.02), 0), ((0.004, 0.18), 1), ((0.1, 0.1), 0)])
def test_a_coordinated_move_takes_as_long_as_the_slower_axis(end, slower):
    plan = planning.plan(straight(end), DEFAULT)
    alone = [s_curve(way, *own.motion).duration for way, own in zip(end, of(DEFAULT), strict=True)]
    assert alone[slower] == max(alone)
    assert plan.plans[0].length[0] == pytest.approx(max(alone), rel=1e-9)


def test_the_path_has_limits_of_its_own():
    slow = DEFAULT.with_({"path.speed": "50 mm/s", "path.acceleration": "0.5 m/s^2"})
    plan = planning.plan(straight((0.1, 0.1)), slow)
    speed = np.hypot(*(sampled(plan, k)[2] for k in (0, 1)))
    pull = np.hypot(*(sampled(plan, k)[3] for k in (0, 1)))
    assert speed.max() == pytest.approx(0.05, rel=1e-9)
    assert pull.max() == pytest.approx(0.5, rel=1e-9)


@given(st.floats(0.005, 0.09), st.sampled_from([-7.0, -1.0, 0.4, 3.0, path.TURN]))
def test_an_arc_keeps_speed_and_acceleration_in_the_plane(radius, angle):
    plan = planning.plan(arc_course(radius, angle), DEFAULT)
    most = min(own.motion.acceleration for own in of(DEFAULT))
    parts = [sampled(plan, k, 1, 20000) for k in (0, 1)]
    speed, pull = (np.hypot(*(p[n] for p in parts)) for n in (2, 3))
    assert pull.max() <= most * 1.002  # as cubics; the arc itself keeps it
    assert speed.max() <= math.sqrt(planning.CENTRAL * most * radius) * (1.0 + 1e-6)
    assert np.hypot(parts[0][1] - 0.1, parts[1][1] - 0.1) == pytest.approx(radius, abs=2e-8)
    central = speed**2 / radius
    if abs(angle) > 3.0:  # long enough to get there: by the acceleration, or by what turns with it
        jerk = min(own.motion.jerk for own in of(DEFAULT))
        fastest = min(
            math.sqrt(planning.CENTRAL * most * radius),
            math.cbrt(planning.CENTRAL * jerk * radius**2),
        )
        assert speed.max() == pytest.approx(fastest, rel=1e-3)
        assert central.max() <= planning.CENTRAL * most * (1.0 + 1e-6)


def test_a_speed_of_its_own_holds_for_one_path():
    plan = planning.plan(arc_course(0.05, path.TURN, 0.03), DEFAULT)
    speed = np.hypot(*(sampled(plan, k, 1)[2] for k in (0, 1)))
    assert speed.max() == pytest.approx(0.03, rel=1e-6)


def test_along_an_axis_the_other_one_stands_exactly():
    plan = planning.plan(straight((0.1, 0.0), (0.1, 0.15)), DEFAULT)
    x, y = (p.pieces for p in plan.plans)
    first = slice(0, plan.plans[0].first[1])
    assert np.all(y[first, 1:] == 0.0) and np.any(x[first, 2] > 0.0)
    rest = slice(plan.plans[0].first[1], None)
    assert np.all(x[rest, 2:] == 0.0) and np.all(x[rest, 1] == 0.1)


def test_the_way_of_the_set_point_is_that_of_its_places():
    plan = planning.plan(arc_course(0.05, path.TURN), DEFAULT)
    trace, dt = plan.traces[1], DEFAULT.x.timing.period
    length = plan.plans[0].length[1]
    assert len(trace.s) == math.ceil(length / dt) + 1
    assert trace.s[-1] == pytest.approx(trace.border[-1], rel=1e-9) == pytest.approx(0.1 * math.pi)
    n = len(trace.s) // 3
    x, y = trace.pieces[0].at(trace.s[n])
    for k, place in enumerate((x, y)):
        t, at, *_ = sampled(plan, k, 1, 200001)
        assert np.interp(n * dt, t, at) == pytest.approx(float(place), abs=1e-7)


@pytest.mark.parametrize("angle", [path.TURN, -0.5])
def test_a_tiny_arc_is_round(angle):
    begin = (0.05 - 1e-4, 0.05)
    piece = path.arc(begin, (0.05, 0.05), angle)
    leg = Leg("arc", (piece,), (math.inf,), piece.end, 0.1)
    quick = DEFAULT.with_({f"{name}.motion.jerk": "1e5 m/s^3" for name in AXES})
    plan = planning.plan(Course("t", (*straight(begin).legs, leg), "t"), quick)
    x, y = (sampled(plan, k, 1, 20000)[1] for k in (0, 1))
    assert np.hypot(x - 0.05, y - 0.05) == pytest.approx(1e-4, abs=2e-9)


@pytest.mark.parametrize(
    ("end", "what"),
    [((0.31, 0.1), "x: '310 mm'"), ((0.1, 0.25), "y: '250 mm'"), ((0.1, -0.01), "y: '-10 mm'")],
)
def test_a_target_beyond_either_end_is_refused(end, what):
    with pytest.raises(InputError, match=f"move 1, {what}; accepted: "):
        planning.plan(straight(end), DEFAULT)


def test_a_path_beyond_the_travel_is_refused_where_it_bulges_out():
    with pytest.raises(InputError, match=r"move 1, x: '-1 mm'; accepted: 0 mm to .*x.travel"):
        planning.plan(straight((-0.001, 0.01)), DEFAULT)
    over = Course(
        "t", (*straight((0.02, 0.05)).legs, *_arc((0.02, 0.05), (0.05, 0.05), -math.pi)), "t"
    )
    planning.plan(over, DEFAULT)
    out = Course("t", (*straight((0.0, 0.02)).legs, *_arc((0.0, 0.02), (0.0, 0.05), -1.0)), "t")
    with pytest.raises(InputError, match=r"move 2, x"):
        planning.plan(out, DEFAULT)


def _arc(begin, centre, angle):
    piece = path.arc(begin, centre, angle)
    return (Leg("arc", (piece,), (math.inf,), piece.end, 0.1),)


def cycled(programme, cycles):
    return programmes.repeat(XY_MACHINE, programme, cycles)


def test_cycles_go_on_from_where_the_one_before_ended():
    there = straight((0.05, 0.02), (0.1, 0.1))
    twice = planning.plan(cycled(there, 2), DEFAULT)
    assert [leg.end for leg in twice.legs] == [(0.05, 0.02), (0.1, 0.1)] * 2
    again = twice.legs[2].pieces[0]
    assert (again.x, again.y) == (0.1, 0.1) and again.end == pytest.approx((0.05, 0.02), abs=1e-15)
    back = planning.plan(cycled(straight((0.05, 0.02), (0.0, 0.0)), 3), DEFAULT)
    assert len(back.legs) == 6
    usual = planning.plan(cycled(course.usual(DEFAULT), 2), DEFAULT)
    assert len(usual.legs) == 2 * len(course.usual(DEFAULT).legs)
    begin = Course("t", _arc((0.0, 0.0), (0.05, 0.0), -math.pi), "t")
    rounds = planning.plan(cycled(begin, 2), DEFAULT)
    assert [leg.name for leg in rounds.legs] == ["arc", "line", "arc"]
    assert rounds.legs[1].end == (0.0, 0.0)


def test_a_move_to_where_it_is_takes_no_time():
    plan = planning.plan(straight((0.0, 0.0), (0.05, 0.0)), DEFAULT)
    assert plan.plans[0].length[0] == 0.0 and plan.traces[0].pieces == ()
    assert plan.plans[0].length[1] > 0.0


def test_a_trajectory_goes_through_its_places_at_its_times():
    t = np.linspace(0.0, 2.0, 41)
    x, y = 0.05 + 0.02 * np.cos(math.pi * t), 0.05 + 0.02 * np.sin(math.pi * t)
    track = Leg("trajectory", (), (), (x[-1], y[-1]), 0.1, np.array([t, x, y]))
    plan = planning.plan(Course("t", (*straight((x[0], y[0])).legs, track), "t"), DEFAULT)
    assert plan.plans[0].length[1] == pytest.approx(2.0)
    for k, wanted in enumerate((x, y)):
        times, at, *_ = sampled(plan, k, 1, 40001)
        assert np.interp(t, times, at) == pytest.approx(wanted, abs=1e-6)
    trace = plan.traces[1]
    assert trace.border[-1] == pytest.approx(0.04 * math.pi, rel=1e-3)
    assert len(trace.s) == 2001
    fast = np.array([0.02 * t, x, y])
    with pytest.raises(InputError, match=r"x, move 2: '.* m/s'; accepted: at most"):
        planning.plan(
            Course("t", (*straight((x[0], y[0])).legs, track._replace(times=fast)), "t"), DEFAULT
        )


def test_usual_moves_lie_within_the_travel_of_both():
    plan = planning.plan(course.usual(DEFAULT), DEFAULT)
    assert [leg.name for leg in plan.legs].count("arc") == 1
    assert plan.legs[-1].end == (0.0, 0.0)


def test_a_trajectory_that_leaves_the_travel_of_an_axis_between_its_points_is_refused(tmp_path):
    t, top = np.arange(0.0, 4.01, 0.2), 1e3 * DEFAULT.y.travel.high
    y = np.interp(t, [0.0, 1.6, 1.8, 2.0, 2.2, 4.0], [0.0, top - 40.0, top, top, top - 40.0, 0.0])
    rows = [f"{a:.1f},{10 * a:.3f},{b:.3f}" for a, b in zip(t, np.floor(y), strict=True)]
    (tmp_path / "p.csv").write_text("\n".join(["t_s,x_mm,y_mm", *rows, ""]))
    with pytest.raises(InputError, match=r"y, move 2: .* at \S+ mm, \S+ mm outside"):
        planning.plan(course.load(tmp_path / "p.csv"), DEFAULT)
