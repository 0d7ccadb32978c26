"""`macromicro look` is right or silent: wraps, saturation, and commands that run as printed."""

from __future__ import annotations

import json
import shlex
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from macromicro import cli
from macromicro.hysteresis import prandtl
from macromicro.identify.look import find_saturation, find_wraps, look
from macromicro.models.mass import Axis, simulate
from tests.identify.kinds.test_stress_map import loop

RNG = np.random.default_rng(5)
N = 2000
T = 1e-3 * np.arange(N)
NOISE = RNG.standard_normal(N)
SQUARE = np.sign(np.sin(2.0 * np.pi * 3.0 * T))
SAW = 2.0 * (3.0 * T % 1.0) - 1.0
STAIRS = np.repeat(RNG.uniform(-1.0, 1.0, 20), 100)
UNLIKE = {
    "square": SQUARE,
    "square, noise": SQUARE + 0.02 * NOISE,
    "square of 360": 180.0 * SQUARE + 0.5 * NOISE,
    "sawtooth": SAW,
    "sawtooth, noise": SAW + 0.01 * NOISE,
    "codes": np.round(2000.0 + 1000.0 * SAW),
    "stairs": STAIRS,
    "stairs, noise": STAIRS + 0.01 * NOISE,
    "spikes": 0.1 * np.sin(9.0 * T) + 3.0 * (RNG.random(N) < 0.003),
    "pulses": 1.0 * (RNG.random(N) < 0.005),
    "telegraph": np.repeat(RNG.choice([-1.0, 1.0], 100), 20),
    "discharges": np.exp(-20.0 * (T % 0.3)),
    "oscillator": np.abs(SAW) ** 0.3 * np.sign(SAW),
    "two ramps": 7.0 * np.r_[T[:1000], T[:1000]],
    "there and back": np.r_[np.linspace(0, 1, 900), np.zeros(200), np.linspace(0, 1, 900)],
    "cycles": np.floor(T / 0.1) % 7.0,
    "noise": NOISE,
}


@pytest.mark.parametrize("name", UNLIKE)
@pytest.mark.parametrize("unit", ["", "deg", "counts", "V", "mm"])
def test_these_neither_wrap_nor_saturate(name: str, unit: str) -> None:
    assert find_wraps(UNLIKE[name], unit) == [] and find_saturation(UNLIKE[name]) == []


@given(
    st.sampled_from([("deg", 360.0), ("rad", 2.0 * np.pi), ("counts", 4096.0), ("", 65536.0)]),
    st.floats(0.5, 40.0), st.floats(0.0, 0.9), st.booleans(), st.floats(0.0, 1.0),
)  # fmt: skip
@settings(max_examples=60, deadline=None)
def test_a_turn_that_is_passed_is_named(
    kind: tuple[str, float], speed: float, sway: float, down: bool, begin: float
) -> None:
    """In one direction at a speed that changes, by angles and counters."""
    unit, turn = kind
    place = turn * (begin + 2.2 * speed * (T + 0.02 * sway * np.sin(30.0 * T)))
    values = (-place if down else place) % turn
    values = np.floor(values) if unit in ("", "counts") else values
    jumps = int((np.abs(np.diff(values)) > 0.5 * turn).sum())
    found = find_wraps(values, unit)
    ends = np.abs(np.diff(values))[[*range(8), *range(-8, 0)]].max() > 0.5 * turn
    # A steady step that divides the turn may never come near both of its ends.
    unsure = ends or jumps == 0 or np.ptp(values) < 0.98 * turn
    assert (not found and unsure) or found[0].startswith(f"wraps {jumps} time")
    assert not found or f" at {turn:g}," in found[0]


def test_to_and_fro_across_an_end_and_a_counter_of_another_size() -> None:
    place = 900.0 * np.sin(6.0 * T) + 0.05 * NOISE
    assert find_wraps((place + 180.0) % 360.0 - 180.0, "deg")[0].endswith("row 35")
    assert " at 4000," in find_wraps(np.floor(3e4 * T) % 4000.0, "")[0]
    assert find_wraps(np.floor(3e4 * T) % 4000.0, "um") == []


def test_a_clipped_measurement_is_saturated_and_a_planned_trapezoid_is_not() -> None:
    swing = 2.0 * np.sin(9.0 * T)
    assert "stay at 1.6: saturated" in find_saturation(np.minimum(swing + 0.01 * NOISE, 1.6))[0]
    assert (
        find_saturation(np.clip(np.abs(2e-3 * (np.arange(N) % 1000 - 500.0)) - 0.1, 0.0, 0.6)) == []
    )


def csv(path: Path, **columns: np.ndarray) -> Path:
    rows = np.column_stack([np.asarray(column, np.float64) for column in columns.values()])
    head = ",".join(columns)
    np.savetxt(path, rows, delimiter=",", header=head, comments="", fmt="%.12g")
    return path


def axis(n: int = 1500) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    t = 0.005 * np.arange(n)
    u = 2.0 * np.sign(np.sin(2.0 * np.pi * 0.7 * t)) + np.sin(2.0 * np.pi * 0.31 * t)
    x = simulate(Axis(mass=0.05, viscous=0.4, coulomb=0.5), u, 0.005)
    return t, u, x + 1e-5 * np.random.default_rng(1).normal(size=n)


def of_names(place: Path) -> Path:
    t, u, x = axis()
    return csv(place / "a file.csv", t_ms=1e3 * t, u_V=u, x_mm=1e3 * x, extra=SQUARE[: len(t)])


def without_units(place: Path) -> Path:
    t, u, x = axis()
    return csv(place / "a.csv", t=t, u=u, x=x)


def of_units(place: Path) -> Path:
    t, u, x = axis()
    return csv(place / "b.csv", **{"when [s]": t, "drive (V)": u, "weg [um]": 1e6 * x})


def of_matlab(place: Path) -> Path:
    t, u, x = axis()
    savemat(place / "a.mat", {"log": {"time": t, "voltage": u, "position": x}})
    return place / "a.mat"


def of_json(place: Path) -> Path:
    t, u, x = axis()
    rows = [{"t_s": t[k], "u_N": u[k], "x_m": x[k]} for k in range(len(t))]
    (place / "a.json").write_text(json.dumps(rows))
    return place / "a.json"


def of_a_header(place: Path) -> Path:
    _, u, x = axis()
    path = csv(place / "a.csv", u_V=u, x_rad=x)
    path.write_text("# sampling rate [Hz]: 200\n" + path.read_text())
    return path


def of_outputs(place: Path) -> Path:
    t, u, _ = axis(600)
    y = np.zeros(600)
    for k in range(1, 600):
        y[k] = 0.9 * y[k - 1] + 0.2 * u[k - 1]
    return csv(place / "a.csv", t_s=t, input=u, speed=y)


def of_a_heater(place: Path) -> Path:
    _, u, _ = axis(600)
    temperature = np.full(600, 20.0)
    for k in range(1, 600):
        temperature[k] = 20.0 + 0.95 * (temperature[k - 1] - 20.0) + 0.1 * u[k - 1]
    return csv(place / "a.csv", **{"t_s": 5.0 * np.arange(600), "u_%": u, "T_degC": temperature})


def of_plays(place: Path) -> Path:
    u = 50.0 - 50.0 * np.cos(np.linspace(0.0, 20.0, 801))
    p = prandtl.operator([0.0, 12.5, 25.0, 37.5], [2.0, 0.5, 0.3, 0.2])
    return csv(place / "a.csv", input_V=u, output_um=prandtl.run(p, u))


def of_curves(place: Path) -> Path:
    rows = []
    for k, top in enumerate((2.0, 4.0, 6.0, 8.0)):
        u = np.linspace(top, 0.0, 20)
        rows.append(np.column_stack([np.full(20, k), u, 0.1 * u**2 + 0.05 * u * (top - u)]))
    curve, u, f = np.vstack(rows).T
    return csv(place / "a.csv", curve=curve, u_V=u, f_um=f)


def of_a_sensor(place: Path) -> Path:
    v = np.concatenate([np.linspace(0.5, 4.5, 400), np.linspace(4.5, 0.5, 400)])
    return csv(place / "a.csv", sensor_V=v, x_mm=0.8 * (v - 1.0), run=np.repeat([0.0, 1.0], 400))


def of_loads(place: Path) -> Path:
    parts = [(*loop(s, 0.002, int(s)), np.full(3000, s)) for s in (50.0, 100.0, 200.0)]
    columns = (np.concatenate(each) for each in zip(*parts, strict=True))
    return csv(place / "a.csv", **dict(zip(("T_degC", "strain", "load_MPa"), columns, strict=True)))


MADE: dict[str, Callable[[Path], Path]] = {
    "drive": of_names, "drive, bare": without_units, "drive, units": of_units,
    "drive, matlab": of_matlab, "drive, json": of_json, "drive, header": of_a_header,
    "linear": of_outputs, "linear, heater": of_a_heater, "plays": of_plays,
    "hysteresis": of_curves, "hall": of_a_sensor, "stress": of_loads,
}  # fmt: skip


def runs(command: str) -> int:
    words = shlex.split(command)
    assert words[:2] == ["macromicro", "identify"]
    with pytest.MonkeyPatch.context() as patch, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        patch.setattr(sys, "argv", words)
        return cli.main()


@pytest.mark.parametrize("name", MADE)
def test_the_command_runs_as_printed(name: str, tmp_path: Path) -> None:
    found = look(MADE[name](tmp_path)).onward
    assert found.command.split()[2] == name.partition(",")[0] and not found.template
    assert runs(found.command) == 0


@pytest.mark.slow
def test_curves_of_a_magnetometer(tmp_path: Path) -> None:
    whole = Path(__file__).parents[2] / "examples/data/forc/hchb_forc"
    assert look(whole).onward.command == f"macromicro identify hysteresis {whole}"
    text = whole.read_text().split("\n\n")
    few = tmp_path / "few.frc"  # every tenth curve with its calibration
    body = [part for k in range(4, len(text) - 2, 20) for part in text[k : k + 2]]
    few.write_text("\n\n".join([*text[:4], *body, "MicroMag Data File ends\n"]))
    assert runs(look(few).onward.command) == 0


@pytest.mark.parametrize(
    "columns",
    [
        {"t_s": T, "T_degC": 20.0 + 0.01 * NOISE},
        {"t_s": T, "u_V": SQUARE, "x_mm": np.zeros(N)},  # it does not move
        {"v_m/s": SQUARE, "x_mm": SAW},  # a speed is no sensor
        {"t": T, "b": SQUARE, "c": SAW},
    ],
)
def test_no_command_where_a_column_is_missing_or_doubtful(
    tmp_path: Path, columns: dict[str, np.ndarray]
) -> None:
    found = look(csv(tmp_path / "a.csv", **columns)).onward
    assert found.command == "" and ("?" in found.template or "HZ" in found.template)


def test_ten_rows_are_too_few(tmp_path: Path) -> None:
    found = look(csv(tmp_path / "a.csv", t_s=T[:10], u_V=T[:10], x_mm=T[:10])).onward
    assert (found.command, found.template) == ("", "") and "too few" in found.reasons[0]
