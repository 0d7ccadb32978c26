"""`identify plays` on a recording that play operators made, so that they are found exactly."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from tests.identify.kinds.seen import facts, given, plots, table

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.files.reading import read_table
from macromicro.hysteresis import prandtl, prandtl_rate
from macromicro.hysteresis.prandtl_fit import PrandtlFit
from macromicro.identify import _report
from macromicro.identify.kinds import plays
from macromicro.identify.kinds.plays import ROLES, Options
from macromicro.identify.picking import pick

CORNERS = ((2.0, 12.0), (12.0, 2.0), (2.0, 9.0), (9.0, 4.0), (4.0, 12.0), (12.0, 3.0))
U = np.concatenate([np.linspace(a, b, 81)[1:] for a, b in CORNERS])
THRESHOLDS, WEIGHTS = [0.0, 1.25, 2.5, 3.75], [2.0, 0.5, 0.25, 0.125]
LAW = prandtl.operator(THRESHOLDS, WEIGHTS, 7.0)


def followed(p: prandtl.Prandtl, u: Array) -> Array:
    return prandtl.run(p, u, prandtl.relaxed(p, float(u[0])))


def found(folder: Path, head: str, *tests: str) -> plays.Result:
    file = table(folder / "own.csv", head, np.arange(U.size), U, followed(LAW, U))
    return plays.identify(given(file), Options(4, tests=tests))


def test_the_operator_its_loop_and_its_gains(tmp_path: Path) -> None:
    one = found(tmp_path, "t_s,u_V,x_um")
    np.testing.assert_allclose(one.model.thresholds, THRESHOLDS)
    np.testing.assert_allclose(one.model.weights, WEIGHTS, rtol=1e-6)
    lines = facts(one.lines)
    # Between the ends of +-5 V a play moves by 2 (5 - r), its branches are 2 min(r, 5 - r) apart.
    stroke = 2.0 * (2.0 * 5.0 + 0.5 * 3.75 + 0.25 * 2.5 + 0.125 * 1.25)
    width = 2.0 * (0.5 * 1.25 + 0.25 * 2.5 + 0.125 * 1.25)
    for name, value, unit in (
        ("input, from", 2.0, "V"),
        ("input, to", 12.0, "V"),
        ("stroke", stroke, "um"),
        ("loop width", 100.0 * width / stroke, "% of stroke"),
        ("reversible gain", 2.0, "um/V"),
        ("mean gain", stroke / 10.0, "um/V"),
        ("misfit", 0.0, "% of range"),
        ("prediction", 0.0, "% of range"),
    ):
        assert lines[name].value == pytest.approx(value, rel=1e-6, abs=1e-6), name
        assert lines[name].unit == unit
    said = dict(one.remarks)
    assert said["plays"] == "4, 4 of them with a weight, none below 0"
    # 11.375 V, half a threshold's step below the top, is sample 74; 0.3 of the other 406
    # were held out.
    assert said["samples"] == "284 fitted, 122 held out; the first 74 depend on the earlier input"
    assert one.data["stroke"] == pytest.approx(stroke)
    assert one.data["loop_width"] == pytest.approx(width)
    assert one.data["range"] == pytest.approx(float(np.ptp(followed(LAW, U))))
    assert Options() == (16, False, ())


def test_what_is_left_over_is_said_in_parts_of_the_range(tmp_path: Path) -> None:
    # 0.2 um off where it is fitted, 0.5 um where it is held out, from sample to sample.
    off = np.where(np.arange(U.size) < 358, 0.2, 0.5) * (-1.0) ** np.arange(U.size)
    f = followed(LAW, U)
    file = table(tmp_path / "own.csv", "t_s,u_V,x_um", np.arange(U.size), U, f + off)
    other = table(tmp_path / "other.csv", "t_s,u_V,x_um", np.arange(U.size), U, f)
    one = plays.identify(given(file), Options(4, tests=(str(other),)))
    lines, extent = facts(one.lines), float(np.ptp(f + off))
    assert lines["misfit"].value == pytest.approx(100.0 * 0.2 / extent, rel=0.01)
    assert lines["prediction"].value == pytest.approx(100.0 * 0.5 / extent, rel=0.01)
    assert one.data["rms"] == pytest.approx(0.2, rel=0.01)
    assert one.data["holdout_rms"] == pytest.approx(0.5, rel=0.01)
    assert dict(one.remarks)[f"prediction of {other}"].startswith("RMS 0.0")


@pytest.mark.parametrize(
    ("head", "u", "f", "per"),
    [
        ("t_s,u_A,f_N", "A", "N", "N/A"),
        ("t_s,u,f_N", "", "N", ""),
        ("t_s,u_A,f", "A", "", ""),
        ("t_s,u,f", "", "", ""),
    ],
)
def test_gains_have_a_unit_where_both_columns_have(
    tmp_path: Path, head: str, u: str, f: str, per: str
) -> None:
    one = found(tmp_path, head)
    lines = facts(one.lines)
    units = [lines[n].unit for n in ("input, to", "stroke", "reversible gain", "mean gain")]
    assert units == [u, f, per, per]
    comments = [line.partition("  # ")[2] for line in one.toml.splitlines() if "  # " in line]
    assert comments == [
        u or "unit of the input", per or "output per input", f or "unit of the output",
    ]  # fmt: skip


def test_the_model_file_is_in_volts_and_micrometres_or_as_it_is() -> None:
    text = plays.as_toml(LAW, ("mV", "mm"), (2.0, 12.0))
    assert text.startswith(
        "# For a machine of kind piezo: copy the table into its file. "
        "Here: input from 2 to 12 mV, output 7 mm at rest at 0.\n"
    )
    # Whoever runs it as it is runs the default stage with it: the file says which one.
    head = " ".join(text.partition("machine =")[0].replace("#", " ").split())
    assert (
        "other settings are the defaults: amplifier, stack, guide and sensor of a P-621.1CD" in head
    )
    made = tomllib.loads(text)
    assert made == {
        "machine": "piezo",
        "controller": {
            "loop_thresholds": ["0 V", "0.00125 V", "0.0025 V", "0.00375 V"],
            "loop_weights": ["2000000 um/V", "500000 um/V", "250000 um/V", "125000 um/V"],
        },
    }
    other = tomllib.loads(plays.as_toml(LAW, ("V", "N"), (2.0, 12.0)))
    assert other == {"hysteresis": {"thresholds": THRESHOLDS, "weights": WEIGHTS, "offset": 7.0}}


def test_figures_show_the_loop_what_is_left_over_and_the_weights() -> None:
    u, f = np.arange(10.0), np.arange(10.0) ** 2
    out = f - 0.5 * np.arange(10.0)
    drawn = plays.draw_figures(u, f, PrandtlFit(LAW, out, 2, 6, 0.0, 0.0), ("V", "um"))
    loop, rest, weights = (plots(drawn[n])[0] for n in ("curves", "residuals", "thresholds"))
    assert (loop.x, loop.y) == ("input [V]", "output [um]")
    assert [x[0] for x in loop.lines] == ["measured", "play operators"]
    for line, expected in zip(loop.lines, (f, out), strict=True):
        np.testing.assert_array_equal(line[1], u[2:])
        np.testing.assert_array_equal(line[2], expected[2:])
    assert (rest.x, rest.y) == ("sample", "output [um]")
    assert [x[0] for x in rest.lines] == ["fitted", "held out"]
    for line, part in zip(rest.lines, (slice(2, 6), slice(6, 10)), strict=True):
        np.testing.assert_array_equal(line[1], np.arange(10.0)[part])
        np.testing.assert_array_equal(line[2], 0.5 * np.arange(10.0)[part])
    assert (weights.x, weights.y) == ("threshold [V]", "weight [um/V]")
    np.testing.assert_array_equal(weights.lines[0][1], THRESHOLDS)
    np.testing.assert_array_equal(weights.lines[0][2], WEIGHTS)


def predicted(folder: Path, law: prandtl.Prandtl, u: Array, errors: Array) -> str:
    """What is said of another recording whose output is off by `errors`, for a range of 40."""
    file = table(folder / "test.csv", "u,f", u, followed(law, u) + errors)
    picked = pick(read_table(file), ROLES, {})
    name, text = _report.of_range(plays._predict(law, picked), 40.0)
    assert name == f"prediction of {file}"
    return text


def test_a_prediction_counts_from_where_the_past_is_forgotten(tmp_path: Path) -> None:
    law = prandtl.operator([0.0, 1.0, 2.0], [1.0, 1.0, 1.0])
    u = np.r_[np.linspace(5.0, 15.0, 21), np.linspace(15.0, 5.0, 21)]
    early = np.where(np.arange(42) < 8, 100.0, 0.4)  # up to a swing of twice 2
    assert predicted(tmp_path, law, u, early) == "RMS 1.00 % of range, over 34 samples"
    # A swing too small for the widest play: from 99 % of it on.
    u = np.r_[5.0, 8.0, np.linspace(8.0, 5.0, 21)]
    late = np.r_[100.0, np.zeros(22)]
    assert predicted(tmp_path, law, u, late) == "RMS 0.00 % of range, over 22 samples"


def test_curves_and_short_recordings_are_refused(tmp_path: Path) -> None:
    file = table(tmp_path / "c.csv", "curve,u_V,f_um", U, U, U)
    with pytest.raises(InputError, match=r"c\.csv, curve: the file holds single curves"):
        plays.identify(given(file), Options())
    with pytest.raises(InputError, match=r"2 files were given.* one recording"):
        plays.identify(given(file, file), Options())


def test_a_rate_needs_times_and_is_told_with_what_it_gains(tmp_path: Path) -> None:
    t = np.arange(8000) * 1e-3
    u = 50.0 - 50.0 * np.cos(2.0 * np.pi * (0.2 * t + 0.35 * t**2))
    p = prandtl.operator(np.arange(16) * 3.125, np.r_[0.6, np.full(15, 0.03)], 5.0)
    f = prandtl_rate.run(p._replace(widening=0.002), 0.004, u, 1e-3)
    file = table(tmp_path / "a.csv", "t_s,u_V,f_um", t, u, f)
    test = table(tmp_path / "test.csv", "t_s,u_V,f_um", t, u, f)
    made = plays.identify(given(file), Options(rate=True, tests=(str(test),)))
    lines = facts(made.lines)
    assert lines["widening"].value == pytest.approx(0.002, abs=1e-4)
    assert lines["lag"].value == pytest.approx(0.004, abs=2e-4) and lines["lag"].unit == "s"
    assert lines["without rate"].value > 5.0 * lines["prediction"].value
    assert "worse than this" in lines["without rate"].note
    assert made.data["lag"] == lines["lag"].value
    said = dict(made.remarks)[f"prediction of {test}"]
    assert float(said.split()[1]) < 0.2  # % of range
    still = table(tmp_path / "b.csv", "u_V,f_um", u, f)
    with pytest.raises(InputError, match="--rate"):
        plays.identify(given(still), Options(rate=True))
