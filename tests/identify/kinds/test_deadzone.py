"""`identify deadzone` on runs of known speeds."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from tests.identify.kinds.seen import facts, given, mat, plots, table

from macromicro import identify
from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.deadzone import DeadZone, Trial, discontinuous_dead_zone
from macromicro.identify.kinds import deadzone
from macromicro.identify.kinds.deadzone import Options
from macromicro.identify.notices import DataWarning
from macromicro.identify.picking import Picked, load
from macromicro.identify.result import Line
from macromicro.identify.runs import Run

DT, N = 0.01, 100


def moved(volts: float) -> Array:
    """Still below 2 V forwards and 3 V backwards; 10 (|V| - 1) counts per sample else."""
    least = 2.0 if volts > 0.0 else 3.0
    speed = 10.0 * (abs(volts) - 1.0) if abs(volts) >= least else 0.0
    return (0.0 if volts > 0.0 else 1000.0) + np.sign(volts) * speed * np.arange(N)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    volts = [1.5, 2.0, 4.0, -2.5, -3.0, -5.0]
    u = np.concatenate([np.r_[np.full(N, v), np.zeros(30)] for v in volts])
    x = np.concatenate([np.r_[moved(v), np.full(30, moved(v)[-1])] for v in volts])
    return table(tmp_path / "a.csv", "t_s,u_V,x_counts", np.arange(len(u)) * DT, u, x)


def steady(name: str, volts: float) -> Line:
    note = "lowest with steady motion"
    return Line(name, volts, unit="V", note=note, extra=0.5, extra_name="step")


def test_thresholds_of_both_directions(file: Path) -> None:
    found = deadzone.identify(given(file), Options(travel=(0.0, 1000.0)))
    lines = facts(found.lines)
    assert list(lines) == ["positive", "negative", "width"]
    assert lines["positive"] == steady("positive", 2.0)
    assert lines["negative"] == steady("negative", -3.0)
    assert lines["width"][:2] == ("width", 3.0) and math.isnan(lines["width"].error)
    assert lines["width"][3:5] == ("V", "the larger one, which an inverse adds")
    said = dict(found.remarks)
    assert said["runs"] == "6 at 6 voltages, 4 moved without a pause"
    assert said["by place"] == (
        "forwards 2 V from 0 counts to 2 V from 0 counts; "
        "backwards 3 V from 1000 counts to 3 V from 1000 counts"
    )
    assert (found.data["positive"], found.data["negative"], found.data["width"]) == (2.0, 3.0, 3.0)
    assert tomllib.loads(found.toml) == {"controller": {"dead_zone": "3 V"}}
    assert "# forwards 2 V, backwards 3 V" in found.toml
    head = "# The dead zone that the controller's inverse compensates (Section 4.2.3).\n"
    assert found.toml.startswith(head + "# Use: macromicro run --config model.toml\n")
    drawn = found.plot()
    only = plots(drawn["thresholds"])[0]
    assert (only.x, only.y) == ("start [counts]", "voltage [V]")
    assert [x[0] for x in only.lines] == ["forwards", "backwards"]
    assert [list(x[1]) for x in only.lines] == [[0.0], [1000.0]]
    assert [list(x[2]) for x in only.lines] == [[2.0], [3.0]]
    speeds = plots(drawn["speeds"])[0]
    assert [x[0] for x in speeds.lines] == ["-5 V", "-3 V", "-2.5 V", "1.5 V", "2 V", "4 V"]
    assert (speeds.x, speeds.y) == ("place [counts]", "speed [counts/s]")
    assert np.nanmean(speeds.lines[4][2]) == pytest.approx(1000.0)


def test_a_gain_gives_the_jump(file: Path) -> None:
    # 1000 (|V| - 1) counts/s over 500 counts/s/V is 2 V' + 1.5 V, V' = |V| - 1.75 V.
    found = deadzone.identify(given(file), Options(travel=(0.0, 1000.0), gain=500.0, width=1.75))
    assert [x.name for x in found.lines[3:]] == [
        "a0 forwards", "delta forwards", "a0 backwards", "delta backwards", "a0", "delta",
    ]  # fmt: skip
    assert dict(found.remarks)["(4.5)"].startswith("Vout = a0 + delta |V|, V beyond 1.75 V, ")
    forwards = facts(found.lines)
    assert forwards["a0 forwards"].value == pytest.approx(1.5)
    assert forwards["delta forwards"].value == pytest.approx(2.0)
    assert forwards["a0"].unit == "V" and forwards["delta"].unit == ""


@pytest.mark.parametrize("pause", [0.0, -1.0])
def test_a_pause_is_above_zero(file: Path, pause: float) -> None:
    with pytest.raises(InputError, match=r"--pause: .*a time above 0 s"):
        deadzone.identify(given(file), Options(pause=pause))


def test_no_voltage_no_dead_zone(tmp_path: Path) -> None:
    t = np.arange(50.0)
    still = table(tmp_path / "0.csv", "t_s,u_V,x_m", t, 0 * t, t)
    with pytest.raises(
        InputError, match=r"0\.csv: there is no stretch at a constant voltage other than 0"
    ):
        deadzone.identify(given(still), Options())


def test_stretches_of_twenty_samples_count() -> None:
    u = np.r_[np.full(20, 1.0), np.full(19, 2.0), np.zeros(25), np.full(21, -1.0)]
    t = np.arange(len(u)) * DT
    part = Picked("f", {"t": t, "u": u, "x": 2.0 * t}, {}, {}, {})
    with pytest.warns(DataWarning, match="f: 1 stretches of constant voltage under 20 samples"):
        runs = deadzone.constant(part)
    assert [(r.u[0], len(r.u)) for r in runs] == [(1.0, 20), (-1.0, 21)]
    np.testing.assert_allclose(runs[1].x, 2.0 * t[64:])


def zone(
    *trials: tuple[float, float, bool], positive: float = 2.0, negative: float = 3.0
) -> DeadZone:
    made = tuple(Trial(v, start, 9.0, 0.0, ok, True) for v, start, ok in trials)
    return DeadZone(
        positive, negative, max(positive, negative), made, *(np.zeros(1),) * 2, np.zeros((1, 1))
    )


def test_the_step_below_and_the_words_by_place() -> None:
    one = zone(
        (1.0, 0.0, False), (1.5, 5.0, True), (2.0, 0.0, True), (-2.6, 7.0, True), (-3.0, 7.0, True)
    )
    assert deadzone.step_below(one, 1.0) == 0.5
    assert deadzone.step_below(one, -1.0) == pytest.approx(0.4)
    assert math.isnan(deadzone.step_below(one._replace(positive=1.0), 1.0))
    assert deadzone.spread(one, "mm") == (
        "forwards 1.5 V from 5 mm to 2 V from 0 mm; backwards 2.6 V from 7 mm to 2.6 V from 7 mm"
    )
    assert deadzone.spread(zone((1.0, 0.0, False)), "mm") == ""


def test_beyond_the_board_there_is_no_setting() -> None:
    text = deadzone.settings(zone(positive=deadzone.FULL_SCALE))
    assert tomllib.loads(text) == {"dead_zone": {"width": deadzone.FULL_SCALE}}
    assert text.startswith(
        "# The dead zone that the controller's inverse compensates (Section 4.2.3).\n"
        f"# Not for the bench, whose D/A board ends at {deadzone.FULL_SCALE:g} V.\n"
    )
    assert "dead_zone = " in deadzone.settings(zone(positive=0.99 * deadzone.FULL_SCALE))
    assert Options() == (None, 0.05, None, None, ())


def test_without_a_width_the_one_found_is_taken(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[float] = []
    monkeypatch.setattr(deadzone, "jump", lambda runs, gain, width, said: seen.append(width))
    monkeypatch.setattr(deadzone, "jump_lines", lambda law: [])
    deadzone.identify(given(file), Options(travel=(0.0, 1000.0), gain=500.0))
    assert seen == [3.0]


def test_a_single_sample_is_a_stretch_too_short() -> None:
    u = np.r_[np.full(20, 1.0), 2.0, np.full(20, -1.0)]
    t = np.arange(41.0)
    with pytest.warns(DataWarning, match="f: 1 stretches"):
        assert len(deadzone.constant(Picked("f", {"t": t, "u": u, "x": t}, {}, {}, {}))) == 2


def test_a_voltage_below_1_V_is_a_step_too() -> None:
    one = zone((0.5, 0.0, False), (2.0, 0.0, True), (-0.25, 0.0, False), (-3.0, 0.0, True))
    assert deadzone.step_below(one, 1.0) == 1.5
    assert deadzone.step_below(one, -1.0) == 2.75


def test_the_travel_of_the_file_is_taken_unless_one_is_given(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = []

    def dead_zone(*args: object, travel: tuple[float, float] | None, pause: float) -> DeadZone:
        seen.append((travel, pause))
        return zone((2.0, 0.0, True), (-3.0, 9.0, True))

    monkeypatch.setattr(identify, "dead_zone", dead_zone)
    one = {"t": np.arange(30.0), "u": np.full(30, 2.0), "x": np.arange(30.0)}
    both = mat(tmp_path / "a.mat", **one, travel_low=1.0, travel_high=20.0)
    low = mat(tmp_path / "b.mat", **one, travel_low=1.0)
    for file, options in (
        (both, Options()),
        (both, Options(travel=(2.0, 5.0), pause=0.5)),
        (low, Options()),
    ):
        deadzone.identify(given(file), options)
    assert seen == [((1.0, 20.0), 0.05), ((2.0, 5.0), 0.5), (None, 0.05)]


def test_places_without_a_unit_and_eight_speeds_at_most(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = zone((2.0, 0.0, True), (-3.0, 9.0, True))
    t = np.arange(30.0)
    file = mat(tmp_path / "a.mat", t=t, u=np.full(30, 2.0), x=t)
    for count, shown in ((8, 8), (9, 5), (16, 8), (17, 6)):
        volts = np.arange(1.0, count + 1.0)
        many = made._replace(volts=volts, speeds=np.zeros((count, 1)))
        monkeypatch.setattr(identify, "dead_zone", lambda *args, many=many, **kw: many)
        found = deadzone.identify(given(file), Options())
        drawn = found.plot()
        assert len(plots(drawn["speeds"])[0].lines) == shown
    assert plots(drawn["speeds"])[0].y == "speed [x/s]"
    assert plots(drawn["thresholds"])[0].x == "start [x]"
    assert dict(found.remarks)["by place"].startswith("forwards 2 V from 0 x to")


def other(path: Path, *volts: float) -> Path:
    u = np.concatenate([np.r_[np.full(N, v), np.zeros(30)] for v in volts])
    x = np.concatenate([np.r_[moved(v), np.full(30, moved(v)[-1])] for v in volts])
    return table(path, "t_s,u_V,x_counts", np.arange(len(u)) * DT, u, x)


def test_runs_that_are_not_fitted_are_foretold(file: Path, tmp_path: Path) -> None:
    # -2.7 V is 2.7 of the 3 V that moved here; -3.5 V moves; 1.8 V does not, and 2.2 V does.
    seen = other(tmp_path / "b.csv", 1.8, 2.2, -2.7, -3.5)
    options = Options(travel=(0.0, 1000.0), tests=(str(seen),))
    found = deadzone.identify(given(file), options)
    line = facts(found.lines)["test"]
    assert line[1] == 100.0
    assert line[4] == "of 4 test runs behave as predicted: b.csv"
    assert found.data["tests"] == [{"file": str(seen), "runs": 4, "right": 4}]
    series = plots(found.plot()["thresholds"])[0].lines
    assert [x[0] for x in series[2:]] == ["not fitted: moved on", "not fitted: paused"]
    assert sorted(series[2][2]) == [2.2, 3.5] and sorted(series[3][2]) == [1.8, 2.7]


def test_a_run_that_goes_otherwise_counts_as_wrong(file: Path, tmp_path: Path) -> None:
    seen = other(tmp_path / "b.csv", 2.2, 3.0)
    lower = zone(positive=2.5, negative=3.0)
    runs = deadzone.constant(load(given(seen), deadzone.ROLES)[0])
    told = deadzone.prediction(lower, None, runs, "b.csv", 0.05)
    assert (told.right, len(told.runs), told.distance) == (1, 2, None)


def test_with_a_gain_the_way_is_foretold_too(file: Path, tmp_path: Path) -> None:
    seen = other(tmp_path / "b.csv", 3.0, 2.5)
    options = Options((0.0, 1000.0), gain=500.0, width=1.75, tests=(str(seen),))
    found = deadzone.identify(given(file), options)
    named = [x for x in found.lines if x.name == "test"]
    assert [x.value for x in named] == pytest.approx([100.0, 100.0], abs=1e-6)
    assert found.data["tests"][0]["rms"] == pytest.approx(0.0, abs=1e-6)
    assert "free_run" in found.plot()


def test_within_the_dead_zone_the_model_stands() -> None:
    law = discontinuous_dead_zone(
        [(np.arange(N) * DT, np.full(N, v), moved(v)) for v in (2.0, 4.0, -3.0, -5.0)], 500.0, 1.75
    )
    t = np.arange(20) * DT
    runs = [Run(t, np.full(20, v), np.full(20, 7.0)) for v in (1.0, -1.75, 3.0)]
    one = deadzone.predicted_travel(law, runs, "f")
    assert list(one.model[:40]) == [7.0] * 40
    assert one.model[41] - 7.0 == pytest.approx(2000.0 * DT)
    assert list(np.diff(one.t)) == pytest.approx([DT] * 59)


def test_a_test_without_a_run_is_refused(file: Path, tmp_path: Path) -> None:
    t = np.arange(50.0)
    still = table(tmp_path / "0.csv", "t_s,u_V,x_counts", t * DT, 0 * t, t)
    with pytest.raises(InputError, match=r"--test, .*no stretch at a constant voltage"):
        deadzone.identify(given(file), Options(tests=(str(still),)))
