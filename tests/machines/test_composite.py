"""Machines of several stages that a settings file describes."""

import json
from pathlib import Path

import numpy as np
import pytest

from macromicro import cli
from macromicro.errors import MacromicroError
from macromicro.export import catalogue
from macromicro.machines import composite, compositions, programmes, results, runs
from macromicro.machines import machine as machines
from macromicro.place import ANGLE, LENGTH

EXAMPLE = Path(__file__).parents[2] / "examples/machines/xyz.toml"
PROGRAMME = """
title = "pick"
[[moves]]
x = "20 mm"
y = "10 mm"
hold = "0.02 s"
[[moves]]
z = "40 um"
hold = "0.02 s"
[[moves]]
x = "5 mm"
z = "0 um"
hold = "0.02 s"
"""
MOVE = {"x": "20 mm", "y": "10 mm"}


@pytest.fixture(scope="module")
def three():
    """The example with its settings."""
    return compositions.load(EXAMPLE)


def file(folder, text, name="m.toml"):
    (folder / name).write_text(text)
    return folder / name


def planned(three, folder, text=PROGRAMME, name="p.toml"):
    machine, settings = three
    made = programmes.choose(machine, settings, str(file(folder, text, name)))
    return programmes.plan(machine, settings, made)


def test_its_stages_are_the_machines_that_it_names_on_the_shortest_period(three):
    machine, settings = three
    assert composite.names(machine) == ("x", "y", "z") and machine.name == "x_y_z"
    assert [one.name for _, one in machine.stages] == ["axis", "axis", "piezo"]
    x, y, z = machine.trees(settings)
    assert x.timing.period == y.timing.period == z.timing.period == 0.1e-3
    assert (x.load.mass, y.load.mass) == (3.0, 1.0)
    # What is derived from a stage's sheets follows its own values.
    alone = machines.MACHINES[0].settings.with_({"load.mass": "3 kg", "timing.period": "0.1 ms"})
    assert x.motion == alone.motion and x.controller == alone.controller


def test_its_settings_are_read_back(three, tmp_path):
    machine, settings = three
    again, tree = compositions.load(file(tmp_path, machines.as_toml(machine, settings)))
    assert tree == settings and composite.names(again) == ("x", "y", "z")
    ((x, _, first), *_) = compositions.each(EXAMPLE)
    assert x == "x" and first == settings.x
    assert {"x_y_z.x.law", "x_y_z.z.law"} <= set(catalogue.every(EXAMPLE))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('machine = { stages = { x = "axis" } }', "two or more by name"),
        ('machine = { order = "together" }', "stages: 'nothing'"),
        ('machine = { stages = { x = "axis", y = "axle" } }', "stages, y: 'axle'"),
        ('machine = { stages = { x = "axis", t = "axis" } }', "stages: 't'"),
        ('machine = { stages = { x = "axis", "y 1" = "axis" } }', "stages: 'y 1'"),
        ('machine = { stages = { x = "axis", y = "axis" }, order = "at once" }', '"together" or'),
        ('machine = { stages = { x = "axis", y = "axis" }, order = ["x"] }', '"in turn"'),
        ('machine = { stages = { x = "axis", y = "axis" }, law = "pd" }', "law"),
        ('machine = { stages = { x = "axis", y = "xy" } }', "stages, y: 'xy'"),
        ('machine = { stages = { x = "axis", y = "axis" } }\n[z.load]\nmass = "1 kg"', "z"),
        (
            'machine = { stages = { x = "axis", y = "axis" } }\n[y.timing]\nperiod = "0.5 ms"',
            "both axes run on one clock",
        ),
    ],
)
def test_what_cannot_be_is_refused(tmp_path, text, said):
    with pytest.raises(MacromicroError) as error:
        compositions.load(file(tmp_path, text))
    assert said in str(error.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[[moves]]\nq = "1 mm"', "move 1, q: unknown key"),
        ('[[moves]]\nhold = "1 s"', "move 1: no target"),
        ('[[moves]]\nx = "1 mm"\n[[moves]]\nz = "1 mm"', "move 2, z: '1 mm'"),
        ('[[moves]]\nx = "1 deg"', "move 1, x"),
        ("[[moves]]\nx = 1", "text with a unit"),
        ('[[paths]]\nx = "1 mm"', "paths"),
        ("moves = 3", "moves"),
    ],
)
def test_a_programme_that_it_cannot_run_is_refused(three, tmp_path, text, said):
    with pytest.raises(MacromicroError) as error:
        planned(three, tmp_path, text)
    assert said in str(error.value)


def test_a_move_is_a_straight_line_of_all_stages_within_the_limits_of_each(three, tmp_path):
    machine, settings = three
    plan = planned(three, tmp_path)
    x, y, z = plan.plans
    assert np.array_equal(x.first, z.first) and np.array_equal(x.pieces[:, 0], z.pieces[:, 0])
    begin, end = 0, x.first[1]
    assert y.pieces[begin:end, 1:] == pytest.approx(0.5 * x.pieces[begin:end, 1:])
    assert np.all(z.pieces[begin:end, 1:] == 0.0)
    for own, each in zip(machine.trees(settings), plan.plans, strict=True):
        assert np.max(np.abs(each.pieces[:, 2])) <= own.motion.velocity * (1.0 + 1e-12)
        assert np.max(np.abs(each.pieces[:, 4])) <= own.motion.jerk * (1.0 + 1e-12)
    assert [leg.end for leg in plan.legs] == [
        (0.02, 0.01, 0.0),
        (0.02, 0.01, 4e-5),
        (0.005, 0.01, 0),
    ]


def test_a_trajectory_is_followed_by_all_from_its_first_point(three, tmp_path):
    t = np.linspace(0.0, 0.4, 41)
    rows = [f"{a:.3f},{5.0 + 5.0 * a},{1.0},{20.0 * a}" for a in t]
    text = "t_s,x_mm,y_mm,z_um\n" + "\n".join(rows)
    plan = planned(three, tmp_path, text, "p.csv")
    assert [leg.name for leg in plan.legs] == ["line", "trajectory"]
    assert plan.legs[0].end == pytest.approx((5e-3, 1e-3, 0.0))
    assert [p.target[1] for p in plan.plans] == pytest.approx([7e-3, 1e-3, 8e-6])
    for wrong, said in (("t_s,x_mm,y_mm", "columns"), ("t_s,x_mm,y_mm,z_V", "z_V")):
        with pytest.raises(MacromicroError, match=said):
            planned(three, tmp_path, text.replace("t_s,x_mm,y_mm,z_um", wrong), "w.csv")


@pytest.mark.slow
def test_it_runs_and_each_move_waits_for_every_stage(three, tmp_path, monkeypatch, capsys):
    words = ["run", file(tmp_path, PROGRAMME, "p.toml"), "--config", EXAMPLE]
    words += ["--out", tmp_path / "out", "--json"]
    monkeypatch.setattr("sys.argv", ["macromicro", *map(str, words)])
    assert cli.main() == 0
    told = json.loads(capsys.readouterr().out)
    assert told["machine"] == "x_y_z" and told["finished"] and len(told["moves"]) == 3
    machine, settings = three
    plan = planned(three, tmp_path)
    done = runs.record(machine, settings, plan)
    moves = results.of(machine, done.recording, plan, settings)
    for move, shown in zip(moves, told["moves"], strict=True):
        assert move.arrived_s == shown["arrived_s"] and move.contour is None
        for own, tree in zip(move.axes, machine.trees(settings), strict=True):
            assert move.arrived_s >= own.arrived_s
            assert abs(own.rest_error) <= 1e3 * tree.arrival.tolerance
    assert done.recording["z_target"].max() == pytest.approx(0.04)
    page = (tmp_path / "out/report.html").read_text()
    assert "the machine x_y_z" in page and "error at rest z" in page
    assert (tmp_path / "out/axes.png").is_file()


def test_what_takes_one_stage_says_so(three):
    with pytest.raises(MacromicroError, match=r"--axis x"):
        machines.chosen(EXAMPLE)


def test_lengths_and_angles_at_rest_are_not_added():
    own = results.MoveResult(0, 1.0, 0.0, 0.1, 0.2, 0.0, None, 0.0, None, 3.0, None, True)
    other = own._replace(rest_error=4.0)
    both = results.JointMove(
        0, "line", (1.0, 1.0), 0.0, 0.0, 0.1, 0.2, None, (own, other), None, True
    )
    (alike,) = results.rests([both], (LENGTH, LENGTH))
    assert alike.error == pytest.approx(5e-3)
    (unlike,) = results.rests([both], (LENGTH, ANGLE))
    assert unlike.error is None and unlike.arrived


IN_TURN = EXAMPLE.read_text().replace('"together"', '"in turn"')


@pytest.fixture(scope="module")
def in_turn(tmp_path_factory):
    """The example with stages that move one after the other."""
    return compositions.load(file(tmp_path_factory.mktemp("turn"), IN_TURN))


def test_stages_in_turn_move_one_after_the_other(in_turn, tmp_path):
    machine, settings = in_turn
    plan = planned(in_turn, tmp_path)
    ends = [
        (0.02, 0, 0),
        (0.02, 0.01, 0),
        (0.02, 0.01, 4e-5),
        (0.005, 0.01, 4e-5),
        (0.005, 0.01, 0),
    ]
    assert [leg.end for leg in plan.legs] == [pytest.approx(end) for end in ends]
    assert [leg.hold for leg in plan.legs] == [0.0, 0.02, 0.02, 0.0, 0.02]
    done = runs.record(machine, settings, plan)
    moves = results.of(machine, done.recording, plan, settings)
    assert results.count_arrived(moves) == 5
    for k, moving in enumerate("xyzxz"):
        rows = done.recording["move"] == k
        still = {f"{name}_target" for name in "xyz" if name != moving}
        assert all(np.ptp(done.recording[name][rows]) == 0.0 for name in still)
        assert np.ptp(done.recording[f"{moving}_target"][rows]) > 0.0
    machine_again, settings_again = compositions.of_recording(done.recording)
    assert (machine_again.order, settings_again) == ("in turn", settings)


def test_stages_in_turn_refuse_what_moves_all_at_once(in_turn, tmp_path):
    text = "t_s,x_mm,y_mm,z_um\n0,0,0,0\n0.1,1,1,1\n0.2,2,2,2\n"
    with pytest.raises(MacromicroError, match="a trajectory moves all stages at once"):
        planned(in_turn, tmp_path, text, "p.csv")


def test_a_move_of_stages_in_turn_that_are_there_is_a_hold(in_turn, tmp_path):
    text = '[[moves]]\nx = "0 mm"\nhold = "0.1 s"\n[[moves]]\ny = "1 mm"\n'
    plan = planned(in_turn, tmp_path, text)
    assert [leg.end for leg in plan.legs] == [(0, 0, 0), (0, 1e-3, 0)]
    assert plan.legs[0].hold == 0.1
