"""Profiles from rest to rest by their laws: limits, arrival, continuity, least time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.motion import Profile, s_curve, trapezoid

# Millimetres per minute to what a wafer stage does; ways of nanometres to kilometres.
sizes = st.floats(-9.0, 3.0).map(lambda e: 10.0**e)
limits = st.floats(-4.0, 4.0).map(lambda e: 10.0**e)
signs = st.sampled_from([-1.0, 1.0])


@st.composite
def profiles(draw: st.DrawFn) -> tuple[Profile, tuple[float, float, float, float]]:
    """A profile and the limits it was made under: velocity, both accelerations, jerk."""
    way, v, a = draw(signs) * draw(sizes), draw(limits), draw(limits)
    start = draw(st.floats(-1.0, 1.0))
    if draw(st.booleans()):
        j = draw(limits)
        return s_curve(way, v, a, j, start=start), (v, a, a, j)
    b = draw(limits)
    return trapezoid(way, v, a, b, start=start), (v, a, b, math.inf)


def sampled(profile: Profile) -> np.ndarray:
    """Times: each segment's borders, just before them, and between."""
    borders = profile.borders
    inner = np.linspace(borders[:-1], borders[1:], 23, axis=1).ravel()
    return np.sort(np.concatenate([inner, borders, np.nextafter(borders, 0.0)]))


def ended(profile: Profile) -> np.ndarray:
    """Position, velocity and acceleration at each segment's end, by its polynomial alone."""
    t, p, v, a, j = np.array(profile.segments).T
    return np.array([p + v * t + a * t**2 / 2 + j * t**3 / 6, v + a * t + j * t**2 / 2, a + j * t])


@given(profiles())
def test_limits_hold_everywhere(made: tuple[Profile, tuple[float, float, float, float]]) -> None:
    profile, (v, a, b, j) = made
    found = profile.at(sampled(profile))
    assert np.abs(found.velocity).max() <= v * (1 + 1e-12)
    assert np.abs(found.acceleration).max() <= max(a, b) * (1 + 1e-12)
    faster = found.acceleration * math.copysign(1.0, profile.end - profile.start) > 0.0
    assert np.abs(found.acceleration[faster]).max() <= a * (1 + 1e-12)
    if math.isfinite(j):
        assert np.abs(found.jerk).max() <= j


@given(profiles())
def test_it_arrives_exactly_and_never_turns_back(made: tuple[Profile, object]) -> None:
    profile = made[0]
    t = sampled(profile)
    place = profile.at(t).position
    way = profile.end - profile.start
    assert place[0] == profile.start and place[-1] == profile.end
    steps = np.diff(place) * math.copysign(1.0, way)
    assert steps.min() >= -8 * np.finfo(float).eps * max(abs(profile.start), abs(profile.end))
    for t in (profile.duration, profile.duration + 1.0, math.inf):
        assert profile.at(t) == (profile.end, 0.0, 0.0, 0.0)
    assert profile.at(-1e-9) == (profile.start, 0.0, 0.0, 0.0)


@given(profiles())
def test_each_segment_ends_where_the_next_begins(made: tuple[Profile, tuple[float, ...]]) -> None:
    """Position and velocity have no jumps, an S-curve's acceleration has none either."""
    profile, (_, a, b, j) = made
    ends, following = ended(profile), np.array(profile.segments).T[1:4, 1:]
    following = np.column_stack([following, [profile.end, 0.0, 0.0]])
    way = abs(profile.end - profile.start)
    most = abs(profile.start) + way
    assert np.allclose(ends[0], following[0], rtol=0, atol=1e-12 * way + 1e-15 * most)
    top = np.abs(following[1]).max()
    assert np.allclose(ends[1], following[1], rtol=0, atol=1e-9 * top)
    if math.isfinite(j):
        assert profile.at(0.0).acceleration == 0.0
        assert np.allclose(ends[2], following[2], rtol=0, atol=1e-9 * min(a, b))


@given(way=sizes, v=limits, a=limits, b=limits, j=limits, sign=signs)
def test_backwards_is_the_mirror_image(
    way: float, v: float, a: float, b: float, j: float, sign: float
) -> None:
    for there, back in (
        (s_curve(way, v, a, j), s_curve(-way, v, a, j)),
        (trapezoid(way, v, a, b), trapezoid(-way, v, a, b)),
    ):
        t = np.linspace(0.0, there.duration, 101)
        assert np.array_equal(there.at(t), -np.array(back.at(t)))


@given(way=sizes, v=limits, a=limits, b=limits, j=limits)
def test_time_reversed_it_goes_the_other_way(
    way: float, v: float, a: float, b: float, j: float
) -> None:
    """A reversed S-curve is itself; a reversed trapezoid has its accelerations exchanged."""
    for there, back in (
        (s_curve(way, v, a, j), s_curve(way, v, a, j)),
        (trapezoid(way, v, a, b), trapezoid(way, v, b, a)),
    ):
        total = there.duration
        assert back.duration == pytest.approx(total, rel=1e-12)
        t = np.linspace(0.0, total, 101)
        assert np.allclose(way - back.at(total - t).position, there.at(t).position, atol=1e-9 * way)


@given(way=sizes, v=limits, a=limits, j=limits, k=st.floats(0.1, 10.0), c=st.floats(0.1, 10.0))
def test_scales_of_length_and_time(
    way: float, v: float, a: float, j: float, k: float, c: float
) -> None:
    """In units of length `k` and of time `c` the same motion takes the same time."""
    one = s_curve(way, v, a, j)
    other = s_curve(way * k, v * k / c, a * k / c**2, j * k / c**3)
    assert other.duration == pytest.approx(one.duration * c, rel=1e-9)
    one = trapezoid(way, v, a, 2 * a)
    other = trapezoid(way * k, v * k / c, a * k / c**2, 2 * a * k / c**2)
    assert other.duration == pytest.approx(one.duration * c, rel=1e-9)


@given(way=sizes, v=limits, a=limits)
def test_least_time_of_trapezoid_and_triangle(way: float, v: float, a: float) -> None:
    """d/v + v/a where the velocity is reached, else 2 sqrt(d/a)."""
    found = trapezoid(way, v, a).duration
    least = way / v + v / a if way >= v * v / a else 2.0 * math.sqrt(way / a)
    assert found == pytest.approx(least, rel=1e-12)


@given(way=sizes, v=limits, a=limits, b=limits)
def test_least_time_of_two_accelerations(way: float, v: float, a: float, b: float) -> None:
    """The area under the quickest velocity: a triangle of slopes a and b, cut off at v."""
    found = trapezoid(way, v, a, b)
    mean = 2.0 / (1.0 / a + 1.0 / b)
    cut = way >= v * v / mean
    least = way / v + v / mean if cut else 2.0 * math.sqrt(way / mean)
    assert found.duration == pytest.approx(least, rel=1e-12)


@given(way=sizes, v=limits, a=limits, j=limits)
def test_least_time_of_s_curves(way: float, v: float, a: float, j: float) -> None:
    """The four cases of the textbook (Biagiotti and Melchiorri, Section 3.4.2)."""
    by_jerk = 4.0 * (way / (2.0 * j)) ** (1.0 / 3.0)
    if v * j >= a * a:
        if way >= v * v / a + v * a / j:
            least = way / v + v / a + a / j
        elif way >= 2.0 * a**3 / j**2:
            least = a / j + math.sqrt((a / j) ** 2 + 4.0 * way / a)
        else:
            least = by_jerk
    else:
        least = way / v + 2.0 * math.sqrt(v / j) if way >= 2.0 * v * math.sqrt(v / j) else by_jerk
    assert s_curve(way, v, a, j).duration == pytest.approx(least, rel=1e-9)


@given(way=sizes, v=limits, a=limits, j=limits, more=st.floats(1.0, 10.0))
def test_wider_limits_are_never_slower(
    way: float, v: float, a: float, j: float, more: float
) -> None:
    least = s_curve(way, v, a, j).duration * (1 + 1e-12)
    for wider in ((v * more, a, j), (v, a * more, j), (v, a, j * more)):
        assert s_curve(way, *wider).duration <= least
    assert trapezoid(way, v, a).duration <= least


@given(way=sizes, v=limits, a=limits)
def test_jerk_without_limit_gives_the_trapezoid(way: float, v: float, a: float) -> None:
    plain = trapezoid(way, v, a)
    t = np.linspace(0.0, plain.duration, 201)
    errors = []
    for lag in (1e-2, 1e-4, 1e-6):  # how long the jerk acts, of the whole time
        curve = s_curve(way, v, a, a / (lag * plain.duration))
        errors.append(np.abs(curve.at(t).position - plain.at(t).position).max() / way)
        assert curve.duration >= plain.duration * (1 - 1e-12)
    assert errors[0] < 0.1 and errors[2] < 1e-5
    assert errors[2] <= errors[1] <= errors[0]


@given(v=limits, a=limits, j=limits, start=st.floats(-1.0, 1.0))
def test_no_way_takes_no_time(v: float, a: float, j: float, start: float) -> None:
    for made in (trapezoid(0.0, v, a, start=start), s_curve(-0.0, v, a, j, start=start)):
        assert made.segments == () and made.duration == 0.0
        assert made.at([-1.0, 0.0, 1.0]).position.tolist() == [start] * 3


@given(made=profiles(), shape=st.sampled_from([(), (0,), (3,), (2, 3)]))
def test_any_shape_of_times(made: tuple[Profile, object], shape: tuple[int, ...]) -> None:
    t = np.full(shape, 0.3 * made[0].duration)
    found = made[0].at(t)
    assert all(np.shape(values) == shape for values in found)
    assert np.isnan(made[0].at(math.nan)).all()


def test_numbers_of_a_worked_example() -> None:
    """150 mm at 0.2 m/s, 1 m/s^2, 20 m/s^3: 0.75 + 0.2 + 0.05 s; the seven borders by hand."""
    made = s_curve(0.15, 0.2, 1.0, 20.0)
    borders = [0.0, 0.05, 0.2, 0.25, 0.75, 0.8, 0.95, 1.0]
    assert made.borders == pytest.approx(borders, abs=1e-12)
    assert made.at(0.5).position == pytest.approx(0.075)
    assert made.at(0.05).velocity == pytest.approx(0.025)
    assert made.at(0.1).acceleration == pytest.approx(1.0)
    assert [s.jerk for s in made.segments] == [20.0, 0.0, -20.0, 0.0, -20.0, 0.0, 20.0]


@pytest.mark.parametrize("shape", [trapezoid, s_curve])
@pytest.mark.parametrize("name", ["distance", "velocity", "acceleration", "jerk", "start"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf, 10**400, "fast", None, True])
def test_what_is_no_limit_is_refused(shape: object, name: str, value: object) -> None:
    given = {"distance": 1.0, "velocity": 1.0, "acceleration": 1.0, "jerk": 1.0, "start": 0.0}
    if shape is trapezoid:
        given["deceleration"] = given.pop("jerk")
        name = "deceleration" if name == "jerk" else name
    number = isinstance(value, float) and math.isfinite(value)
    if (name in ("distance", "start") and number) or (name == "deceleration" and value is None):
        return
    with pytest.raises(InputError) as caught:
        shape(**{**given, name: value})  # type: ignore[operator]
    message = str(caught.value)
    assert message.startswith(f"{name}: {value!r}; accepted: a finite number")


@given(
    way=st.floats(1e-320, 1e308), v=st.floats(1e-320, 1e308), a=st.floats(1e-320, 1e308),
    j=st.floats(1e-320, 1e308),
)  # fmt: skip
def test_beyond_floating_point_is_refused(way: float, v: float, a: float, j: float) -> None:
    """A profile that is made is finite and takes a time; else the message names the distance."""
    for shape, rest in ((trapezoid, (v, a)), (s_curve, (v, a, j))):
        try:
            made = shape(way, *rest)
        except InputError as error:
            assert error.where == "distance"
            continue
        assert 0.0 < made.duration < math.inf
        assert np.isfinite(made.segments).all()
