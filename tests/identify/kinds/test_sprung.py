"""`identify drive` with --spring, --dead-zone, --free, or speeds: files, units, table, tests."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from tests.identify.kinds.seen import facts, given, plots, table

from macromicro.errors import InputError
from macromicro.identify.kinds import drive
from macromicro.identify.kinds.drive import Options
from macromicro.models.mass import Axis, motion

DT = 1e-3
DRIVE = Axis(mass=2.0, viscous=5.0, coulomb=3.0, offset=1.0, spring=400.0, dead_zone=4.0)
DECAY = Axis(mass=1.0, viscous=1.2, coulomb=0.05, offset=0.3, spring=(2 * math.pi * 18.0) ** 2)
T = np.arange(3000) * DT


def driven(tmp_path: Path) -> Path:
    """Position and speed beside each other, in mm and mm/s; 3 N/V."""
    random = np.random.default_rng(1)
    u = np.repeat(random.uniform(-10.0, 10.0, 30), 100)
    x, v = motion(DRIVE, 3.0 * u, DT)
    x, v = x + 1e-5 * random.standard_normal(3000), v + 1e-3 * random.standard_normal(3000)
    return table(tmp_path / "own.csv", "t_s,u_V,x_mm,speed [mm/s]", T, u, 1e3 * x, 1e3 * v)


def decay(path: Path, at: float, seed: int) -> Path:
    noise = 1e-6 * np.random.default_rng(seed).standard_normal(3000)
    return table(path, "t_s,x_mm", T, 1e3 * (motion(DECAY, 0.0 * T, DT, at)[0] + noise))


def test_a_spring_and_a_dead_zone(tmp_path: Path) -> None:
    options = Options(gain=3.0, spring=True, dead_zone=True, structure="coulomb")
    made = drive.identify(given(driven(tmp_path)), options)
    lines = facts(made.lines)
    assert list(lines) == [
        "frequency", "damping", "mass", "viscous", "coulomb", "rest", "spring", "dead_zone",
    ]  # fmt: skip
    units = [line.unit for line in made.lines]
    assert units == ["Hz", "", "kg", "N*s/m", "N", "m", "N/m", "V"]
    truth = [DRIVE.frequency, DRIVE.damping, 2.0, 5.0, 3.0, -1.0 / 400.0, 400.0, 4.0 / 3.0]
    for line, true in zip(made.lines, truth, strict=True):
        assert abs(line.value - true) < 4.0 * line.error < 0.05 * abs(true), line.name
    told = tomllib.loads(made.toml)["drive"]
    assert told["spring"] == pytest.approx(lines["spring"].value, rel=1e-6)
    assert dict(made.remarks)["structure"] == "coulomb, as given"
    assert made.data["gain"] == 3.0 and made.data["spring"] and made.data["dead_zone"]


def test_a_speed_is_taken_where_it_is_named_or_the_only_one(tmp_path: Path) -> None:
    options = Options(gain=3.0, spring=True, structure="coulomb")
    made = drive.identify(given(driven(tmp_path), v="speed"), options)
    assert "rest" not in facts(made.lines)
    assert plots(made.draw()["free_run"])[0].y == "speed [m/s]"
    own = driven(tmp_path)
    t, u, _, v = np.loadtxt(own, delimiter=",", skiprows=1).T
    alone = table(tmp_path / "speeds.csv", "t_s,u_V,speed_mm_per_s", t, u, v)
    lines = facts(drive.identify(given(alone), Options(gain=3.0, structure="coulomb")).lines)
    assert list(lines) == ["mass", "viscous", "coulomb", "offset"]
    assert [line.unit for line in lines.values()] == ["kg", "N*s/m", "N", "N"]


def test_a_decay_per_mass_and_a_record_that_was_not_fitted(tmp_path: Path) -> None:
    files = [decay(tmp_path / f"{k}.csv", k * 1e-3, k) for k in (1, 2, 3)]
    options = Options(free=True, spring=True, tests=(str(files[2]),))
    made = drive.identify(given(*files[:2]), options)
    lines = facts(made.lines)
    assert lines["frequency"].value == pytest.approx(18.0, rel=2e-3)
    assert lines["spring"].unit == "1/s^2" and lines["coulomb"].unit == "m/s^2"
    assert lines["rest"].value == pytest.approx(-0.3 / DECAY.spring, rel=0.01)
    assert lines["test"].value > 99.0 and "3.csv" in lines["test"].note
    assert made.data["structure"] == "coulomb" and len(made.data["starts"]) == 2
    remarks = dict(made.remarks)
    assert "viscous" in remarks["structure"] and "coulomb" in remarks["structure"]
    assert "per mass" in remarks["free motion"]
    assert set(tomllib.loads(made.toml)) == {"free"}


def test_refused(tmp_path: Path) -> None:
    own = decay(tmp_path / "d.csv", 1e-3, 1)
    with pytest.raises(InputError, match="--free"):
        drive.identify(given(own), Options())
    with pytest.raises(InputError, match="--limit"):
        drive.identify(given(own), Options(free=True, spring=True, limit=3.0))
    with pytest.raises(InputError, match="--delay"):
        drive.identify(given(own), Options(free=True, spring=True, delay="fit"))
    with pytest.raises(InputError, match="--eccentric"):
        drive.identify(given(driven(tmp_path)), Options(spring=True, eccentric=True))
    with pytest.raises(InputError, match="--free"):
        drive.identify(given(driven(tmp_path), u="u_V"), Options(free=True))
    with pytest.raises(InputError, match="delay"):
        drive.identify(given(driven(tmp_path)), Options(spring=True, delay=-1))
