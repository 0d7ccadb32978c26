"""The files of `identify drive`: machine, bench, plain values."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import pytest
from tests.identify.kinds.fits import AXIS, DT, HUNG, HUNG_NAMES, HUNG_STD, NAMES, STD, fit, si

from macromicro import settings
from macromicro.arrays import Array
from macromicro.identify.kinds import drive_report
from macromicro.identify.runs import Run
from macromicro.models.mass import Axis
from macromicro.place import LENGTH
from macromicro.schema.par import changed


def runs(*parts: tuple[Array, Array]) -> list[Run]:
    return [Run(np.arange(len(x)) * DT, u, x) for u, x in parts]


def test_settings_by_the_units() -> None:
    records = runs((np.ones(3), np.array([0.0, 0.1, 0.3])))

    def kind(force: str, x: str, *, endless: bool = False) -> str:
        units = drive_report.units_of(force, x)
        return drive_report.settings(fit(AXIS, NAMES, STD), records, force, x, units, endless)

    for force in ("V", "N"):
        assert tomllib.loads(kind(force, "m"))["machine"] == "axis"
    for force in ("V", "N*m"):
        assert tomllib.loads(kind(force, "rad"))["machine"] == "rotary"
        assert "stop_low" in kind(force, "rad")
        load = tomllib.loads(kind(force, "rad", endless=True))["load"]
        assert load["ends"] == "none" and not any("stop" in name for name in load)
    for force, x in (("N", "counts"), ("N", "rad"), ("N*m", "m"), ("A", "m"), ("u", "x")):
        text = kind(force, x)
        assert text.startswith(
            "# A motor-driven axis: parameters for other programs.\n"
            "# Not for `macromicro run --config`: the bench is another axis.\n"
        )
        assert tomllib.loads(text) == {"axis": {"mass": 1.5, "viscous": 12.0, "coulomb": 3.0}}
        assert f"viscous = 12.0  # {force}*s/{x}, +- 0.5\n" in text


def test_an_eccentric_load_in_units_without_a_machine_is_unbalance_and_angle() -> None:
    units = drive_report.units_of("u", "rad")
    text = drive_report.settings(fit(HUNG, HUNG_NAMES, HUNG_STD), [], "u", "rad", units)
    found = tomllib.loads(text)["axis"]
    assert found["unbalance"] == pytest.approx(0.5)
    assert found["hangs"] == pytest.approx(np.arctan2(0.4, 0.3)) and "sine" not in found


def test_the_machine_of_a_drive_in_metres() -> None:
    # Ten metres: steps of 5 nm, within a billionth of that, are rounding; the count is 0.1 mm.
    x = np.array([-2.0, -2.0 + 5e-9, -1.9999, 0.0, 1.0])
    other = np.array([3.0, 8.0, 8.0, 7.9998])
    records = runs((np.array([1.0, -4.5, 0.0, 2.0, 1.0]), x), (np.full(4, -3.0), other))
    axis = AXIS._replace(lag=0.001)
    units = drive_report.units_of("N", "m")
    errors = dict(zip(NAMES, STD, strict=True))
    text = drive_report.machine(fit(axis, NAMES, STD, 4.0, 3), records, units, errors, LENGTH)
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
        "Its 0 mm is the lowest position in the records, "
        "its effort limit the largest effort there.",
    ]
    assert head[2:] == [
        "#", "Identified by output error, with standard errors:",
        "  mass = 1.5 +- 0.1 kg", "  viscous = 12 +- 0.5 N*s/m", "  coulomb = 3 N",
    ]  # fmt: skip
    units = drive_report.units_of("V", "m")
    text = drive_report.machine(fit(axis, NAMES, STD, 1.0, 0), records[:1], units, errors, LENGTH)
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
    units = drive_report.units_of("V", "counts")
    text = drive_report.settings(fit(carriage(), FULL, FULL_STD), [], "V", "counts", units)
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
        text = drive_report.bench(fit(axis, FULL, FULL_STD), errors)
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
    text = drive_report.bench(fit(carriage(mass=-1.0), FULL, FULL_STD), errors)
    assert text.startswith("# The bench refuses these: model.toml, bench.carriage.mass: '-")
    made = tomllib.loads(text)
    assert list(made) == ["axis"] and list(made["axis"]) == list(FULL)
    assert made["axis"]["mass"] == -1.0
    assert made["axis"]["coulomb"] == pytest.approx(8.0 / G, rel=1e-6)
