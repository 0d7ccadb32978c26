"""`identify drive`: what it asks the fit for, and what follows from the fit."""

from __future__ import annotations

import dataclasses
import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.identify.kinds.seen import facts, given, mat, plots, table

from macromicro import identify, settings
from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.axis import Axis
from macromicro.identify.axis_fit import DriveFit
from macromicro.identify.axis_inverse import Estimate
from macromicro.identify.kinds import drive
from macromicro.identify.kinds.drive import Options
from macromicro.identify.runs import Run
from macromicro.place import LENGTH
from macromicro.schema.par import changed

N, DT = 200, 0.002
T = np.arange(N) * DT
X = 0.25 + 0.1 * np.sin(20.0 * T)


def fit(
    axis: Axis, names: tuple[str, ...], std: tuple[float, ...], gain: float = 1.0, delay: int = 0
) -> DriveFit:
    """A fit with these errors; inverse dynamics found twice the values, in the opposite order."""
    other = axis._replace(**{n: 2.0 * getattr(axis, n) for n in names})
    spread = np.array(std) ** 2
    inverse = Estimate(other, names[::-1], np.diag(4.0 * spread[::-1]), 0.3, 7.5)
    refined = Estimate(axis, names, np.diag(spread), 0.0125, 4.25)
    holdout = {"viscous": 0.5, "coulomb": 0.25}
    free, rest = (X + 1.0,), (0.01 * np.sin(3.0 * T),)
    return DriveFit(
        "coulomb", inverse, refined, holdout, 0.02, ((0.0, 0.0),), free, rest, gain, delay
    )


AXIS = Axis(mass=1.5, viscous=12.0, coulomb=3.0)
NAMES, STD = ("mass", "viscous", "coulomb"), (0.1, 0.5, math.nan)


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
    assert lines["viscous"][1:] == (
        12.0, 0.5, "V*s/m", "viscous friction; inverse dynamics 24.0 +- 1.0",
    )  # fmt: skip
    assert lines["coulomb"].note == "Coulomb friction; inverse dynamics 6"
    assert lines["coulomb"].unit == "V"
    said = dict(made.remarks)
    assert said["fit"] == "free run 95.75 %, RMS 0.0125 m over 400 samples"
    assert said["on data that was not fitted to"] == "RMS 0.02 m"
    assert said["force, inverse dynamics"] == "error 7.50 %"
    assert said["structure"] == "force error on held-out data: coulomb 0.25, taken"
    assert "gain" not in said and "delay" not in said
    assert (made.data["gain"], made.data["delay"], made.data["rms"]) == (1.0, 0, 0.0125)
    assert made.data["inverse"] == {"coulomb": 6.0, "viscous": 24.0, "mass": 3.0}
    assert made.data["inverse_std"]["mass"] == pytest.approx(0.2)
    assert made.data["fit_percent"] == 95.75 and made.data["holdout_rms"] == 0.02
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
        "none is named for u and x: parameters in those of the columns"
    )
    gained = drive.identify(given(none), Options(gain=2.0))
    assert {line.unit for line in facts(gained.lines).values()} == {""}
    assert dict(gained.remarks)["units"].startswith("none is named for u and x")
    assert dict(made.remarks)["fit"].endswith("RMS 0.0125 x over 200 samples")
    assert Options() == (None, "auto", None, None, (), False, False, False, None, False)


@pytest.mark.parametrize("limit", [0.0, -1.0, math.nan])
def test_a_limit_is_above_zero(limit: float) -> None:
    with pytest.raises(InputError, match=r"--limit: .*; accepted: a value above zero"):
        drive.identify(given(), Options(limit=limit))


def test_two_hundred_samples_are_needed(tmp_path: Path, asked: list[dict[str, Any]]) -> None:
    file = table(tmp_path / "a.csv", "t_s,u_V,x_m", T[:199], T[:199], X[:199])
    with pytest.raises(InputError, match=r"a\.csv: '199 samples'; accepted: 200 samples or more"):
        drive.identify(given(file), Options())


@pytest.mark.parametrize(
    ("force", "x", "mass", "slope", "speed"),
    [
        ("N", "m", "kg", "N*s/m", "m/s"),
        ("V", "m", "V*s^2/m", "V*s/m", "m/s"),
        ("N", "rad", "N*s^2/rad", "N*s/rad", "rad/s"),
        ("V", "counts", "V*s^2/counts", "V*s/counts", "counts/s"),
    ],
)
def test_units_of_the_parameters(force: str, x: str, mass: str, slope: str, speed: str) -> None:
    assert drive.units_of(force, x) == {
        "mass": mass, "viscous": slope, "coulomb": force, "offset": force,
        "asymmetry": slope, "stribeck": force, "stribeck_speed": speed,
        "unbalance": force, "hangs": x,
    }  # fmt: skip


HUNG = Axis(mass=0.01, viscous=0.1, coulomb=0.05, sine=0.3, cosine=-0.4)
HUNG_NAMES, HUNG_STD = ("mass", "sine", "cosine"), (0.001, 0.01, 0.02)


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
    ("header", "change", "found", "accepted"),
    [
        ("t_s,u_V,x_m", {}, "x in m", "a position in rad or deg, such as --columns x=angle:deg"),
        ("t,u,x", {}, "x in no unit", "a position in rad or deg"),
        ("t_s,u_V,x_deg", {"structure": "lugre"}, "lugre", "no elastic friction beside it"),
        ("t_s,u_V,x_deg", {"spring": True}, "with one of these", "no spring, dead zone, speeds"),
        ("t_s,u_V,x_deg", {"dead_zone": True}, "with one of these", "no spring, dead zone"),
    ],
)
def test_an_eccentric_load_is_one_that_turns(
    tmp_path: Path, header: str, change: dict[str, Any], found: str, accepted: str
) -> None:
    file = table(tmp_path / "a.csv", header, T, np.cos(20.0 * T), X)
    with pytest.raises(InputError) as error:
        drive.identify(given(file), Options(eccentric=True, **change))
    assert error.value.where == "--eccentric"
    assert found in str(error.value) and accepted in str(error.value)


def test_the_structure_in_words() -> None:
    one = dataclasses.replace(fit(AXIS, NAMES, STD), holdout={}, structure="full")
    assert drive.structure(one) == "full, as given"
    why = {"viscous": "coulomb is better", "full": "a mass or friction below 0"}
    many = dataclasses.replace(one, holdout={"viscous": 0.5, "coulomb": 0.25}, reasons=why)
    assert drive.structure(dataclasses.replace(many, structure="coulomb")) == (
        "force error on held-out data: coulomb 0.25, taken; viscous 0.5: coulomb is better; "
        "full: a mass or friction below 0"
    )


def runs(*parts: tuple[Array, Array]) -> list[Run]:
    return [Run(np.arange(len(x)) * DT, u, x) for u, x in parts]


def test_settings_by_the_units() -> None:
    records = runs((np.ones(3), np.array([0.0, 0.1, 0.3])))

    def kind(force: str, x: str) -> str:
        units = drive.units_of(force, x)
        return drive.settings(fit(AXIS, NAMES, STD), records, force, x, units)

    for force in ("V", "N"):
        assert tomllib.loads(kind(force, "m"))["machine"] == "axis"
    for force in ("V", "N*m"):
        assert tomllib.loads(kind(force, "rad"))["machine"] == "rotary"
    for force, x in (("N", "counts"), ("N", "rad"), ("N*m", "m"), ("A", "m"), ("u", "x")):
        text = kind(force, x)
        assert text.startswith(
            "# A motor-driven axis: parameters by output error, for other programs.\n"
            "# Not for `macromicro run --config`: the bench is another axis.\n"
        )
        assert tomllib.loads(text) == {"axis": {"mass": 1.5, "viscous": 12.0, "coulomb": 3.0}}
        assert f"viscous = 12.0  # {force}*s/{x}, +- 0.5\n" in text


def si(text: str) -> float:
    return float(text.split(maxsplit=1)[0])


def test_the_machine_of_a_drive_in_metres() -> None:
    # Ten metres: steps of 5 nm, within a billionth of that, are rounding; the count is 0.1 mm.
    x = np.array([-2.0, -2.0 + 5e-9, -1.9999, 0.0, 1.0])
    other = np.array([3.0, 8.0, 8.0, 7.9998])
    records = runs((np.array([1.0, -4.5, 0.0, 2.0, 1.0]), x), (np.full(4, -3.0), other))
    axis = AXIS._replace(lag=0.001)
    units = drive.units_of("N", "m")
    errors = dict(zip(NAMES, STD, strict=True))
    text = drive.machine(fit(axis, NAMES, STD, 4.0, 3), records, units, errors, LENGTH)
    made = tomllib.loads(text)
    assert si(made["encoder"]["pitch"]) == pytest.approx(1e-4)
    assert si(made["travel"]["high"]) == pytest.approx(10.0) and si(made["travel"]["low"]) == 0.0
    assert si(made["amplifier"]["full_scale"]) == 4.5
    assert si(made["timing"]["period"]) == DT
    # Ten times as fast as 5 m in a sample.
    assert si(made["encoder"]["rate"]) == pytest.approx(10.0 * (5.0 / DT) / 1e-4)
    # 12 N s/m at 4 N/V: 3 N/A on 0.75 ohm. Three samples and 1 ms late: a period, and 5 ms.
    assert si(made["motor"]["force"]) == 3.0 and si(made["load"]["mass"]) == 1.5
    assert si(made["timing"]["delay"]) == DT
    assert si(made["motor"]["inductance"]) == pytest.approx(0.75 * 0.005)
    head = [line.removeprefix("# ") for line in text.splitlines() if line.startswith("#")]
    assert head[:2] == [
        "A motor-driven axis as a machine: macromicro run --config model.toml",
        "Its 0 mm is the lowest position in the records, its largest effort the largest there.",
    ]
    assert head[2:] == [
        "#", "As found, by output error, with standard errors:",
        "  mass = 1.5 +- 0.1 kg", "  viscous = 12 +- 0.5 N*s/m", "  coulomb = 3 N",
    ]  # fmt: skip
    units = drive.units_of("V", "m")
    text = drive.machine(fit(axis, NAMES, STD, 1.0, 0), records[:1], units, errors, LENGTH)
    assert "\n# No gain was known: 1 N below stands for one unit of the effort.\n" in text
    assert si(tomllib.loads(text)["travel"]["high"]) == pytest.approx(3.0)


# Of the nominal motor and amplifier: N per A at the belt, ohm, N per V at the D/A, m per count.
PULL, OHM, DUTY = 0.06484 / 4e-3, 15.0, 0.8
G = PULL * (20.0 * DUTY / 5.0) / OHM
PITCH = settings.Settings().sensors.encoder.pitch
BACK = PULL**2 / OHM  # N s/m
FULL = (*NAMES, "stribeck", "stribeck_speed")
FULL_STD = (0.01 * PITCH / G, 0.2 * PITCH / G, 0.1 / G, 0.3 / G, 1.0)


@pytest.fixture
def weaker(monkeypatch: pytest.MonkeyPatch) -> None:
    """An amplifier that passes 0.8 of its supply on."""
    made = changed(settings.Settings(), {"bench.amplifier.motor_duty": DUTY})
    monkeypatch.setattr(settings, "Settings", lambda: made)


def carriage(**changes: float) -> Axis:
    """0.5 kg, 8 N, 0.5 N s/m and 2 N of breakaway below 0.03 m/s, in counts and volts."""
    axis = Axis(0.5 * PITCH / G, (0.5 + BACK) * PITCH / G, 8.0 / G, 0.0, 0.0, 2.0 / G, 0.03 / PITCH)
    return axis._replace(**changes)


@pytest.mark.usefixtures("weaker")
def test_the_bench_of_a_drive_in_counts_and_volts() -> None:
    units = drive.units_of("V", "counts")
    text = drive.settings(fit(carriage(), FULL, FULL_STD), [], "V", "counts", units)
    assert tomllib.loads(text) == {
        "bench": {
            "carriage": {"mass": "500 g"},
            "friction": {
                "coulomb": "8 N", "viscous": "0.5 N*s/m", "stribeck": "2 N",
                "stribeck_speed": "30 mm/s",
            },
        }
    }  # fmt: skip
    assert text.startswith(
        "# Settings of the virtual bench that follow from a drive in counts and volts, with its\n"
        f"# motor and amplifier as they are ({G:.4g} N at the belt for a volt at the D/A board).\n"
        "# Use: macromicro run --config model.toml\n\n"
    )
    for line in (
        "# +- 10 g", "# +- 0.1 N", "# +- 0.2 N*s/m, back-EMF taken off", "# +- 0.3 N", "# with it",
    ):  # fmt: skip
        assert f"{line}\n" in text


@pytest.mark.usefixtures("weaker")
def test_what_does_not_show_is_left_out_of_the_bench() -> None:
    errors = dict(zip(FULL, FULL_STD, strict=True))

    def made(axis: Axis, errors: dict[str, float]) -> tuple[dict[str, Any], str]:
        text = drive.bench(fit(axis, FULL, FULL_STD), errors)
        return tomllib.loads(text)["bench"], text

    small, _ = made(carriage(coulomb=0.8 / G), errors)
    assert small["friction"]["coulomb"] == "0.8 N"
    none, _ = made(carriage(coulomb=0.0), errors)
    assert "coulomb" not in none["friction"]
    light, text = made(carriage(viscous=0.25 * BACK * PITCH / G), errors)
    assert "viscous" not in light["friction"]
    lost = f"{-0.75 * BACK:.3g}"
    assert f"# Viscous friction would be {lost} N*s/m without back-EMF: left out.\n" in text
    known = {n: errors[n] for n in NAMES}
    assert set(made(carriage(), known)[0]["friction"]) == {"coulomb", "viscous"}
    for error, shown in ((1.1, False), (0.9, True)):  # twice it is more, or less, than 2 N
        friction = made(carriage(), {**errors, "stribeck": error / G})[0]["friction"]
        assert ("stribeck" in friction, "stribeck_speed" in friction) == (shown, shown)


@pytest.mark.usefixtures("weaker")
def test_what_the_bench_refuses_is_written_as_it_is() -> None:
    errors = dict(zip(FULL, FULL_STD, strict=True))
    text = drive.bench(fit(carriage(mass=-1.0), FULL, FULL_STD), errors)
    assert text.startswith("# The bench refuses these: model.toml, bench.carriage.mass: '-")
    made = tomllib.loads(text)
    assert list(made) == ["axis"] and list(made["axis"]) == list(FULL)
    assert made["axis"]["mass"] == -1.0
    assert made["axis"]["coulomb"] == pytest.approx(8.0 / G, rel=1e-6)
