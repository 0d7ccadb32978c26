"""The package from Python: the same numbers as the loop, moves read from the recording."""

from __future__ import annotations

import json
import math
import warnings
from pathlib import Path

import numpy as np
import pytest

import macromicro
from macromicro import api
from macromicro.design import response
from macromicro.errors import InputError
from macromicro.programme import MACRO, MICRO, Limits, Programme, find, load
from macromicro.runs import job as jobs
from macromicro.schema.par import replaced
from macromicro.settings import Settings

from .test_loop import QUICK, SHORT, rolled

LIMITS = Limits(0.0, 2800.0, 0.0, 3.9e-3, 14000.0)


def scheduled(*moves: tuple[float, int, float], end: float) -> Programme:
    """A programme of (start [s], stage, target), without holds."""
    start, stage, target = (np.array(column, dtype=float) for column in zip(*moves, strict=True))
    return Programme("", start, stage.astype(np.int64), target, 0.0 * start, end, "")


def test_recording_holds_what_the_loop_gives() -> None:
    """Same settings, programme and seed: the same numbers, with seed and settings beside them."""
    run = api.run(SHORT, seed=5, settings=QUICK)
    block = rolled(QUICK, SHORT, 5)
    for k, column in enumerate(run.columns):
        np.testing.assert_array_equal(run[column.name], block[k].astype(column.dtype))
    assert run.attributes["seed"] == 5 and run.attributes["finished"] == 1
    assert "controller.sequence.wait" in json.loads(str(run.attributes["overrides"]))


@pytest.mark.parametrize("name", ["thesis", "staircase", "full-travel"])
def test_moves_are_read_from_the_recording_alone(name: str) -> None:
    """Stages and targets from the references give what the programme itself gives."""
    what = load(find(name), LIMITS)
    run = api.run(name)
    assert api.moves(run) == response.moves(run, what)
    assert len(api.moves(run)) == len(what.target)


def test_a_move_that_never_began_is_not_listed() -> None:
    """A fine move whose successor is due before the carriage has settled is left out."""
    what = scheduled(
        (0.0, MACRO, 700.0), (0.1, MICRO, 1e-3), (0.2, MICRO, 5e-4), (5.0, MICRO, 0.0), end=6.0
    )
    done = api.moves(api.run(what))
    assert [(m.move, m.stage, m.target) for m in done] == [
        (0, "macro", 50.0),
        (2, "micro", 500.0),
        (3, "micro", 0.0),
    ]


def test_fault_is_warned_of_and_ends_the_recording() -> None:
    """The guard's words reach the caller; what was recorded is there."""
    settings = replaced(Settings(), "guard.hottest", 60.0)
    with pytest.warns(UserWarning, match=r"too high.*guard\.hottest"):
        run = api.run(settings=settings)
    assert run.attributes["finished"] == 0
    assert run["phase"][-1] == 5 and len(run) > 2000
    assert run["temperature_estimate"].max() < 62.0
    assert not api.moves(run)[-1].complete


def test_moves_that_do_not_arrive_are_warned_of_once() -> None:
    """Friction above what the gains overcome: the moves, the worst miss and a remedy."""
    sticky = Settings().with_("bench.friction.coulomb", "12 N")
    with pytest.warns(macromicro.ArrivalWarning) as caught:
        run = macromicro.run("fast", seed=1, settings=sticky)
    (one,) = caught
    lost = [m.move + 1 for m in api.moves(run) if m.arrived_s is None]
    assert str(one.message).startswith(f"moves {', '.join(map(str, lost))} did not arrive; ")
    assert "mm from its target (move" in str(one.message) and "longer hold" in str(one.message)
    assert one.filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        api.run("full-travel")


def test_settings_from_a_file_and_bad_ones(tmp_path: Path) -> None:
    """A file overrides; what cannot be is refused as on the command line."""
    place = tmp_path / "sticky.toml"
    place.write_text('[bench.friction]\ncoulomb = "11 N"\n', encoding="utf-8")
    assert api.load_settings(place).bench.friction.coulomb == 11.0
    with pytest.raises(InputError, match="seed"):
        api.run(seed=-1)
    with pytest.raises(InputError, match="cycles"):
        api.run(cycles=0)
    with pytest.raises(InputError, match="no such file"):
        api.run("nowhere.toml")
    bad = replaced(Settings(), "bench.wire.stop", 5e-3)
    with pytest.raises(InputError, match=r"wire\.stop"):
        api.run(settings=bad)


def test_nothing_recorded_has_no_moves() -> None:
    """An empty recording is not an error."""
    run = api.run(SHORT, settings=QUICK)
    empty = type(run).from_arrays(run.columns, [run[c.name][:0] for c in run.columns], run.dt, {})
    assert api.moves(empty) == [] and math.isclose(run.dt, 1e-3)


MOVES = '[[moves]]\nmacro = ["4 mm", "1 mm"]\nhold = "0.15 s"\n'


def test_any_machine_runs_from_its_file(tmp_path: Path) -> None:
    """The recording is that of the command, and the moves are read from it alone."""
    (tmp_path / "m.toml").write_text('machine = "axis"\n[load]\nmass = "0.6 kg"\n')
    (tmp_path / "p.toml").write_text(MOVES)
    run = macromicro.run(tmp_path / "m.toml", tmp_path / "p.toml", seed=2, cycles=2)
    made = jobs.check(
        jobs.Request(str(tmp_path / "p.toml"), tmp_path / "o", tmp_path / "m.toml", 2, seed=2)
    )
    ended = jobs.execute(made)
    for name in ("t", "position", "effort", "move"):
        assert np.array_equal(run[name], ended.recording[name]), name
    found = macromicro.moves(run)
    assert [m.move for m in found] == [0, 1, 2, 3]
    for mine, true in zip(found, ended.moves, strict=True):
        assert mine.target == pytest.approx(true.target)
        assert mine.profile_s == pytest.approx(true.profile_s, abs=1.1 * run.dt)
        assert (mine.arrived_s, mine.rest_error) == (true.arrived_s, true.rest_error)
        assert mine.complete and mine.peak_error == pytest.approx(true.peak_error, rel=0.1)


def test_changed_settings_of_any_machine_are_run(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text('machine = "axis"\n')
    (tmp_path / "p.toml").write_text(MOVES)
    settings = macromicro.load_settings(tmp_path / "m.toml")
    heavy = settings.with_("load.payload", "1 kg")
    plain, loaded = (
        macromicro.run(tmp_path / "m.toml", tmp_path / "p.toml", settings=each)
        for each in (settings, heavy)
    )
    assert 'payload = "1 kg"' in str(loaded.attributes["settings"])
    assert len(loaded) > len(plain)  # its limits follow from the mass
    assert all(m.arrived_s is not None for m in macromicro.moves(loaded))


def test_a_machine_with_a_fault_warns_and_what_it_has_not_is_refused(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text('machine = "axis"\n[guard]\nerror = "1 um"\n')
    with pytest.warns(UserWarning, match=r"stopped.*guard\.error") as caught:
        run = macromicro.run(tmp_path / "m.toml")
    assert run.attributes["finished"] == 0
    assert caught[0].filename == __file__
    with pytest.raises(InputError, match=r"^fan: this machine has no fan"):
        macromicro.run(tmp_path / "m.toml", fan=True)


def test_of_several_stages_each_move_has_them_all(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text('machine = "xy"\n')
    (tmp_path / "p.toml").write_text('[[moves]]\nx = "8 mm"\ny = "6 mm"\nhold = "0.15 s"\n')
    run = macromicro.run(tmp_path / "m.toml", tmp_path / "p.toml")
    (move,) = macromicro.moves(run)
    assert move.target == pytest.approx((8.0, 6.0)) and move.arrived_s is not None
    assert [own.target for own in move.axes] == pytest.approx([8.0, 6.0])
    assert move.true_error is not None and move.true_error < 0.1
