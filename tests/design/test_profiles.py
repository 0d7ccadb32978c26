"""Motion profiles of a run: the error on the way, the time to settle, what was left out."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import macromicro
from macromicro.control.supervisor import MICRO as FINE
from macromicro.design.profiles import profiles
from macromicro.motion import Trajectory, s_curve
from macromicro.programme import MACRO, MICRO, Programme, Span, follow
from macromicro.recorded import COLUMNS
from macromicro.recording import Recording
from macromicro.recording_format import Column
from macromicro.report import _figures, two_stage
from macromicro.report.run import as_json, page
from macromicro.report.two_stage import summary
from macromicro.runs import job as experiment

BOTH = """
title = "both"
[[profiles]]
macro = ["150 mm", "50 mm"]
velocity = "0.1 m/s"
acceleration = "0.5 m/s^2"
jerk = "5 m/s^3"
hold = "{hold}"
[[profiles]]
micro = ["1.5 mm", "0.5 mm"]
velocity = "1 mm/s"
acceleration = "5 mm/s^2"
hold = "1 s"
"""


def ran(folder: Path, text: str) -> experiment.Ended:
    path = folder / "programme.toml"
    path.write_text(text)
    out = folder / "out"
    return experiment.execute(experiment.check(experiment.Request(str(path), out=out, seed=1)))


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> experiment.Ended:
    return ran(tmp_path_factory.mktemp("both"), BOTH.format(hold="3 s"))


def test_profiles_are_a_trajectory_and_no_moves(both: experiment.Ended) -> None:
    """Two stages, four profiles; each is followed and settled at, nothing is a move."""
    ended = both
    assert ended.finished and ended.moves == [] and two_stage.problems(ended) == []
    assert [t.stage for t in ended.tracking] == ["macro", "micro"]
    assert [t.targets for t in ended.tracking] == [3100, 2900]
    assert [(p.stage, p.origin, p.target) for p in ended.profiles] == [
        ("macro", 0.0, 150.0), ("macro", 150.0, 50.0), ("micro", 0.0, 1500.0),
        ("micro", 1500.0, 500.0),
    ]  # fmt: skip
    run, pitch = ended.recording, 1e3 * macromicro.Settings().sensors.encoder.pitch
    for p in ended.profiles:
        assert p.complete and p.late_s == 0.0
        assert p.settled_s is not None and 0.0 <= p.settled_s < 0.5
        assert p.rms_error is not None and p.peak_error is not None
        assert 0.0 < p.rms_error < p.peak_error
        assert abs(p.final_error or 0.0) <= p.band
    first = ended.profiles[0]
    rows = slice(1, 1801)  # 150 mm at 0.1 m/s: 1.5 s, and 0.2 and 0.1 s of acceleration and jerk
    assert first.end_s == pytest.approx(1.8)
    error = (run["macro_reference"][rows] - run["macro_position"][rows]) * pitch
    assert first.rms_error == pytest.approx(math.sqrt(np.mean(error**2)))
    assert first.peak_error == pytest.approx(np.abs(error).max())
    # The whole stage's peak is that of one of its profiles.
    assert ended.tracking[0].peak_error == max(p.peak_error or 0.0 for p in ended.profiles[:2])

    content = as_json(summary(ended, ""))
    assert len(content) < 4000
    assert len(json.loads(content)["profiles"]) == 4 and json.loads(content)["moves"] == []
    drawn = [d.name for d in _figures.draw(ended)]
    assert "tracking" in drawn and "response" not in drawn
    shown = page(ended, two_stage.report(ended, ""), [])
    assert "profile 4" in shown and "follows 3100 targets" in shown
    assert 'id="moves"' not in shown


def test_the_reference_is_the_profile(both: experiment.Ended) -> None:
    """What the controller is given each period is the closed form, to a counts' rounding."""
    run, counts = both.recording, 14_000.0
    there = s_curve(0.15, 0.1, 0.5, 5.0)
    back = s_curve(-0.1, 0.1, 0.5, 5.0, start=0.15)
    t, reference = run["t"], run["macro_reference"] / counts
    rows = t < 4.8 - 1e-9
    assert np.allclose(reference[rows], there.at(t[rows]).position, rtol=0, atol=1e-12)
    assert np.allclose(reference[~rows], back.at(t[~rows] - 4.8).position, rtol=0, atol=1e-12)


def test_a_profile_that_begins_too_early_is_a_problem(tmp_path: Path) -> None:
    ended = ran(tmp_path, BOTH.format(hold="1 s"))
    third = ended.profiles[2]
    assert third.late_s > 0.5
    (problem,) = two_stage.problems(ended)
    assert problem.startswith(f"profile 3 began late, its first {third.late_s:.2f} s left out")


def test_what_was_cut_short_is_not_complete(both: experiment.Ended) -> None:
    run, what = both.recording, both.job.programme
    rows = np.array([run[c.name][:5000] for c in run.columns])
    short = Recording.from_arrays(run.columns, rows, run.dt, {})
    first, second = profiles(short, what)
    assert first == both.profiles[0]
    assert not second.complete and second.settled_s is None and second.final_error is None
    assert second.peak_error is not None and second.peak_s is not None and second.peak_s < 5.0
    assert profiles(short, what._replace(profiles=())) == []


def recording(**columns: np.ndarray) -> Recording:
    """10 s at 1 ms; what is not given is 0."""
    n = len(next(iter(columns.values())))
    names = ("t", "macro_reference", "macro_position", "micro_reference", "laser", "laser_reset",
             "phase")  # fmt: skip
    rows = [columns.get(name, np.zeros(n)) for name in names]
    return Recording.from_arrays([Column(name, "", "") for name in names], rows, 1e-3, {})


def one(stage: int, hold: float) -> Programme:
    span = Span(stage, 0.0, 1.0, 1.0 + hold, 0.0, 0.1)
    none = np.zeros(1)
    return Programme("", none, np.full(1, stage), none, none, 1.0 + hold, "", (span,))


def test_settling_counts_from_the_end_of_the_reference() -> None:
    """An error of 10 counts up to 0.3 s behind the profile's end, then of 1."""
    t = np.arange(2000) * 1e-3
    wanted = np.minimum(t, 1.0) * 1400.0
    error = np.where(t <= 1.3 + 1e-9, 10.0, 1.0)
    run = recording(t=t, macro_reference=wanted, macro_position=wanted - error)
    (found,) = profiles(run, one(MACRO, 1.0), pitch=1e-3)
    assert found.settled_s == pytest.approx(0.3, abs=1.1e-3)
    assert found.rms_error == found.peak_error == pytest.approx(10.0)
    assert found.final_error == pytest.approx(1.0)
    assert (found.unit, found.band, found.target) == ("mm", 2.0, 100.0)
    (wider,) = profiles(run, one(MACRO, 1.0), pitch=1e-3, macro_band=10.0)
    assert wider.settled_s == 0.0
    (narrow,) = profiles(run, one(MACRO, 1.0), pitch=1e-3, macro_band=0.5)
    assert narrow.settled_s is None and narrow.final_error == pytest.approx(1.0)
    (passing,) = profiles(run, one(MACRO, 1e-3), pitch=1e-3)
    assert passing.complete and passing.settled_s is None and passing.final_error is None


def test_micro_rows_count_while_the_stage_is_driven() -> None:
    """Driven from 0.4 s on, the laser reset in that row; 3 um behind from then on."""
    t = np.arange(2000) * 1e-3
    wanted = np.minimum(t, 1.0) * 1e-1
    driven = t >= 0.4 - 1e-9
    laser = np.where(driven, wanted * 1e3 - 3.0, 555.0)
    reset = np.zeros(2000)
    reset[400] = 1.0
    laser[400] = -444.0
    run = recording(
        t=t, micro_reference=wanted, laser=laser, laser_reset=reset,
        phase=np.where(driven, FINE, 0.0),
    )  # fmt: skip
    (found,) = profiles(run, one(MICRO, 1.0))
    assert found.late_s == pytest.approx(0.4, abs=1.1e-3)
    assert found.rms_error == pytest.approx(3.0) == found.peak_error
    assert found.settled_s == 0.0 and found.final_error == pytest.approx(3.0)


@pytest.mark.parametrize(("speed", "worst"), [(0.05, 0.9), (0.1, 2.3), (0.2, 24.0)])
def test_the_error_that_the_documentation_names(speed: float, worst: float) -> None:
    """docs/running.md: over 150 mm at 0.5 m/s^2 and 5 m/s^3."""
    run = macromicro.run(follow(Trajectory.from_profile(s_curve(0.15, speed, 0.5, 5.0))))
    (found,) = macromicro.tracking(run)
    assert found.peak_error == pytest.approx(worst, rel=0.05)
    page = Path(__file__).parents[2] / "docs" / "running.md"
    assert f"{worst:g} mm" in page.read_text()


def test_a_trajectory_of_one_s_own_is_followed() -> None:
    """To 50 mm, then a sine of 10 mm about 60 mm, 0.5 Hz, from its lowest point."""
    there = Trajectory.from_profile(s_curve(0.05, 0.1, 0.5, 5.0))
    sine = Trajectory.from_function(lambda t: 0.06 - 0.01 * np.cos(np.pi * t), 4.0)
    what = follow(there.then(sine), "macro", hold=1.0)
    run = macromicro.run(what, seed=1)
    assert run.attributes["finished"] == 1 and macromicro.moves(run) == []
    (found,) = macromicro.tracking(run)
    assert found.targets == len(what.target) and found.peak_error < 5.0
    (whole,) = profiles(run, what)
    assert whole.end_s == pytest.approx(there.duration + 4.0)
    assert whole.peak_error == pytest.approx(found.peak_error)


MIXED = """
[[moves]]
macro = "20 mm"
hold = "1 s"
[[profiles]]
macro = "120 mm"
velocity = "0.1 m/s"
acceleration = "0.5 m/s^2"
hold = "0.5 s"
[[moves]]
micro = "1 mm"
hold = "2 s"
[[profiles]]
micro = "0.5 mm"
velocity = "1 mm/s"
acceleration = "5 mm/s^2"
hold = "1 s"
[[moves]]
macro = "0 mm"
hold = "0.1 s"
"""


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> experiment.Ended:
    return ran(tmp_path_factory.mktemp("mixed"), MIXED)


def test_moves_and_profiles_of_one_programme_are_told_each_as_what_they_are(
    mixed: experiment.Ended,
) -> None:
    ended = mixed
    assert ended.finished and two_stage.problems(ended) == [] and ended.tracking == []
    assert [(m.stage, m.target) for m in ended.moves] == [
        ("macro", 20.0), ("micro", 1000.0), ("macro", 0.0),
    ]  # fmt: skip
    assert all(m.arrived_s is not None and m.complete for m in ended.moves)
    assert [line.cells[0] for line in two_stage.table(ended)] == ["1", "3", "5"]
    coarse, fine = ended.profiles
    assert (coarse.stage, coarse.origin, coarse.target) == ("macro", 20.0, 120.0)
    assert (fine.stage, fine.origin, fine.target) == ("micro", 1000.0, 500.0)
    for p in (coarse, fine):
        assert p.complete and p.late_s == 0.0 and p.settled_s is not None and p.settled_s < 0.5
    assert coarse.end_s - coarse.start_s == pytest.approx(0.1 / 0.1 + 0.1 / 0.5, abs=2e-3)
    run, dt = ended.recording, ended.recording.dt
    pitch = 1e3 * macromicro.Settings().sensors.encoder.pitch
    reference = run["macro_reference"] * pitch
    begin, end = (round(t / dt) for t in (coarse.start_s, coarse.end_s))
    assert reference[begin] == pytest.approx(20.0) and reference[begin + 1] > 20.0
    assert reference[end] == pytest.approx(120.0) and reference[end - 1] < 120.0
    worst = np.abs(reference - run["macro_position"] * pitch)[begin : end + 1].max()
    assert coarse.peak_error == pytest.approx(worst)
    told = summary(ended, "now")
    assert len(told["profiles"]) == 2 and len(told["moves"]) == 3
    assert [name for name, _ in two_stage.remarks(ended)][:2] == ["profile 1", "profile 2"]


def test_what_a_mixed_run_did_not_reach_is_not_complete(mixed: experiment.Ended) -> None:
    ended = mixed
    half = round((ended.profiles[0].start_s + 0.5) / ended.recording.dt)
    columns = tuple(c for c in COLUMNS if c.name in ended.recording)
    data = np.array([ended.recording[c.name][:half] for c in columns])
    cut = Recording.from_arrays(columns, data, ended.recording.dt, {})
    (only,) = profiles(cut, ended.job.programme)
    assert not only.complete and only.settled_s is None and only.final_error is None
