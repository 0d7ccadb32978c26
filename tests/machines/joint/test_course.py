"""Programmes of two axes from files: what they may hold, and what is refused."""

import math

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.machines.joint import course
from macromicro.motion import path


def read(tmp_path, text, name="moves.toml"):
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    return course.load(file)


def test_moves_are_straight_and_what_is_left_out_stays(tmp_path):
    found = read(
        tmp_path,
        'title = "two"\n[[moves]]\nx = "10 mm"\ny = "5 mm"\n[[moves]]\ny = "7 mm"\nhold = "1 s"\n'
        'speed = "20 mm/s"\n',
    )
    assert found.title == "two" and [leg.name for leg in found.legs] == ["line", "line"]
    assert found.legs[0].end == (0.01, 0.005) and found.legs[0].hold == 0.2
    second = found.legs[1]
    assert second.end == (0.01, 0.007) and second.hold == 1.0 and second.speeds == (0.02,)
    assert second.pieces[0].end == pytest.approx((0.01, 0.007)) and second.pieces[0].ux == 0.0
    assert found.legs[0].speeds == (math.inf,)


def test_paths_are_lines_arcs_and_points(tmp_path):
    found = read(
        tmp_path,
        """
[[paths]]
x = "20 mm"
[[paths]]
centre = ["20 mm", "10 mm"]
angle = "180 deg"
[[paths]]
points = [["5 mm", "20 mm"], ["5 mm", "5 mm"]]
rounding = "2 mm"
hold = "0 s"
[[paths]]
points = [["5 mm", "1 mm"], ["9 mm", "1 mm"]]
hold = "0.5 s"
""",
    )
    assert found.title == "moves"
    names = [leg.name for leg in found.legs]
    assert names == ["line", "arc", "path", "line", "line"]  # an exact stop is a move of its own
    assert found.legs[1].end == pytest.approx((0.02, 0.02), abs=1e-15)
    assert found.legs[1].pieces[0].length == pytest.approx(0.01 * math.pi)
    assert found.legs[2].end == (0.005, 0.005) and len(found.legs[2].pieces) == 3
    assert [leg.hold for leg in found.legs[2:]] == [0.0, 0.0, 0.5]


def test_a_whole_circle_ends_exactly_where_it_began(tmp_path):
    text = '[[paths]]\nx = "20 mm"\n[[paths]]\ncentre = ["20 mm", "7 mm"]\nangle = "-720 deg"\n'
    circle = read(tmp_path, text).legs[1]
    assert circle.end == (0.02, 0.0)
    assert circle.pieces[0].curvature < 0.0
    assert circle.pieces[0].length == pytest.approx(4.0 * math.pi * 0.007)


def test_a_path_that_goes_on_is_one_move_with_the_next(tmp_path):
    found = read(
        tmp_path,
        """
[[paths]]
x = "20 mm"
on = true
speed = "0.1 m/s"
[[paths]]
centre = ["20 mm", "10 mm"]
angle = "180 deg"
on = true
[[paths]]
x = "5 mm"
hold = "1 s"
""",
    )
    slot = found.legs[0]
    assert len(found.legs) == 1 and len(slot.pieces) == 3 and slot.hold == 1.0
    assert slot.end == pytest.approx((0.005, 0.02), abs=1e-12)
    assert slot.speeds == (0.1, math.inf, math.inf)
    turns = [path.turning(a, b) for a, b in zip(slot.pieces, slot.pieces[1:], strict=False)]
    assert turns == pytest.approx([0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("title = 3\n[[moves]]\nx = '1 mm'", "title"),
        ("[[move]]\nx = '1 mm'", "move: unknown key. Accepted: a known one, such as moves"),
        ("title = 'none'", "moves: 'nothing'; accepted: one table"),
        ("[[moves]]\nx='1 mm'\n[[paths]]\nx='1 mm'", "both moves and paths are given"),
        ("moves = []", "moves: '\\[\\]'; accepted: one table"),
        (
            "[[paths]]\nx = '1 mm'\non = true\n[[paths]]\nx = '1 mm'",
            "path 2: the path has no length",
        ),
        ("[[paths]]\nx = '1 mm'\non = true\n[[paths]]\ny = '-1 mm'", "a corner of -90 deg"),
        ("[[moves]]\nz = '1 mm'", "move 1, z: unknown key"),
        ("[[moves]]\nangle = '1 deg'", "move 1, angle: unknown key"),
        ("[[moves]]\nx = 1", "move 1, x: '1'; accepted: text with a unit"),
        ("[[moves]]\nx = '1 s'", "move 1, x: '1 s'; accepted: a finite number and its unit: mm"),
        ("[[moves]]\nhold = '1 s'", "move 1: no path"),
        ("[[moves]]\nx = '1 mm'\nhold = '-1 s'", "hold"),
        ("[[moves]]\nx = '1 mm'\nspeed = '0 mm/s'", "speed: '0 mm/s'; accepted: a speed above"),
        ("[[paths]]\nangle = '1 deg'", "centre: 'nothing'"),
        ("[[paths]]\ncentre = ['1 mm', '0 mm']", "angle: 'missing'"),
        ("[[paths]]\ncentre = ['1 mm']\nangle = '1 deg'", "centre: .*accepted: x and y"),
        ("[[paths]]\ncentre = ['0 mm', '0 mm']\nangle = '1 deg'", "a point other than"),
        ("[[paths]]\ncentre = ['1 mm', '0 mm']\nangle = '0 deg'", "an angle other than 0 deg"),
        ("[[paths]]\ncentre=['1 mm','0 mm']\nangle='9 deg'\nx = '1 mm'", "not allowed with centre"),
        ("[[paths]]\npoints = []", "points"),
        ("[[paths]]\npoints = [['1 mm', '0 mm']]\ncorners = 'cut'", '"stop" or "round"'),
        ("[[paths]]\npoints = [['1 mm', '0 mm']]\ncorners = 'round'", "rounding: 'nothing'"),
        (
            "[[paths]]\npoints = [['1 mm', '0 mm']]\ncorners = 'stop'\nrounding = '1 mm'",
            "rounding: '1 mm'; accepted: a rounding with",
        ),
        ("[[paths]]\npoints = [['1 mm', '0 mm']]\nrounding = '0 mm'", "a radius above zero"),
        ("[[paths]]\nx = '1 mm'\non = 1", "on: '1'; accepted: true or false"),
        ("[[paths]]\nx = '1 mm'\non = true", "no other path follows"),
        (
            "[[paths]]\nx = '0 mm'\non = true\n[[paths]]\nx = '1 mm'",
            "path 2: the path has no length",
        ),
        ("[[paths]]\nx = '1 mm'\non = true\n[[paths]]\ny = '1 mm'", "a corner of 90 deg"),
    ],
)
def test_what_is_no_programme_is_refused(tmp_path, text, what):
    with pytest.raises(InputError, match=what):
        read(tmp_path, text)


def test_a_table_of_times_and_places_is_a_trajectory(tmp_path):
    found = read(tmp_path, "t_ms,y_um,x_mm\n100,0,5\n200,100,6\n400,300,7\n", "wave.csv")
    to, track = found.legs
    assert to.name == "line" and to.end == (0.005, 0.0)
    assert track.name == "trajectory" and track.end == (0.007, pytest.approx(3e-4))
    wanted = [[0.0, 0.1, 0.3], [5e-3, 6e-3, 7e-3], [0.0, 1e-4, 3e-4]]
    assert track.times == pytest.approx(np.array(wanted))


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("t_s,x_mm\n0,1\n", "line 1: columns t_s, x_mm. Give t_s or t_ms, then x and y"),
        ("t_s,x_mm,y_mm,z_mm\n0,1,1,1\n", "columns"),
        ("t_s,x_mm,x_um\n0,1,1\n", "columns"),
        ("t_s,x_mm,y_mm\n0,1,1\n1,1,1\n", "2 rows"),
        ("t_s,x_mm,y_mm\n0,1,1\n1,1,1\n1,2,2\n", "line 4: '1 s'; accepted: times that increase"),
        ("t_s,x_mm,y_mm\n0,1,1\n1,a,1\n2,2,2\n", "line 3, x_mm: 'a'"),
    ],
)
def test_a_table_that_is_none_is_refused(tmp_path, text, what):
    with pytest.raises(InputError, match=what):
        read(tmp_path, text, "wave.csv")
