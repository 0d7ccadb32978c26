"""`identify hall` on sweeps of a sensor that is known to the micrometre."""

from __future__ import annotations

import itertools
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from tests.identify.kinds.seen import facts, given, plots, table

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.kinds import hall
from macromicro.identify.kinds.hall import Options
from macromicro.identify.notices import DataWarning, SaturationWarning
from macromicro.identify.picking import Picked
from macromicro.identify.result import Result

OFFSETS = (0.012, -0.008, 0.008, -0.012)  # mm, of two rises and two falls of the position
STD = math.sqrt(sum(x * x for x in OFFSETS) / 3.0) * 1e3  # um
COUNT = (601, 400, 400, 400)
CSV = Options(points=51)


def sensor(folder: Path, slope: float, ways: tuple[bool, ...] = (True, False, True, False)) -> Path:
    """mm over V: a line through 0 mm at 1 V, and each run off it by its own offset."""
    v, x, run = [], [], []
    for k, (off, n, up) in enumerate(zip(OFFSETS, COUNT, ways, strict=True)):
        volts = np.linspace(0.5, 4.5, n)
        if up != (slope > 0.0):
            volts = volts[::-1]
        v.append(volts)
        x.append(slope * (volts - 1.0) + off)
        run.append(np.full(n, float(k)))
    return table(folder / "a.csv", "v_V,x_mm,run", *map(np.concatenate, (v, x, run)))


def check_uncertainty(found: Result) -> None:
    """What `OFFSETS` are worth, whichever way the sensor goes."""
    shown = plots(found.plot()["residuals"])[0]
    assert (shown.x, shown.y) == ("sensor [V]", "[um]")
    each = {label: (x, y) for label, x, y in shown.lines}
    for label, value in (
        ("one run off the mean", STD),
        ("the mean", STD / 2.0),
        ("up less down, half", 10.0),
    ):
        x, y = each[label]
        np.testing.assert_allclose(x, np.linspace(0.0, 5.0, 51))
        seen = np.isfinite(y)
        assert 38 <= seen.sum() <= 41
        np.testing.assert_allclose(y[seen], value, rtol=1e-6)


def test_a_rising_sensor(tmp_path: Path) -> None:
    found = hall.identify(given(sensor(tmp_path, 0.8)), CSV)
    lines = facts(found.lines)
    assert lines["slope"].value == pytest.approx(0.8) and lines["slope"].unit == "mm/V"
    assert (lines["from"].value, lines["to"].value) == (pytest.approx(0.6), pytest.approx(4.4))
    assert lines["from"].note == "at -0.3200 mm" and lines["to"].note == "at 2.7200 mm"
    assert lines["error, mean"].value == pytest.approx(STD / 2.0)
    assert lines["error, largest"].value == pytest.approx(STD / 2.0)
    assert lines["up from down"].value == pytest.approx(10.0)
    assert lines["bend"].value == pytest.approx(0.0, abs=1e-6)
    assert {x.unit for x in found.lines[3:]} == {"um"}
    assert dict(found.remarks)["runs"] == "4, one way each; 39 of 51 voltages seen"
    volts = np.linspace(0.0, 5.0, 51)
    np.testing.assert_allclose(found.data["volts"], volts)
    np.testing.assert_allclose(found.data["position_mm"], 0.8 * (volts - 1.0), atol=1e-9)
    np.testing.assert_allclose(found.model.position, 0.8e-3 * (volts - 1.0), atol=1e-12)
    assert np.nanmax(found.data["error_mm"]) == pytest.approx(STD / 2e3)
    assert np.nanmax(found.data["std_mm"]) == pytest.approx(STD / 1e3)
    check_uncertainty(found)
    assert tomllib.loads(found.toml) == {"calibration": {"file": hall.FILE}}
    assert found.toml.startswith(
        "# No setting of `macromicro run --config` holds a sensor's calibration.\n"
        "# The table is in hall_calibration.csv (volts, millimetres), as macromicro.control reads"
    )


def test_a_falling_sensor_has_the_same_uncertainty_and_lag(tmp_path: Path) -> None:
    found = hall.identify(given(sensor(tmp_path, -0.8)), CSV)
    volts = np.linspace(0.0, 5.0, 51)
    np.testing.assert_allclose(found.data["position_mm"], -0.8 * (volts - 1.0), atol=1e-9)
    assert facts(found.lines)["slope"].value == pytest.approx(-0.8)
    check_uncertainty(found)


def test_what_is_drawn_and_written(tmp_path: Path) -> None:
    found = hall.identify(given(sensor(tmp_path, 0.8)), CSV)
    shown = plots(found.plot()["calibration"])[0]
    assert (shown.x, shown.y) == ("sensor [V]", "position [mm]")
    (one, v, x), (two, volts, place) = shown.lines
    assert (one, two) == ("measured", "table")
    assert len(v) == 301 + 3 * 400  # of 601 samples every second
    off = np.repeat(OFFSETS, (301, 400, 400, 400))
    np.testing.assert_allclose(x, 0.8 * (v - 1.0) + off, atol=1e-9)
    np.testing.assert_allclose(place, 0.8 * (volts - 1.0), atol=1e-9)
    found.extra[hall.FILE](tmp_path / "made.csv")
    lines = (tmp_path / "made.csv").read_text().splitlines()
    assert lines[:2] == ["# Sensor calibration: mean of runs both ways", "hall_V,position_mm"]
    assert lines[2] == "0.0000,-0.800000" and lines[-1] == "5.0000,3.200000" and len(lines) == 53


def test_runs_of_one_way_show_no_lag(tmp_path: Path) -> None:
    file = sensor(tmp_path, 0.8, (True,) * 4)
    with pytest.warns(DataWarning, match="all runs go one way: the sensor's lag is not cancelled"):
        found = hall.identify(given(file), CSV)
    assert math.isnan(facts(found.lines)["up from down"].value)


def test_a_bent_sensor_is_off_a_line(tmp_path: Path) -> None:
    v = np.r_[np.linspace(0.0, 5.0, 1000), np.linspace(5.0, 0.0, 1000)]
    x = 1.0 + 0.5 * v + 0.1 * v * v
    found = hall.identify(given(table(tmp_path / "a.csv", "v_V,x_mm", v, x)), CSV)
    good = np.isfinite(found.data["error_mm"])
    volts, place = found.data["volts"][good], found.data["position_mm"][good]
    line = np.polyval(np.polyfit(volts, place, 1), volts)
    bend = facts(found.lines)["bend"].value
    assert bend == pytest.approx(1e3 * np.abs(place - line).max())
    # A parabola is off its chord's best line by a twelfth to an eighth of the span's square.
    span = volts[-1] - volts[0]
    assert 0.1e3 * span**2 / 12.0 < bend < 0.1e3 * span**2 / 5.0


@pytest.mark.parametrize(
    ("options", "found"),
    [
        (Options(2.0, 2.0), "126 points from 2 to 2 V"),
        (Options(points=9), "9 points from 0 to 5 V"),
        (Options(points=2001), "2001 points"),
    ],
)
def test_options_are_checked(options: Options, found: str) -> None:
    with pytest.raises(InputError, match=f"table: it has {found}.*10 to 2000 points, and --low"):
        hall.identify(given(), options)


@pytest.mark.parametrize("points", [10, 2000])
def test_ten_to_two_thousand_points_will_do(points: int, tmp_path: Path) -> None:
    v = np.r_[np.linspace(0.0, 5.0, 20000), np.linspace(5.0, 0.0, 20000)]
    file = table(tmp_path / "a.csv", "v_V,x_mm", v, v)
    assert len(hall.identify(given(file), Options(points=points)).data["volts"]) == points
    assert Options() == (0.0, 5.0, 126, "mean", ())


def picked(v: Array, x: Array) -> Picked:
    return Picked("f", {"v": v, "x": x}, {}, {}, {})


def corners(*values: float, n: int = 60) -> Array:
    """Straight legs of n samples from corner to corner."""
    legs = [np.linspace(a, b, n + 1)[1:] for a, b in itertools.pairwise(values)]
    return np.r_[values[0], np.concatenate(legs)]


def test_each_rise_and_fall_over_a_fifth_of_the_range_is_a_run() -> None:
    x = corners(0.0, 10.0, 0.0, 2.2, 0.1, 1.9, 0.0, 10.0)
    v = x + 0.001 * np.arange(len(x))
    found = hall.one_way(picked(v, x))
    # The rise to 1.9 is no turn; the fall after 2.2 goes on behind it.
    assert [len(x) for _, x in found] == [61, 61, 61, 181, 61]
    starts = [0, 60, 120, 180, 360]
    for (made, place), a in zip(found, starts, strict=True):
        np.testing.assert_array_equal(made, v[a : a + len(made)])
        np.testing.assert_array_equal(place, x[a : a + len(made)])
    scaled = hall.one_way(picked(v, 0.01 * x))
    assert [len(x) for _, x in scaled] == [61, 61, 61, 181, 61]


def test_fifty_samples_and_more_than_a_fifth_are_a_run() -> None:
    tail = np.r_[corners(0.0, 10.0)[1:], corners(10.0, 9.0)[1:]]
    for n, count in ((49, 3), (48, 1)):
        x = np.r_[corners(0.0, 10.0, 0.0, n=n), tail]
        assert len(hall.one_way(picked(x + 0.001 * np.arange(len(x)), x))) == count
    assert hall.LEAST == 50


def test_ends_of_the_sensor_are_left_out() -> None:
    x = corners(0.0, 10.0, 0.0, n=300)
    v = np.minimum(0.5 * x, 4.5)
    with pytest.warns(SaturationWarning, match=r"f, v: .* stay at 4\.5.*left out"):
        rise, fall = hall.one_way(picked(v, x))
    assert rise[0].max() < 4.5 and fall[0].max() < 4.5
    np.testing.assert_allclose(rise[0], 0.5 * rise[1])


@pytest.mark.parametrize(
    ("v", "x", "name"), [(0.0, 1.0, "v"), (1.0, 0.0, "x"), (0.0, 2.0, "v"), (0.0, 0.0, "x")]
)
def test_a_constant_column_is_refused(v: float, x: float, name: str) -> None:
    ramp = np.linspace(0.0, 1.0, 100)
    with pytest.raises(InputError, match=f"f, {name}: the column is constant"):
        hall.one_way(picked(v * ramp, x * ramp))
    assert len(hall.one_way(picked(ramp, ramp))) == 1


def test_without_a_run_there_is_nothing_to_fit(tmp_path: Path) -> None:
    short = np.linspace(0.0, 5.0, 49)
    file = table(tmp_path / "a.csv", "v_V,x_mm", short, short)
    with pytest.raises(
        InputError, match=r"a\.csv: there is no one-way run.*runs over the sensor's range"
    ):
        hall.identify(given(file), Options())


@pytest.mark.parametrize("slope", [0.8, -0.8])
def test_a_spline_of_either_slope_with_its_interval(tmp_path: Path, slope: float) -> None:
    found = hall.identify(given(sensor(tmp_path, slope)), CSV._replace(method="spline"))
    lines = facts(found.lines)
    assert {"within, 95 %", "lag", "pieces", "residual"} <= set(lines)
    volts = np.linspace(0.0, 5.0, 51)
    np.testing.assert_allclose(
        found.model.position[6:45], slope * 1e-3 * (volts - 1.0)[6:45], atol=4e-6
    )
    found.extra[hall.FILE](tmp_path / "made.csv")
    first = (tmp_path / "made.csv").read_text(encoding="utf-8").splitlines()[0]
    assert first == "# Sensor calibration: one spline for all runs, fitted with the lag"


def test_an_unknown_method_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="mean, spline"):
        hall.identify(given(sensor(tmp_path, 0.8)), CSV._replace(method="cubic"))
