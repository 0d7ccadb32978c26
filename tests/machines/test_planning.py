"""Programmes as plans of one stage."""

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from macromicro.errors import InputError
from macromicro.machines import piezo, planning
from macromicro.machines.axis import DEFAULT
from macromicro.motion import s_curve, trapezoid

PITCH = DEFAULT.encoder.pitch


def made(folder, text, name="p.toml"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return planning.plan(planning.load(path, DEFAULT), DEFAULT)


def test_moves_are_the_quickest_within_the_limits(tmp_path):
    text = '[[moves]]\nmacro = ["50 mm", "20 mm"]\nhold = "0.2 s"\n'
    p = made(tmp_path, text)
    assert p.target == pytest.approx([0.05, 0.02], abs=PITCH / 2.0)
    assert np.isnan(p.start).all() and math.isnan(p.end) and list(p.hold) == [0.2, 0.2]
    m = DEFAULT.motion
    for k, before in enumerate((0.0, p.target[0])):
        truth = s_curve(p.target[k] - before, m.velocity, m.acceleration, m.jerk, start=before)
        assert p.length[k] == pytest.approx(truth.duration)
        own = p.pieces[p.first[k] : p.first[k + 1]]
        assert own[:, 0] == pytest.approx(truth.borders[:-1])
        assert own[:, 1:] == pytest.approx(np.array(truth.segments)[:, 1:])


def test_negative_targets_lie_within_the_travel_too(tmp_path):
    tree = DEFAULT.with_("load.stop_low", "-100 mm")
    path = tmp_path / "p.toml"
    path.write_text('[[moves]]\nmacro = "-50 mm"\nhold = "1 s"\n', encoding="utf-8")
    found = planning.plan(planning.load(path, tree), tree)
    assert found.target[0] == pytest.approx(-0.05, abs=PITCH)
    with pytest.raises(InputError, match="mm to 298"):
        planning.load(path, DEFAULT)


def test_a_micro_stage_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"move 1, micro: unknown key\. Accepted: one of to, hold"):
        made(tmp_path, '[[moves]]\nmicro = "1 mm"\nhold = "1 s"\n')


PROFILE = 'velocity = "0.5 m/s"\nacceleration = "3 m/s^2"\nhold = "0.1 s"\n'


@pytest.mark.parametrize(
    ("text", "older", "name"),
    [
        ('[[moves]]\nto = ["10 mm", "20 mm"]\nhold = "1 s"\n', "macro", "p.toml"),
        (f'[[profiles]]\nto = "100 mm"\n{PROFILE}', "macro", "p.toml"),
        (
            f'[[moves]]\nto = "5 mm"\nhold = "1 s"\n[[profiles]]\nto = "100 mm"\n{PROFILE}',
            "macro",
            "p.toml",
        ),
        ("t_s,position_mm\n0,0\n1,10\n3,0\n4,0\n", "macro_mm", "p.csv"),
    ],
)
def test_the_only_stage_needs_no_name_and_may_have_the_older_one(tmp_path, text, older, name):
    found = made(tmp_path, text, name=name)
    before = made(
        tmp_path, text.replace("position_mm", older).replace("to =", f"{older} ="), name=name
    )
    assert len(found.target) and found.target.tolist() == before.target.tolist()
    assert found.pieces.tolist() == before.pieces.tolist()


def test_a_position_in_the_finer_unit(tmp_path):
    found = made(tmp_path, "t_s,position_um\n0,0\n1,10000\n3,0\n4,0\n", name="p.csv")
    assert (
        found.target.tolist()
        == made(tmp_path, "t_s,position_mm\n0,0\n1,10\n3,0\n4,0\n", name="p.csv").target.tolist()
    )


@pytest.mark.parametrize(
    ("text", "name", "message"),
    [
        ('[[moves]]\nhold = "1 s"\n', "p.toml", "move 1, to: 'missing'"),
        (f"[[profiles]]\n{PROFILE}", "p.toml", "profile 1, to: 'missing'"),
        ('[[moves]]\nto = []\nhold = "1 s"\n', "p.toml", "move 1: the list is empty"),
        ("moves = 1\n", "p.toml", "each with to, and hold"),
        ("profiles = 1\n", "p.toml", "each with to, velocity and acceleration"),
        (
            "t_s,micro_um\n0,0\n1,0\n",
            "p.csv",
            "t_s or t_ms, and position_mm, position_um or position_counts",
        ),
        ("t_s,position_mm\n0,0\n1,5\n", "p.csv", "position changes in the last row"),
    ],
)
def test_errors_do_not_speak_of_stages_that_are_not_there(tmp_path, text, name, message):
    with pytest.raises(InputError) as error:
        made(tmp_path, text, name=name)
    assert message in str(error.value) and "macro" not in str(error.value)


def test_a_profile_is_followed_with_its_derivatives(tmp_path):
    text = (
        '[[profiles]]\nmacro = "100 mm"\nvelocity = "0.5 m/s"\nacceleration = "3 m/s^2"\n'
        'jerk = "100 m/s^3"\nhold = "0.1 s"\n'
    )
    p = made(tmp_path, text)
    target = round(0.1 / PITCH) / (1.0 / PITCH)
    truth = s_curve(target, 0.5, 3.0, 100.0)
    assert len(p.pieces) == 7
    assert p.pieces[:, 0].tolist() == pytest.approx(truth.borders[:-1].tolist(), rel=1e-14)
    assert p.pieces[:, 1:].tolist() == np.array(truth.segments)[:, 1:].tolist()
    assert (p.target[0], p.start[0], p.length[0]) == (target, 0.0, truth.duration)
    assert p.end == truth.duration + 0.1


def test_profiles_follow_each_other_without_a_grid(tmp_path):
    """The second begins when the hold of the first has passed, between two milliseconds."""
    shape = 'velocity = "0.5 m/s"\nacceleration = "3 m/s^2"\nhold = "12.3 ms"\n'
    p = made(tmp_path, f'[[profiles]]\nto = ["100 mm", "50 mm"]\n{shape}')
    first = trapezoid(p.target[0], 0.5, 3.0)
    second = trapezoid(p.target[1] - p.target[0], 0.5, 3.0)
    assert p.start == pytest.approx([0.0, first.duration + 12.3e-3], abs=1e-12)
    assert p.end == pytest.approx(p.start[1] + second.duration + 12.3e-3, abs=1e-12)
    assert p.first.tolist() == [0, 3, 5]  # of a trapezoid and a triangle


def test_a_profile_of_a_piezo_within_a_few_periods(tmp_path):
    path = tmp_path / "p.toml"

    def written(target):
        path.write_text(
            f'[[profiles]]\nto = "{target} um"\nvelocity = "1 m/s"\nacceleration = "100 m/s^2"\n'
            'jerk = "9.4815e4 m/s^3"\nhold = "5 ms"\n'
        )
        return planning.load(path, piezo.DEFAULT)

    p = planning.plan(written(10.0), piezo.DEFAULT)
    assert p.length[0] == pytest.approx(1.5e-3, rel=1e-3) and len(p.pieces) == 4
    wrong = r"profile too short: 0\.\d+ ms; at least 0\.5 ms \(5 control periods of 0\.1 ms\)"
    with pytest.raises(InputError, match=wrong):
        written(0.3)


def test_steps_of_a_csv_are_moves_at_their_times(tmp_path):
    p = made(tmp_path, "t_s,macro_mm\n0,0\n0.5,40\n1.5,10\n2.5,10\n", "p.csv")
    assert list(p.start) == [0.0, 0.5, 1.5][-len(p.start) :]
    assert p.end == 2.5 and np.isinf(p.hold).all()
    with pytest.raises(InputError, match=r"beyond motion.*s or more"):
        made(tmp_path, "t_s,macro_mm\n0,0\n0.5,250\n0.6,0\n2,0\n", "p.csv")


def test_many_rows_of_a_csv_are_a_trajectory(tmp_path):
    t = np.arange(0.0, 1.0001, 0.01)

    def rows(place):
        lines = [f"{a:.2f},{place(k, a):.6f}" for k, a in enumerate(t)]
        end = f"{t[-1] + 0.5:.2f},{place(len(t) - 1, t[-1]):.6f}"
        return "\n".join(["t_s,macro_mm", *lines, end, ""])

    p = made(tmp_path, rows(lambda k, a: 20.0 * math.sin(math.pi * a) ** 2), "p.csv")
    assert len(p.target) == 1 and len(p.pieces) >= 95
    speed = 20e-3 * math.pi * np.sin(2.0 * math.pi * (p.start[0] + p.pieces[:, 0]))
    assert p.pieces[5:-5, 2] == pytest.approx(speed[5:-5], abs=3e-3)
    with pytest.raises(InputError, match=r"guard.speed"):
        made(tmp_path, rows(lambda k, a: 16.0 * (k % 2)), "p.csv")
    with pytest.raises(InputError, match="first position"):
        made(tmp_path, rows(lambda k, a: 100.0 + 0.1 * k), "p.csv")


def table(t, place):
    rows = [f"{a:.3f},{x:.6f}" for a, x in zip(t, place, strict=True)]
    return "\n".join(["t_s,macro_mm", *rows, f"{t[-1] + 0.5:.3f},{place[-1]:.6f}", ""])


def at(p, t):
    """The set point of a plan of one trajectory, m."""
    begin, place, v, a, j = p.pieces[np.searchsorted(p.start[0] + p.pieces[:, 0], t + 1e-9) - 1]
    h = t - p.start[0] - begin
    return place + h * (v + h * (0.5 * a + h * j / 6.0))


def test_a_trajectory_that_begins_and_ends_at_0_keeps_its_first_row(tmp_path):
    t = np.arange(0.0, 4.01, 0.1)
    place = 80.0 * np.sin(np.pi * t / 4.0)
    p = made(tmp_path, table(t, place), "p.csv")
    assert (p.start[0], p.pieces[0, 1], p.pieces[0, 2]) == (0.0, 0.0, 0.0)
    assert at(p, 0.1) == pytest.approx(1e-3 * place[1]) and p.target[-1] == pytest.approx(0.0)


def test_a_trajectory_rests_where_its_rows_do(tmp_path):
    t = np.arange(0.0, 4.01, 0.1)
    place = 10.0 - 10.0 * np.cos(np.pi * np.clip(t - 0.3, 0.0, 1.0))
    place[t > 2.25] = 20.0 + 5.0 * np.clip(t[t > 2.25] - 2.3, 0.0, 1.0)
    p = made(tmp_path, table(t, place), "p.csv")
    assert p.start[0] == pytest.approx(0.3) and p.length[0] == pytest.approx(3.0)
    for when in (1.3, 1.8, 2.3):
        assert at(p, when) == pytest.approx(20e-3, abs=1e-9)


def test_a_path_that_leaves_the_travel_between_its_points_is_refused(tmp_path):
    t = np.arange(0.0, 6.01, 0.2)
    top = math.floor(1e3 * DEFAULT.travel.high)
    place = np.interp(t, [0.0, 2.0, 2.6, 2.8, 3.4, 6.0], [0.0, 200.0, top, top, 200.0, 0.0])
    wrong = r"move 1: 2\.\d+ s after it begins the curve is at (\S+) mm, (\S+) mm outside"
    with pytest.raises(InputError, match=wrong) as refused:
        made(tmp_path, table(t, place), "p.csv")
    reached, outside = map(float, re.search(wrong, str(refused.value)).groups())
    assert outside == pytest.approx(reached - 1e3 * DEFAULT.travel.high, rel=1e-2) and outside > 1.0
    low = np.interp(t, [0.0, 4.0, 4.4, 4.6, 6.0], [0.0, 60.0, 0.0, 0.0, 20.0])
    with pytest.raises(InputError, match=r"at -\S+ mm, .* outside"):
        made(tmp_path, table(t, low), "p.csv")
    made(tmp_path, table(t, np.minimum(place, 250.0) * 0.9), "p.csv")


@given(
    st.lists(st.sampled_from([0.0, 0.0, 0.1, 1.0, 3.0]), min_size=3, max_size=12),
    st.lists(st.sampled_from([0.01, 0.1, 0.2]), min_size=12, max_size=12),
    st.sampled_from([1.0, -1.0]),
)
def test_a_trajectory_one_way_stays_between_its_points(steps, times, sign):
    place = sign * 1e-3 * np.cumsum([0.0, *steps])
    t = np.cumsum([0.0, *times[: len(steps)]])
    pieces = planning.track(t, place).pieces
    for (h, p, v, a, j), begin, end in zip(pieces, place, place[1:], strict=False):
        at = np.linspace(0.0, h, 101)
        curve = p + at * (v + at * (0.5 * a + at * j / 6.0))
        assert (curve[0], curve[-1]) == pytest.approx((begin, end), abs=1e-12)
        assert curve.min() >= min(begin, end) - 1e-12
        assert curve.max() <= max(begin, end) + 1e-12


def test_a_smooth_trajectory_is_a_spline():
    t = np.linspace(0.0, 2.0, 81)
    place = 0.05 * np.sin(np.pi * t) ** 2
    pieces = planning.track(t, place).pieces
    spline = CubicSpline(t, place, bc_type="clamped")
    assert pieces[:, 1:4] == pytest.approx(np.stack([spline(t[:-1], k) for k in range(3)], axis=1))


def test_the_usual_moves_stay_within_the_travel():
    p = planning.plan(planning.usual(DEFAULT), DEFAULT)
    assert p.target[-1] == 0.0 and 0.0 < p.target.max() < DEFAULT.travel.high


def test_moves_and_profiles_in_turn(tmp_path):
    """A move is the quickest within the limits, a profile keeps its own; each from the last."""
    text = (
        '[[moves]]\nmacro = "20 mm"\nhold = "0.2 s"\n[[profiles]]\nmacro = "120 mm"\n'
        'velocity = "0.5 m/s"\nacceleration = "3 m/s^2"\nhold = "0.1 s"\n'
        '[[moves]]\nmacro = "0 mm"\nhold = "0.3 s"\n'
    )
    p = made(tmp_path, text)
    assert p.target == pytest.approx([0.02, 0.12, 0.0], abs=PITCH / 2.0)
    assert np.isnan(p.start).all() and math.isnan(p.end)
    assert p.hold == pytest.approx([0.2, 0.1, 0.3])
    begin, place, speed, *_ = p.pieces[p.first[1] : p.first[2]].T
    assert (begin[0], place[0], speed[0]) == pytest.approx((0.0, p.target[0], 0.0))
    assert speed.max() == pytest.approx(0.5, rel=1e-2)
    assert p.length[1] == pytest.approx(0.1 / 0.5 + 0.5 / 3.0, abs=2e-3)
    m = DEFAULT.motion
    for k, before in ((0, 0.0), (2, p.target[1])):
        truth = s_curve(p.target[k] - before, m.velocity, m.acceleration, m.jerk, start=before)
        assert p.length[k] == pytest.approx(truth.duration)
        assert p.pieces[p.first[k], 1] == pytest.approx(before)


def test_a_mixed_programme_begins_anywhere_live(tmp_path):
    path = tmp_path / "p.toml"
    profile = (
        '[[profiles]]\nmacro = "50 mm"\nvelocity = "0.5 m/s"\n'
        'acceleration = "3 m/s^2"\nhold = "0.1 s"\n'
    )
    move = '[[moves]]\nmacro = "20 mm"\nhold = "0.2 s"\n'
    for text, origin in ((profile + move, 0.0), (move + profile, 0.02)):
        path.write_text(text, encoding="utf-8")
        found = planning.plan(planning.load(path, DEFAULT), DEFAULT, anywhere=True)
        assert found.origin == pytest.approx(origin, abs=PITCH / 2.0) and len(found.target) == 2
