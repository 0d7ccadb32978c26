"""Programmes of motion profiles: what the file means, and one clear sentence for each wrong one."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.motion import Trajectory, s_curve, trapezoid
from macromicro.programme import MACRO, MICRO, Limits, Programme, follow, load

LIMITS = Limits(0.0, 2800.0, 0.0, 3.8e-3, 14_000.0)
FAST = 'velocity = "0.2 m/s"\nacceleration = "1 m/s^2"\n'
SLOW = 'velocity = "1 mm/s"\nacceleration = "10 mm/s^2"\n'


def entry(stage: str, targets: str, rest: str = FAST, hold: str = "1 s") -> str:
    return f'[[profiles]]\n{stage} = {targets}\n{rest}hold = "{hold}"\n'


def read(folder: Path, text: str) -> Programme:
    file = folder / "way.toml"
    file.write_text(text)
    return load(file, LIMITS)


def test_a_target_each_period_then_the_hold(tmp_path: Path) -> None:
    made = read(tmp_path, 'title = "x"\n' + entry("macro", '["150 mm", "700 counts"]'))
    there, back = trapezoid(0.15, 0.2, 1.0), trapezoid(-0.1, 0.2, 1.0, start=0.15)
    first, second = 950, 700  # 0.75 + 0.2 s, 0.5 + 0.2 s
    assert len(made.target) == first + second and made.title == "x"
    assert made.start[:first] == pytest.approx(np.arange(1, first + 1) * 1e-3)
    assert made.start[first:] == pytest.approx(1.95 + np.arange(1, second + 1) * 1e-3)
    assert made.end == pytest.approx(1.95 + 1.7) and made.scheduled
    assert set(made.stage) == {MACRO}
    want = there.at(made.start[:first]).position * 14_000
    assert made.target[:first] == pytest.approx(want, abs=1e-9)
    want = back.at(made.start[first:] - 1.95).position * 14_000
    assert made.target[first:] == pytest.approx(want, abs=1e-6)
    assert (made.target[first - 1], made.target[-1]) == (2100.0, 700.0)
    assert made.hold.sum() == pytest.approx(made.end - made.start[0])
    one, two = made.profiles
    assert (one.begin, one.origin, one.target) == (0.0, 0.0, 0.15)
    assert one.finish == pytest.approx(0.95) and one.until == pytest.approx(1.95)
    assert (two.begin, two.origin, two.target) == pytest.approx((1.95, 0.15, 0.05))


def test_jerk_makes_an_s_curve_and_deceleration_another_slope(tmp_path: Path) -> None:
    for rest, shape in (
        ('jerk = "20 m/s^3"\n', s_curve(0.15, 0.2, 1.0, 20.0)),
        ('deceleration = "0.5 m/s^2"\n', trapezoid(0.15, 0.2, 1.0, 0.5)),
    ):
        made = read(tmp_path, entry("macro", '"150 mm"', FAST + rest))
        want = shape.at(made.start).position * 14_000
        assert made.target == pytest.approx(want, abs=1e-9)


def test_a_macro_profile_lets_the_micro_stage_go(tmp_path: Path) -> None:
    text = (
        entry("micro", '"1 mm"', SLOW) + entry("macro", '"50 mm"') + entry("micro", '"2 mm"', SLOW)
    )
    made = read(tmp_path, text)
    assert [p.stage for p in made.profiles] == [MICRO, MACRO, MICRO]
    assert [p.origin for p in made.profiles] == [0.0, 0.0, 0.0]
    assert made.target[made.stage == MICRO].max() == 2e-3


def test_no_hold_goes_on_at_once(tmp_path: Path) -> None:
    made = read(tmp_path, entry("macro", '["150 mm", "50 mm"]', hold="0 s"))
    assert (np.diff(made.start) > 0.5e-3).all()
    assert np.diff(made.start).max() == pytest.approx(2e-3)
    assert made.end > made.start[-1]


def test_repeated_it_must_come_back(tmp_path: Path) -> None:
    away = read(tmp_path, entry("macro", '"150 mm"'))
    assert len(away.repeated(1).target) == len(away.target)
    with pytest.raises(InputError, match="cycles: 2; accepted: 1, or profiles that return to"):
        away.repeated(2)
    with pytest.raises(InputError, match="return to their start"):
        read(tmp_path, entry("micro", '["1 mm", "0.5 mm"]', SLOW)).repeated(2)
    back = read(tmp_path, entry("macro", '["150 mm", "0 mm"]') + entry("micro", '"1 mm"', SLOW))
    twice = back.repeated(2)
    assert [p.begin for p in twice.profiles[3:]] == pytest.approx(
        [p.begin + back.end for p in back.profiles]
    )
    assert (np.diff(twice.start) > 0.0).all() and twice.end == 2 * back.end


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("profiles = 3\n", [", profiles", "[[profiles]]"]),
        ("profiles = []\n", [", profiles", "[[profiles]]"]),
        ('moves = [{macro = "1 mm", hold = "1 s"}]\n' + entry("macro", '"2 mm"'),
         ["the order of moves and profiles", "a header [[moves]] or [[profiles]]"]),
        ('[[moves]]\nmacro = "1 mm"\nhold = "1 s"\n' + entry("macro", '"1 mm"'),
         ["profile 1, macro", "other than the present"]),
        (entry("macro", '"2 mm"') + '[[moves]]\nmacro = "1 mm"\n', ["move 1, hold", "missing"]),
        (entry("macro", '"2 mm"') + '[[moves]]\nmakro = "1 mm"\n', ["move 1, makro", "macro"]),
        (entry("macro", '"50 mm"') + entry("macro", '"60 mm"').replace("velocity", "velocty"),
         ["profile 2, velocty", "velocity"]),
        (entry("macro", '"50 mm"', 'velocity = "0.2 m/s"\n'),
         ["profile 1, acceleration", "missing", "'1 m/s^2'"]),
        (entry("macro", '"50 mm"', FAST + 'jerk = "1 m/s^2"\n'), ["profile 1, jerk", "m/s^3"]),
        (entry("macro", '"50 mm"', FAST + 'jerk = "0 m/s^3"\n'), ["jerk", "more than 0 m/s^3"]),
        (entry("macro", '"50 mm"', FAST + "jerk = 3\n"), ["jerk: '3'", "text with a unit"]),
        (entry("macro", '"50 mm"').replace("0.2 m/s", "-0.2 m/s"),
         ["velocity: '-0.2 m/s'", "more than 0 m/s"]),
        (entry("macro", '"50 mm"', FAST + 'jerk = "9 m/s^3"\ndeceleration = "1 m/s^2"\n'),
         ["profile 1", "both jerk and deceleration"]),
        (entry("macro", '"250 mm"'), ["profile 1, macro", "'250 mm'", "0 to 2800 counts"]),
        (entry("micro", '["1 mm", "4 mm"]', SLOW), ["micro", "'4 mm'", "3.8 mm"]),
        (entry("macro", '["50 mm", "50 mm"]'), ["macro: '50 mm'", "other than the present"]),
        (entry("macro", '"0 mm"'), ["macro: '0 mm'", "other than the present"]),
        (entry("macro", '"1 counts"', FAST.replace('"1 m', '"900 m')),
         ["macro: profile too short: 0.579 ms; at least 20 ms (20 control periods of 1 ms)"]),
        (entry("macro", '"50 mm"', FAST.replace("0.2 m/s", "1 um/s")),
         ["profile too long: 5e+04 s; at most 1000 s"]),
        (entry("macro", '["199 mm", "1 mm"]', FAST.replace("0.2 m/s", "0.3 mm/s")),
         ["profile 1", "too long", "1000 s"]),
        (entry("macro", "[]"), ["profile 1", "the list is empty"]),
        (entry("macro", '"50 mm"') .replace("macro", "hover"), ["hover"]),
        ("[[profiles]]\n" + FAST + 'hold = "1 s"\n', ["neither macro nor micro"]),
        (entry("macro", '"50 mm"', FAST + 'micro = "1 mm"\n'), ["both macro and micro"]),
        (entry("macro", '"50 mm"', hold="-1 s"), ["hold: '-1 s'", "0 s to 1 h"]),
        ("[[profiles]]\nmacro = \"5 mm\"\n" + FAST, ["hold: 'missing'"]),
    ],
)  # fmt: skip
def test_wrong_profiles(tmp_path: Path, text: str, words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    message = str(caught.value)
    assert message.startswith(str(tmp_path / "way.toml")) and "\n" not in message
    for word in words:
        assert word in message


def test_a_trajectory_becomes_a_programme() -> None:
    way = Trajectory.from_profile(s_curve(2e-3, 1e-3, 10e-3, 1.0))
    made = follow(way, "micro", hold=0.5, title="up")
    assert made.target.tolist() == way.position[1:].tolist()
    assert made.start.tolist() == way.t[1:].tolist()
    assert made.end == pytest.approx(way.duration + 0.5) and made.title == "up"
    assert set(made.stage) == {MICRO}
    assert follow(way).target == pytest.approx(way.position[1:] * 14_000, rel=1e-12)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"stage": "both"}, ["stage: 'both'", "'macro' or 'micro'"]),
        ({"hold": -1.0}, ["hold: -1.0"]),
        ({"hold": math.nan}, ["hold: nan"]),
        ({"trajectory": Trajectory(1e-4, np.linspace(0.0, 0.1, 100))},
         ["period: 0.0001", "0.001 s"]),
        ({"trajectory": Trajectory(1e-3, np.linspace(0.1, 0.2, 100))}, ["it begins at 0.1 m"]),
        ({"trajectory": Trajectory(1e-3, np.linspace(0.0, 0.3, 100))},
         ["position: it is 0.3 m at 0.099 s", "0 to 0.2 m"]),
        ({"trajectory": Trajectory(1e-3, np.linspace(0.0, 0.1, 100)), "stage": "micro"},
         ["0 to 0.0039 m"]),
        ({"trajectory": Trajectory(1e-3, np.zeros(20))}, ["it has 19 set points", "20 to"]),
    ],
)  # fmt: skip
def test_what_is_not_followed(change: dict[str, object], words: list[str]) -> None:
    given = {"trajectory": Trajectory(1e-3, np.linspace(0.0, 0.1, 100))}
    with pytest.raises(InputError) as caught:
        follow(**(given | change))  # type: ignore[arg-type]
    for word in words:
        assert word in str(caught.value)


def move(stage: str, targets: str, hold: str = "1 s") -> str:
    return f'[[moves]]\n{stage} = {targets}\nhold = "{hold}"\n'


def test_moves_and_profiles_follow_as_they_stand_in_the_file(tmp_path: Path) -> None:
    """Each profile from the target before it; its set points by the clock, its end as a move's."""
    made = read(
        tmp_path,
        move("macro", '"20 mm"', "0.5 s")
        + entry("macro", '["120 mm", "60 mm"]', hold="0.2 s")
        + move("micro", '["1 mm", "2 mm"]')
        + "  [[ 'profiles' ]]  # a scan\n"
        + entry("micro", '"0.5 mm"', SLOW, "0 s").partition("\n")[2]
        + move("macro", '"0 mm"'),
    )
    assert made.mixed and not made.scheduled and math.isnan(made.end)
    assert [(p.stage, p.origin, p.target) for p in made.profiles] == [
        (MACRO, 0.02, 0.12), (MACRO, 0.12, 0.06), (MICRO, 2e-3, 0.5e-3),
    ]  # fmt: skip
    alone = made.moves
    assert made.target[alone].tolist() == [280.0, 1e-3, 2e-3, 0.0]
    assert made.hold[alone].tolist() == [0.5, 1.0, 1.0, 1.0]
    assert np.isnan(made.start[alone]).all()
    assert made.numbers[alone].tolist() == [1, 4, 5, 7] and made.numbers[-1] == 7
    for number, (span, hold) in enumerate(zip(made.profiles, (0.2, 0.2, 0.0), strict=True)):
        rows = slice(span.first, span.behind)
        assert math.isnan(made.start[rows][0]) and (made.start[rows][1:] == -math.inf).all()
        assert made.hold[rows][:-1] == pytest.approx(1e-3) and made.hold[rows][-1] == hold
        assert set(made.numbers[rows]) == {(2, 3, 6)[number]}
        assert not alone[rows].any() and set(made.stage[rows]) == {span.stage}
        waits = made.waiting[rows]
        assert waits[-1] and not waits[:-1].any()
    shape = trapezoid(0.1, 0.2, 1.0, start=0.02)
    first = made.profiles[0]
    t = 1e-3 * np.arange(1, first.behind - first.first + 1)
    want = shape.at(t).position * 14_000
    assert made.target[first.first : first.behind] == pytest.approx(want, abs=1e-6)


def test_mixed_repeated_needs_a_known_beginning(tmp_path: Path) -> None:
    """A profile that begins at 0 must find its stage there again; one behind a move does not."""
    text = move("macro", '"20 mm"') + entry("macro", '"60 mm"')
    once = read(tmp_path, text)
    twice = once.repeated(2)
    n = len(once.target)
    assert (twice.profiles[1].first, twice.profiles[1].behind) == (1 + n, 2 * n)
    assert twice.target[n:].tolist() == once.target.tolist() and once.from_rest() == ()
    away = read(tmp_path, entry("macro", '"60 mm"') + move("macro", '"20 mm"'))
    assert away.from_rest() == away.profiles
    with pytest.raises(InputError, match="return to their start"):
        away.repeated(2)
    back = read(tmp_path, entry("macro", '"60 mm"') + move("macro", '"0 mm"'))
    assert len(back.repeated(2).profiles) == 2
    fine = entry("micro", '"1 mm"', SLOW)
    let_go = read(tmp_path, fine + move("macro", '"20 mm"'))
    assert len(let_go.repeated(3).profiles) == 3
    with pytest.raises(InputError, match="return to their start"):
        read(tmp_path, fine + move("macro", '"20 mm"') + move("micro", '"2 mm"')).repeated(2)
    after = read(tmp_path, move("macro", '"20 mm"') + fine)
    assert after.from_rest() == () and len(after.repeated(2).profiles) == 2
