"""`identify drive`: what it asks the fit for, and what follows from the fit."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.identify.kinds.fits import AXIS, HUNG, HUNG_NAMES, HUNG_STD, NAMES, STD, T, X, fit, si
from tests.identify.kinds.seen import facts, given, mat, plots, table

from macromicro import identify
from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.axis_fit import DriveFit
from macromicro.identify.kinds import drive
from macromicro.identify.kinds.drive import Options
from macromicro.identify.result import Line


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """What the fit is asked for; it is always the same but for gain and delay."""
    seen: list[dict[str, Any]] = []

    def fake(t: list[Array], u: list[Array], x: list[Array], **rest: Any) -> DriveFit:
        seen.append({"t": t, "u": u, "x": x, **rest})
        return fit(AXIS, NAMES, STD, rest["gain"], rest["delay"])

    monkeypatch.setattr(identify, "drive", fake)
    return seen


def test_a_file_in_volts_and_metres(tmp_path: Path, asked: list[dict[str, Any]]) -> None:
    u = np.cos(20.0 * T)
    files = [table(tmp_path / f"{k}.csv", "t_s,u_V,x_m", T, k * u, X) for k in (1, 2)]
    made = drive.identify(given(*files), Options())
    (one,) = asked
    assert (one["gain"], one["structure"], one["limit"], one["delay"]) == (1.0, "auto", None, 0)
    for k in (0, 1):
        np.testing.assert_allclose(one["t"][k], T)
        np.testing.assert_allclose(one["u"][k], (k + 1) * u, rtol=1e-12)
        np.testing.assert_allclose(one["x"][k], X, rtol=1e-12)
    lines = facts(made.lines)
    assert list(lines) == list(NAMES)
    assert lines["mass"][1:4] == (1.5, pytest.approx(0.1), "V*s^2/m")
    assert lines["mass"].note == "inertia; inverse dynamics 3.00 +- 0.20"
    note = "viscous friction; inverse dynamics 24.0 +- 1.0"
    assert lines["viscous"] == Line("viscous", 12.0, 0.5, "V*s/m", note)
    assert lines["coulomb"].note == "Coulomb friction; inverse dynamics 6"
    assert lines["coulomb"].unit == "V"
    said = dict(made.remarks)
    assert said["fit"] == "free run 91.35 %, RMS 5.976 mm over 400 samples"
    assert said["method"] == "output error, the more accurate one"
    assert said["on held-out data"] == "RMS 20 mm"
    assert said["force, inverse dynamics"] == "error 7.50 %"
    assert said["structure"] == "force error on held-out data: coulomb 0.25, taken; viscous 0.5"
    assert "gain" not in said and "delay" not in said
    assert (made.data["gain"], made.data["delay"], made.data["rms"]) == (
        1.0,
        0,
        pytest.approx(0.005976, rel=1e-3),
    )
    assert made.data["inverse"] == {"coulomb": 6.0, "viscous": 24.0, "mass": 3.0}
    assert made.data["inverse_std"]["mass"] == pytest.approx(0.2)
    assert (
        made.data["fit_percent"] == pytest.approx(91.35, abs=0.01)
        and made.data["holdout_rms"] == 0.02
    )
    assert tomllib.loads(made.toml)["machine"] == "axis"


def test_figures_show_positions_and_residuals(tmp_path: Path, asked: list[dict[str, Any]]) -> None:
    made = drive.identify(given(table(tmp_path / "a.csv", "t_s,u_V,x_m", T, T, X)), Options())
    drawn = made.plot()
    run = plots(drawn["free_run"])[0]
    assert run.y == "position [m]"
    np.testing.assert_allclose(run.lines[0][1], T)
    np.testing.assert_allclose(run.lines[0][2], X, rtol=1e-12)
    np.testing.assert_allclose(run.lines[1][2], X + 1.0)
    rest = plots(drawn["residuals"])[0]
    np.testing.assert_allclose(rest.lines[0][1], T, atol=1e-12)
    np.testing.assert_allclose(rest.lines[0][2], 0.01 * np.sin(3.0 * T))


def test_gain_and_delay_of_the_file_or_as_given(
    tmp_path: Path, asked: list[dict[str, Any]]
) -> None:
    columns: dict[str, Any] = {"t": T, "u_A": T, "x_m": X}
    both = mat(tmp_path / "a.mat", **columns, gain=3.0, gtau=5.0, delay=2.0)
    tau = mat(tmp_path / "b.mat", **columns, gtau=5.0)
    none = mat(tmp_path / "c.mat", t=T, u=T, x=X)

    def said(file: Path, options: Options) -> tuple[str | None, str | None]:
        made = drive.identify(given(file), options)
        remarks = dict(made.remarks)
        assert made.data["gain"] == asked[-1]["gain"] and made.data["delay"] == asked[-1]["delay"]
        return remarks.get("gain"), remarks.get("delay")

    assert said(both, Options()) == ("3 N/A, gain in the file", "u acts 2 samples late")
    assert said(tau, Options()) == ("5 N/A, gtau in the file", None)
    options = Options(gain=2.0, delay=3, limit=0.5, structure="full")
    assert said(both, options) == ("2 N/A, as given", "u acts 3 samples late")
    assert (asked[-1]["limit"], asked[-1]["structure"]) == (0.5, "full")
    assert said(both, Options(gain=1.0, delay=0)) == (None, None)
    assert said(none, Options(gain=2.0)) == ("2 N/u, as given", None)
    assert [(a["gain"], a["delay"]) for a in asked] == [(3, 2), (5, 0), (2, 3), (1, 0), (2, 0)]
    made = drive.identify(given(both), Options())
    assert facts(made.lines)["mass"].unit == "kg" and facts(made.lines)["coulomb"].unit == "N"
    made = drive.identify(given(none), Options())
    assert {line.unit for line in facts(made.lines).values()} == {""}
    assert dict(made.remarks)["units"] == (
        "none given for u and x; the parameters are in the units of the columns"
    )
    gained = drive.identify(given(none), Options(gain=2.0))
    assert {line.unit for line in facts(gained.lines).values()} == {""}
    assert dict(gained.remarks)["units"].startswith("none given for u and x")
    assert dict(made.remarks)["fit"].endswith("RMS 0.005976 x over 200 samples")
    assert Options() == (None, "auto", None, None, None, *[False] * 5, ())


@pytest.mark.parametrize("limit", [0.0, -1.0, math.nan])
def test_a_limit_is_above_zero(limit: float) -> None:
    with pytest.raises(InputError, match=r"--limit: .*; accepted: a value above zero"):
        drive.identify(given(), Options(limit=limit))


def test_two_hundred_samples_are_needed(tmp_path: Path, asked: list[dict[str, Any]]) -> None:
    file = table(tmp_path / "a.csv", "t_s,u_V,x_m", T[:199], T[:199], X[:199])
    with pytest.raises(InputError, match=r"a\.csv: 199 samples were given"):
        drive.identify(given(file), Options())


def test_an_eccentric_load_is_told_as_people_know_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """0.5 N m = |(0.3, -0.4)|, hanging at atan2(0.4, 0.3); the machine's 0 is the lowest place."""
    seen: list[dict[str, Any]] = []

    def fake(t: Any, u: Any, x: Any, **rest: Any) -> DriveFit:
        seen.append(rest)
        return fit(HUNG, HUNG_NAMES, HUNG_STD, rest["gain"])

    monkeypatch.setattr(identify, "drive", fake)
    file = table(tmp_path / "a.csv", "t_s,u_V,x_deg", T, np.cos(20.0 * T), X * 180.0 / math.pi)
    made = drive.identify(given(file), Options(gain=2.0, eccentric=True))
    assert seen[0]["eccentric"]
    assert made.title.endswith("- F0 - unbalance sin(x - hangs)")
    lines = facts(made.lines)
    assert list(lines) == ["mass", "unbalance", "hangs"]
    assert lines["unbalance"][1] == pytest.approx(0.5) and lines["unbalance"].unit == "N*m"
    # (0.6 * 0.01, 0.8 * 0.02) and (0.8 * 0.01, 0.6 * 0.02) / 0.5
    assert lines["unbalance"][2] == pytest.approx(math.hypot(0.006, 0.016))
    assert lines["hangs"][1] == pytest.approx(math.atan2(0.4, 0.3)) and lines["hangs"].unit == "rad"
    assert lines["hangs"][2] == pytest.approx(math.hypot(0.008, 0.012) / 0.5)
    assert lines["unbalance"].note.startswith("gravity's greatest torque; inverse dynamics 1.00")
    assert "unbalance = 0.5 +- 0.017 N*m" in made.toml
    load = tomllib.loads(made.toml)["load"]
    assert si(load["unbalance"]) == pytest.approx(0.5)
    assert si(load["hangs"]) == pytest.approx(math.atan2(0.4, 0.3) - X.min())


@pytest.mark.parametrize(
    ("header", "asked_for", "taken"),
    [("t_s,u_V,x_deg", False, None), ("t_s,u_V,x_deg", True, True), ("t_s,u_V,x_m", False, False)],
)
def test_an_angle_may_hide_an_eccentric_load(
    tmp_path: Path,
    asked: list[dict[str, Any]],
    header: str,
    asked_for: bool,
    taken: bool | None,
) -> None:
    """None: it is looked for, and a warning says where it shows."""
    file = table(tmp_path / "a.csv", header, T, np.cos(20.0 * T), X)
    drive.identify(given(file), Options(eccentric=asked_for))
    assert asked[0]["eccentric"] is taken


@pytest.mark.parametrize("name", ["eccentric", "endless"])
@pytest.mark.parametrize(
    ("header", "change", "found", "accepted"),
    [
        ("t_s,u_V,x_m", {}, "x is m", "an angle in rad or deg, such as --columns x=angle:deg"),
        ("t,u,x", {}, "x is unknown", "an angle in rad or deg"),
        ("t_s,u_V,x_deg", {"structure": "lugre"}, "combined", "--structure lugre"),
    ],
)
def test_an_eccentric_load_is_one_that_turns(
    tmp_path: Path, name: str, header: str, change: dict[str, Any], found: str, accepted: str
) -> None:
    file = table(tmp_path / "a.csv", header, T, np.cos(20.0 * T), X)
    with pytest.raises(InputError) as error:
        drive.identify(given(file), Options(**{name: True}, **change))
    assert error.value.where == f"--{name}"
    assert found in str(error.value) and accepted in str(error.value)
