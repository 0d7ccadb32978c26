"""`identify thermal`: what is made of fits, and of steps whose end or fall shows nothing."""

from __future__ import annotations

import math
import tomllib
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import t as student
from tests.identify.kinds.seen import degrees, facts, given, plots, table

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis import table_files
from macromicro.identify import _report
from macromicro.identify.heating import CoolingFit, GainFit, HeatingFit, StepRecord
from macromicro.identify.kinds import thermal
from macromicro.identify.kinds.thermal import Found, Options, Source, Steps
from macromicro.identify.notices import DataWarning
from macromicro.models.heating import Ladder, Modes, step_response
from macromicro.models.weighted_gain import Exponential, exponential

MODES = Modes(2.0, 0.5, 0.1, 0.6, 0.3, 0.1)
ERRORS = Modes(0.2, 0.05, 0.01, 0.06, 0.03, 0.02)
LADDER = Ladder(1.0, 0.2, 3.0, 0.4, 5.0, 0.6)
FIT = HeatingFit(MODES, ERRORS, LADDER, 0.0125)
MEASURED = Source(None, None)


def record(rise: Array, dt: float = 0.5, error: Array | float = 0.0) -> StepRecord:
    y = np.asarray(rise, np.float64)
    return StepRecord(np.arange(len(y)) * dt, y, y, np.broadcast_to(error, y.shape))


def test_a_steady_rise_is_the_mean_of_two_seconds_or_a_tenth() -> None:
    ramp = np.arange(101.0)
    remarks: list[tuple[str, str]] = []
    records = {1.0: record(ramp, 0.5), 2.0: record(ramp[:11], 1.0)}
    # The last 2 s of 50 s are five samples, the last tenth of 10 s two.
    assert thermal._steady(records, MEASURED, remarks) == {1.0: 98.0, 2.0: 9.5}
    assert remarks == []


def test_a_step_whose_end_shows_no_temperature_is_left_out() -> None:
    ramp = np.linspace(0.0, 20.0, 101)
    late = np.where(np.arange(101) == 100, math.nan, 0.0)
    remarks: list[tuple[str, str]] = []
    records = {1.0: record(ramp), 1.5: record(ramp, error=late), 2.0: record(ramp)}
    assert list(thermal._steady(records, MEASURED, remarks)) == [1.0, 2.0]
    assert remarks == [("no steady temperature", "at 1.5 V: the position does not show it")]
    law = degrees()
    stop = record(np.linspace(law.f_low, law.f_low + law.span, 101))
    records = {1.0: record(ramp / 100.0), 2.0: stop, 3.0: record(ramp, error=late)}
    assert list(thermal._steady(records, Source(law, None), remarks)) == [1.0]
    assert remarks[1][1].startswith("at 2, 3 V")
    with pytest.raises(InputError, match="steps: no step shows a steady temperature"):
        thermal._steady({2.0: stop}, Source(law, None), remarks)


def test_the_middle_step_shows_the_dynamics_or_the_one_asked_for() -> None:
    def chosen(every: str, steady: str, requested: float | None = None) -> float:
        blank = record(np.zeros(2))
        records = {float(v): blank for v in every.split()}
        return thermal._choose_step(records, {float(v): 1.0 for v in steady.split()}, requested)

    assert chosen("1 2 3 4 5", "1 2 3 4 5") == 3.0
    assert chosen("5 1 3 2", "5 1 3 2") == 2.0
    assert chosen("1 2 3 4 5", "1 2 4 5") == 4.0  # of two as near the higher one
    assert chosen("1 2 3 4 5", "1 5") == 5.0
    assert chosen("1 2 3 4 5", "1 4") == 4.0
    assert chosen("1 2 3 4 5", "2 5") == 2.0
    assert chosen("1 2 3", "1 2 3", 1.0) == 1.0
    assert chosen("1 2 3", "1 2 3", 3.0 + 5e-7) == 3.0
    for other in (2.4, 0.5, 3.5, 2.5, -1.0):
        with pytest.raises(InputError, match=f"--step: '?{other}'?; .* is steady: 1, 2, 3"):
            chosen("1 2 3", "1 2 3", other)


def test_four_voltages_give_the_static_gain() -> None:
    law = Exponential(b=30.0, a=1.5, x0=1.0, y0=5.0)
    rises = {v: exponential(law, v) for v in (1.0, 1.5, 2.0, 3.0)}
    remarks: list[tuple[str, str]] = []
    found = thermal._gain(rises, remarks)
    assert found is not None and found.model == pytest.approx(law, rel=1e-6)
    assert remarks == []
    assert thermal._gain({v: rises[v] for v in (1.0, 2.0, 3.0)}, remarks) is None
    assert remarks == [("static gain", "3 steady voltages; four are needed for (5.2)")]
    assert thermal._gain({v: -rises[v] for v in rises}, remarks) is None
    assert remarks[1][0] == "static gain" and remarks[1][1].startswith("(5.2) does not fit: ")


def test_a_fall_that_shows_nothing_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    fit = CoolingFit(4.0, 4.1, 0.01, 60.0)

    def fall(group: Any, source: Source, cold: Any) -> CoolingFit:
        assert cold == ()
        if group == ["bad"]:
            raise InputError("cooling record", "a fall", "another")
        assert source is MEASURED
        return fit

    monkeypatch.setattr(thermal, "fall", fall)
    groups: Any = {3.0: ["good"], 2.0: ["bad"], 1.0: ["good"]}
    with pytest.warns(DataWarning, match="^cooling from 2 V left out: cooling record: 'a fall'"):
        assert list(thermal._falls(Steps({}, groups), MEASURED)) == [1.0, 3.0]


def found(n: int = 5, gain: GainFit | None = None, cooling: bool = True) -> Found:
    rise = 40.0 * step_response(MODES, np.arange(100) * 0.5)
    records = {v: record(rise) for v in np.arange(1.0, n + 1.0)}
    rises = {v: 10.0 * v for v in records}
    falls = {2.0: CoolingFit(4.0, 4.125, 0.01, 60.0)} if cooling else {}
    return Found(records, rises, 2.0, FIT, gain, falls)


GAIN = GainFit(
    Exponential(30.0, 1.5, 1.0, 5.0),
    np.array([[28.0, 32.0], [1.0, 2.0], [4.5, 5.5]]),
    35.0,
    (33.0, 37.0),
    0.25,
)


def test_lines_of_gain_rates_shares_ladder_and_cooling() -> None:
    lines = facts(thermal._lines(found(5, GAIN)))
    assert list(lines) == [
        *(f"rise at {v} V" for v in range(1, 6)), "b", "a", "y0", "asymptote b + y0",
        "rate 1", "rate 2", "rate 3", "share 1", "share 2", "share 3",
        "c1", "r1", "c2", "r2", "c3", "r3", "cooling from 2 V",
    ]  # fmt: skip
    assert lines["rise at 3 V"][1] == 30.0 and lines["rise at 3 V"].unit == "K"
    half = float(student.ppf(0.975, 2))  # five voltages, three parameters
    for name, value, reach, unit in (
        ("b", 30.0, 2.0, "K"), ("a", 1.5, 0.5, "1/V"), ("y0", 5.0, 0.5, "K"),
        ("asymptote b + y0", 35.0, 2.0, "K"),
    ):  # fmt: skip
        assert lines[name][1] == value and lines[name].unit == unit
        assert lines[name].error == pytest.approx(reach / half)
    assert lines["b"].note == "(5.2), 95 %: 28 to 32"
    assert lines["asymptote b + y0"].note == "95 %: 33 to 37; RMS error of the curve 0.25 K"
    for k, (rate, share) in enumerate(zip(MODES[:3], MODES[3:], strict=True)):
        assert lines[f"rate {k + 1}"][1:4] == (rate, ERRORS[k], "rad/s")
        assert lines[f"rate {k + 1}"].note == f"time constant {1.0 / rate:.4g} s"
        assert lines[f"share {k + 1}"][1:4] == (share, ERRORS[3 + k], "")
    for name, value in LADDER._asdict().items():
        assert lines[name].value == value and lines[name].note == "ladder"
        assert lines[name].unit == ("s" if name[0] == "c" else "")
    cool = lines["cooling from 2 V"]
    assert (cool.value, cool.unit) == (4.0, "s")
    assert cool.note == "to 63 % of the fall from 60 degC; by least squares 4.125 s"
    few = facts(thermal._lines(found(3, None, cooling=False)))
    assert "b" not in few and "cooling from 2 V" not in few


def test_what_a_step_s_end_leaves_to_come_is_an_error_of_its_rise() -> None:
    """After 49.5 s: 10 % of it by a time constant of 10 s."""
    made = found(2)
    line = facts(thermal._lines(made))["rise at 2 V"]
    left = 20.0 * 0.1 * math.exp(-4.95)
    doubt = thermal._doubt(made.records[2.0])
    assert line.error == pytest.approx(math.hypot(doubt, left), rel=1e-6)
    assert left > doubt and line.note == "0.014 K still to come at its end"
    unsure = FIT._replace(std=Modes(*ERRORS[:2], 0.051, *ERRORS[3:]))
    other = facts(thermal._lines(made._replace(heating=unsure)))["rise at 2 V"]
    assert math.isnan(other.error) and other.note == "at the end of the step"


def test_a_slowest_rate_that_is_not_told_leaves_the_rise_without_error(tmp_path: Path) -> None:
    """40 s of a heating whose slowest time constant is 100 s."""
    t = np.arange(0.0, 40.0, 0.1)
    modes = Modes(1.75, 0.108, 0.0099, 0.74, 0.21, 0.05)
    noise = 0.1 * np.random.default_rng(3).standard_normal(len(t))
    y = 25.0 + 60.0 * step_response(modes, t) + noise
    file = table(tmp_path / "a.csv", "t_s,u_V,temperature_C", t, 0.0 * t + 3.0, y)
    with pytest.warns(DataWarning, match=r"lasts 39\.9 s, too short for its slowest time"):
        made = thermal.identify(given(file), Options())
    line = facts(made.lines)["rise at 3 V"]
    assert math.isnan(line.error) and line.note == "at the end of the step"


def test_the_doubt_of_a_rise_is_the_table_s_and_the_scatter() -> None:
    y = np.where(np.arange(101) % 2, 1.0, -1.0)
    # The last 2 s of 50 s: five samples, -1 1 -1 1 -1.
    spread = float(np.std(y[96:])) / math.sqrt(5.0)
    assert thermal._doubt(record(y, 0.5)) == pytest.approx(spread)
    error = np.where(np.arange(101) >= 96, 0.3, 9.0)
    assert thermal._doubt(record(y, 0.5, error)) == pytest.approx(math.hypot(0.3, spread))
    # The last tenth of 10 s: two samples.
    assert thermal._doubt(record(y[:11], 1.0)) == pytest.approx(1.0 / math.sqrt(2.0))


def test_figures_of_the_step_its_residuals_and_the_gain() -> None:
    one = found(5, GAIN)
    step = one.records[2.0]
    error = np.where(np.arange(100) < 2, math.nan, 0.0)
    one.records[2.0] = step._replace(rise=step.rise + 1.0, error=error)
    drawn = thermal._draw(one)
    curves = thermal._curves(one)
    top = plots(_report.free_run(curves.pairs, [], curves.label))[0]
    model = 20.0 * step_response(MODES, step.t[2:])
    assert top.y == "temperature rise [K]"
    np.testing.assert_allclose(top.lines[0][1], step.t[2:])
    np.testing.assert_allclose(top.lines[0][2], step.rise[2:] + 1.0)
    np.testing.assert_allclose(top.lines[1][2], model)
    assert curves.dt == 0.5
    gain = plots(drawn["gain"])[0]
    assert (gain.title, gain.x, gain.y) == ("static gain", "voltage [V]", "temperature rise [K]")
    (a, x, y), (b, xs, curve) = gain.lines
    assert (a, b) == ("measured", "(5.2)")
    np.testing.assert_array_equal(x, np.arange(1.0, 6.0))
    np.testing.assert_array_equal(y, 10.0 * np.arange(1.0, 6.0))
    np.testing.assert_allclose(xs, np.linspace(1.0, 5.0, 100))
    np.testing.assert_allclose(curve, [exponential(GAIN.model, v) for v in xs])
    assert len(plots(thermal._draw(found(3))["gain"])[0].lines) == 1


def test_model_toml_holds_every_number() -> None:
    text = thermal._toml(found(2, GAIN))
    assert text.startswith(
        "# Heating and cooling as identified, for other programs and macromicro.models.\n"
        "# Not for `macromicro run --config`: the bench has wires and plates, not these modes.\n"
    )
    assert tomllib.loads(text) == {
        "heating": {"rates": [2.0, 0.5, 0.1], "shares": [0.6, 0.3, 0.1]},
        "ladder": LADDER._asdict(),
        "steady": {"volts": [1.0, 2.0], "rise": [10.0, 20.0]},
        "gain": {"b": 30.0, "a": 1.5, "x0": 1.0, "y0": 5.0},
        "cooling": {"volts": [2.0], "time": [4.0]},
    }
    assert "# of the rise; error 1.25 %\n" in text
    assert "c1 = 1.0  # s\n" in text and "r1 = 0.2  # K per K of heat\n" in text
    less = tomllib.loads(thermal._toml(found(2, None, cooling=False)))
    assert set(less) == {"heating", "ladder", "steady"}


@pytest.fixture
def fitted(monkeypatch: pytest.MonkeyPatch) -> list[tuple[StepRecord, float]]:
    """What was fitted to; the fit is always `FIT`."""
    seen: list[tuple[StepRecord, float]] = []
    monkeypatch.setattr(thermal, "heating", lambda *given: seen.append(given) or FIT)
    return seen


def steps(place: Path, head: str, *ends: float, scale: float = 1.0, offset: float = 0.0) -> Path:
    """A step to 1 V, 2 V, ... of 20 s each, from 25 degC, by `ends` K within some seconds."""
    t = np.tile(np.arange(200) * 0.1, len(ends))
    u, run = (np.repeat(np.arange(len(ends)) + k, 200) for k in (1.0, 0.0))
    rise = np.concatenate([e * -np.expm1(-np.arange(200) * 0.1) for e in ends])
    return table(place, head, t, u, scale * (25.0 + rise + offset), run)


def test_measured_temperatures(tmp_path: Path, fitted: list[tuple[StepRecord, float]]) -> None:
    file = steps(tmp_path / "a.csv", "t_s,u_V,temperature_C,run", 10.0, 20.0, 30.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = thermal.identify(given(file), Options())
    assert made.data["steady_K"] == pytest.approx({1.0: 10.0, 2.0: 20.0, 3.0: 30.0})
    assert (made.data["chosen_V"], made.data["nrmse"]) == (2.0, 0.0125)
    ((step, rise),) = fitted
    assert rise == pytest.approx(20.0) and step.rise[-1] == pytest.approx(20.0)
    said = dict(made.remarks)
    assert said["dynamics"] == "from the step to 2 V, error 1.25 % of its range"
    assert said["static gain"].startswith("3 steady")
    assert "ladder" in said and "free_run" in made.plot()
    assert thermal.identify(given(file), Options(step=3.0)).data["chosen_V"] == 3.0
    cold = thermal.identify(given(file), Options(ambient=15.0))
    assert cold.data["steady_K"][1.0] == pytest.approx(20.0)
    assert Options() == (None, None, None, ())


@pytest.mark.parametrize(
    ("change", "share"), [(0.03, "2.9"), (-0.03, "-3.1"), (0.005, ""), (-0.005, "")]
)
def test_a_step_that_still_changes_is_told(
    tmp_path: Path, fitted: list[tuple[StepRecord, float]], change: float, share: str
) -> None:
    t = np.arange(500) * 0.1
    rise = 20.0 * -np.expm1(-t) * (1.0 + change * np.maximum(t - 45.0, 0.0) / 4.0)
    file = table(tmp_path / "a.csv", "t_s,u_V,temperature_C", t, 0.0 * t + 2.0, 25.0 + rise)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        thermal.identify(given(file), Options())
    words = [str(w.message) for w in told]
    # Its first and last fifth are 4 s apart: `change`, of an end that is 1 + 4.9 / 4 `change`.
    accepted = f"the step to 2 V still changed by {share} % in its last tenth; "
    assert words == ([f"{accepted}its end was taken as steady"] if share else [])


def test_a_table_turns_positions_into_temperatures(
    tmp_path: Path, fitted: list[tuple[StepRecord, float]]
) -> None:
    place = tmp_path / "table.h5"
    table_files.save_table(degrees(), place)
    head = "t_s,u_V,x_mm,run"
    file = steps(tmp_path / "a.csv", head, 10.0, 20.0, scale=0.1, offset=-20.0)
    made = thermal.identify(given(file), Options(table=place))
    assert made.data["steady_K"] == pytest.approx({1.0: 10.0, 2.0: 20.0}, abs=0.5)
    with pytest.raises(InputError, match="no column for T"):
        thermal.identify(given(file), Options())
    table_files.save_table(replace(degrees(), output_unit="um"), place)
    with pytest.raises(InputError, match="input is in degC and its output in um"):
        thermal.identify(given(file), Options(table=place))


def test_steps_that_were_not_fitted(
    tmp_path: Path, fitted: list[tuple[StepRecord, float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """At a voltage that was measured by its rise, between them by (5.2), else refused."""
    head = "t_s,u_V,temperature_C,run"
    file = steps(tmp_path / "a.csv", head, 10.0, 20.0)
    own = steps(tmp_path / "b.csv", head, 12.0)
    made = thermal.identify(given(file), Options(tests=(str(own),)))
    (told,) = made.data["tests"]
    t = np.arange(200) * 0.1
    measured, model = 12.0 * -np.expm1(-t), 10.0 * np.asarray(step_response(MODES, t))
    assert told["rms"] == pytest.approx(float(np.sqrt(np.mean((measured - model) ** 2))), rel=1e-6)
    assert facts(made.lines)["test"].unit == "%" and "b.csv" in facts(made.lines)["test"].note
    titles = [one.title for one in plots(made.plot()["free_run"])]
    assert [name for name in titles if "fitted" in name] == ["fitted", "not fitted: b.csv"]
    half = table(tmp_path / "c.csv", "t_s,u_V,temperature_C", t, 0.0 * t + 1.5, 25.0 + measured)
    with pytest.raises(InputError, match=r"steps to 1\.5 V\. Give one of 1, 2 V"):
        thermal.identify(given(file), Options(tests=(str(half),)))
    monkeypatch.setattr(thermal, "_gain", lambda rises, remarks: GAIN)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = thermal.identify(given(file), Options(tests=(str(half),)))
    for volts in (0.5, 2.5):
        far = table(
            tmp_path / "d.csv", "t_s,u_V,temperature_C", t, 0.0 * t + volts, 25.0 + measured
        )
        with pytest.warns(DataWarning, match=rf"d\.csv: .*to {volts} V is extra.* from 1 to 2 V"):
            thermal.identify(given(file), Options(tests=(str(far),)))
    model = exponential(GAIN.model, 1.5) * np.asarray(step_response(MODES, t))
    missed = float(np.sqrt(np.mean((measured - model) ** 2)))
    assert found.data["tests"][0]["rms"] == pytest.approx(missed, rel=1e-6)
