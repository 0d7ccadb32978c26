"""Set points at a control period: from a profile, a function, a file; and what is checked."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.motion import Trajectory, s_curve, trapezoid


@given(
    way=st.integers(-200_000, 200_000).map(lambda n: n * 1e-6),
    v=st.floats(0.01, 1.0), a=st.floats(0.1, 10.0),
    j=st.floats(1.0, 1000.0), period=st.sampled_from([1e-3, 4e-3, 1.7e-3]),
)  # fmt: skip
def test_set_points_of_a_profile_keep_its_limits(
    way: float, v: float, a: float, j: float, period: float
) -> None:
    """Their differences are means over a period, so they exceed nothing that it does not."""
    profile = s_curve(way, v, a, j)
    made = Trajectory.from_profile(profile, period)
    assert made.check(min(way, 0.0), max(way, 0.0), velocity=v, acceleration=a) is made
    assert made.position[-1] == way
    assert np.array_equal(made.position[:-1], profile.at(made.t[:-1]).position)
    assert profile.duration - 1e-9 <= made.duration <= profile.duration + period


def test_differences_are_velocity_and_acceleration() -> None:
    profile = trapezoid(0.1, 0.2, 1.0)
    made = Trajectory.from_profile(profile, 1e-3)
    middle = profile.at(made.t[1:] - 0.5e-3).velocity
    assert made.velocity[1:] == pytest.approx(middle, abs=1e-9)  # no border within a period
    assert made.acceleration[50] == pytest.approx(1.0)
    assert len(made.t) == len(made.position) == len(made.velocity) == len(made.acceleration)


@pytest.mark.parametrize(
    ("limit", "words"),
    [
        ({"highest": 0.09}, ["position: it is 0.1 m at 0.7 s.", "-inf to 0.09 m"]),
        ({"lowest": 0.01}, ["position: it is 0 m at 0 s.", "0.01 to inf m"]),
        ({"velocity": 0.15}, ["velocity: it is 0.2 m/s at 0.2", "at most 0.15 m/s"]),
        ({"acceleration": 0.5}, ["acceleration: it is 1 m/s^2 at 0.0", "at most 0.5 m/s^2"]),
    ],
)
def test_the_worst_instant_is_named(limit: dict[str, float], words: list[str]) -> None:
    made = Trajectory.from_profile(trapezoid(0.1, 0.2, 1.0))
    with pytest.raises(InputError) as caught:
        made.check(**limit)  # type: ignore[arg-type]
    for word in ("trajectory, ", *words):
        assert word in str(caught.value)


def test_a_sine_begins_at_its_velocity_and_shows_it() -> None:
    """0.01 m at 1 Hz: 0.063 m/s from rest within a period are 63 m/s^2 at 0 s."""
    made = Trajectory.from_function(lambda t: 0.01 * np.sin(2 * np.pi * t), 1.0)
    assert len(made.position) == 1001
    made.check(-0.01, 0.01, velocity=0.063)
    with pytest.raises(InputError, match=r"it is 62\.8\d* m/s\^2 at 0 s"):
        made.check(acceleration=1.0)
    smooth = Trajectory.from_function(lambda t: 0.01 * (1 - np.cos(2 * np.pi * t)), 1.0)
    smooth.check(acceleration=0.01 * (2 * np.pi) ** 2)


@pytest.mark.parametrize(
    ("place", "where"),
    [
        (lambda t: 0.1, "place: it gives an array of shape ()"),
        (lambda t: t[:-1], "place: it gives an array of shape (1000,)"),
        (lambda t: np.where(t < 0.5, t, np.nan), "place: it gives nan at 0.5 s."),
    ],
)
def test_a_function_gives_a_number_for_each_time(place: object, where: str) -> None:
    with pytest.raises(InputError) as caught:
        Trajectory.from_function(place, 1.0)  # type: ignore[arg-type]
    assert str(caught.value).startswith(where)


def test_one_behind_another() -> None:
    there = Trajectory.from_profile(trapezoid(0.1, 0.2, 1.0))
    sine = Trajectory.from_function(lambda t: 0.11 - 0.01 * np.cos(2 * np.pi * t), 1.0)
    both = there.then(sine)
    assert both.duration == pytest.approx(there.duration + 1.0)
    assert both.check(velocity=0.2, acceleration=1.0).position[-1] == pytest.approx(0.1)
    for other, where in (
        (sine._replace(period=2e-3), "following, period: 0.002"),
        (sine._replace(position=sine.position + 1e-6), "following: it begins at 0.100001 m"),
    ):
        with pytest.raises(InputError) as caught:
            there.then(other)
        assert str(caught.value).startswith(where)


@pytest.mark.parametrize("period", [0.0, -1.0, math.nan, 1e-9])
def test_a_period_is_above_0_and_gives_not_too_many(period: float) -> None:
    for make in (
        lambda: Trajectory.from_profile(trapezoid(0.1, 0.2, 1.0), period),
        lambda: Trajectory.from_function(np.sin, 1.0, period),
    ):
        with pytest.raises(InputError, match=r"^period: "):
            make()


def test_a_file_is_read_as_programmes_are(tmp_path: Path) -> None:
    path = tmp_path / "way.csv"
    path.write_text("# by hand\nt_ms, macro_mm, micro_um\n100,0,5\n 200, 1.5, 5\n400,0.5,7\n")
    made = Trajectory.from_csv(path, "macro_mm", period=0.05)
    assert made.t == pytest.approx([0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3])
    assert made.position * 1e3 == pytest.approx([0.0, 0.75, 1.5, 1.25, 1.0, 0.75, 0.5])
    assert Trajectory.from_csv(path, "micro_um").position[[0, -1]] == pytest.approx([5e-6, 7e-6])


@pytest.mark.parametrize(
    ("text", "column", "words"),
    [
        ("t_s,x_mm,y_mm\n0,1,1\n1,1,1\n", "", [", column", "not given", "x_mm, y_mm"]),
        ("t_s,x_mm\n0,1\n1,1\n", "z_mm", [", column: 'z_mm'", "one of x_mm"]),
        ("t_s,x_mm\n0,1\n", "", ["fewer than two rows"]),
        ("t_s,x_mm\n0,1\n0,1\n", "", ["line 3", "increase"]),
        ("t_s,x_mm\n0,1\n1,one\n", "", ["line 3, x_mm", "'one'", "a finite number"]),
        ("t_s,x_mm\n0,1\nnan,1\n", "", ["line 3, t_s", "'nan'"]),
        ("t_s,x\n0,1\n1,1\n", "", ["line 1", "t_s or t_ms"]),
        ("t_s,macro_counts\n0,1\n1,1\n", "", ["line 1", "_mm"]),
        ("t_s,t_ms,x_mm\n0,1,1\n1,1,1\n", "", ["line 1"]),
        ("t_s,x_mm,x_mm\n0,1,1\n1,1,1\n", "", ["line 1"]),
        ("t_s;x_mm\n0;1\n", "", ["line 1", "commas"]),
        ("t_s,x_mm\n0\n", "", ["line 2: the heading has 2 cells, this line 1"]),
        ("", "", ["the file is empty"]),
    ],
)
def test_a_wrong_file_is_refused(tmp_path: Path, text: str, column: str, words: list[str]) -> None:
    path = tmp_path / "way.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        Trajectory.from_csv(path, column)
    assert str(caught.value).startswith(str(path))
    for word in words:
        assert word in str(caught.value)
