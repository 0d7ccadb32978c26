"""Records as people have them, by the commands: two clocks, wrong signs, decays that stick."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.identify import from_files
from macromicro.identify.kinds import fit
from macromicro.identify.notices import PoorFitWarning
from macromicro.identify.picking import picking
from macromicro.identify.result import Result
from macromicro.models.mass import Axis, motion, simulate

DT = 0.01


def written(file: Path, heading: str, *columns: np.ndarray) -> Path:
    np.savetxt(file, np.column_stack(columns), "%.9g", ",", header=heading, comments="")
    return file


def noise(n: int, size: float) -> np.ndarray:
    return size * np.random.default_rng(1).normal(size=n)


def values(found: Result) -> dict[str, float]:
    return {line.name: line.value for line in found.lines}


def test_files_with_a_clock_each_are_one_record(tmp_path: Path) -> None:
    """The input at 1 kHz, the position at 100 Hz: it is the input's mean over 10 ms that acts."""
    n, fine = 1000, 1e-3
    t = fine * np.arange(10 * n)
    u = 2.0 * np.sign(np.sin(2.0 * np.pi * 0.71 * t)) + np.sin(2.0 * np.pi * 0.3 * t)
    x = simulate(Axis(mass=0.5, viscous=1.0, coulomb=0.4), u, fine)
    files = [
        written(tmp_path / "u.csv", "t_s,u_N", t, u),
        written(tmp_path / "x.csv", "t_s,x_m", t[::10], x[::10] + noise(n, 1e-6)),
    ]
    what = picking([str(file) for file in files], [])._replace(join=True)
    found = values(fit("drive", what, structure="coulomb"))
    assert found["mass"] == pytest.approx(0.5, rel=0.02)
    assert found["coulomb"] == pytest.approx(0.4, rel=0.05)
    with pytest.raises(InputError, match=r"x.csv and .*x.csv: there is no column for u"):
        fit("drive", picking([str(files[1])] * 2, [])._replace(join=True))


def test_reversals_within_a_step_of_the_slower_clock_are_no_saturation(tmp_path: Path) -> None:
    """Means of both signs of a force are smaller than the force, which is not limited."""
    t = 1e-3 * np.arange(10_000)
    u = 2.0 * np.sign(np.sin(2.0 * np.pi * t / 3.0))  # 0 at first
    x = simulate(Axis(mass=0.5, viscous=4.0, coulomb=0.5), u, 1e-3)
    files = [
        written(tmp_path / "u.csv", "t_s,u_V", t, u),
        written(tmp_path / "x.csv", "t_s,x_m", t[::10], np.round(x[::10], 6)),
    ]
    with warnings.catch_warnings(record=True) as doubts:
        warnings.simplefilter("always")
        found = fit("drive", picking([str(file) for file in files], [])._replace(join=True))
    # A breakaway of 0.6 +- 1.8 V would lower the force error, which is 0.2 % of the force.
    assert found.data["structure"] == "coulomb"
    assert "stribeck exceeds" in found.data["reasons"]["stribeck"]
    assert values(found)["mass"] == pytest.approx(0.5, rel=0.01)
    assert not [w for w in doubts if "saturate" in str(w.message) or "extreme" in str(w.message)]


@pytest.mark.parametrize("spring", [0.0, 4.0])
def test_an_input_counted_the_other_way_round_is_named(tmp_path: Path, spring: float) -> None:
    t = DT * np.arange(1500)
    u = np.sign(np.sin(2.0 * np.pi * 0.23 * t)) + 0.5 * np.sin(2.0 * np.pi * 0.9 * t)
    true = Axis(mass=0.1, viscous=0.4, coulomb=0.05, spring=spring)
    x, v = motion(true, u, DT, 0.0, 0.0)
    heading, column = ("t_s,u_V,x_m", x) if spring else ("t_s,u_V,v_m/s", v)
    file = written(tmp_path / "a.csv", heading, t, -u, column + noise(len(t), 1e-5))
    pair = None if spring else {"v": "v_m/s"}
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # doubts about the wrong input would mislead
        with pytest.raises(InputError, match=r"u: its sign is opposite .* fits .* --gain -1"):
            from_files("drive", file, pair, spring=spring > 0.0, structure="coulomb")
    found = values(from_files("drive", file, pair, spring=spring > 0.0, gain=-1.0))
    assert found["mass"] == pytest.approx(0.1, rel=0.02)


@pytest.mark.slow
def test_a_hanging_arm_asks_for_eccentric(tmp_path: Path) -> None:
    """0.02 kg m^2 on a pendulum of 1.2 N m: gravity is most of the torque."""
    n, dt = 3000, 5e-3
    t, x, v = dt * np.arange(n), 0.0, 0.0
    u = 0.9 * np.sign(np.sin(2.0 * np.pi * 0.4 * t)) + 0.3 * np.sin(2.0 * np.pi * 1.7 * t)
    seen = []
    for one in u.tolist():
        seen.append(x)
        for _ in range(20):
            v += dt / 20.0 * (one - 0.05 * v - 1.2 * np.sin(x)) / 0.02
            x += dt / 20.0 * v
    file = written(tmp_path / "arm.csv", "t_s,u_N*m,x_rad", t, u, np.array(seen) + noise(n, 1e-4))
    with pytest.raises(InputError, match=r"eccentric load explains the record .* Add --eccentric"):
        from_files("drive", file)


def test_a_decay_that_stops_after_two_swings_shows_its_friction(tmp_path: Path) -> None:
    """2.3 Hz, 1.6 1/s and 0.4 m/s^2: where the mass stays is evidence."""
    true = Axis(mass=1.0, viscous=1.6, coulomb=0.4, spring=(2.0 * np.pi * 2.3) ** 2)
    files = []
    for k, begin in enumerate((0.012, -0.011)):
        x, _ = motion(true, np.zeros(500), 2e-3, begin, 0.0)
        rows = (2e-3 * np.arange(500), x + noise(500, 4e-7))
        files.append(written(tmp_path / f"{k}.csv", "t_s,x_m", *rows))
    found = from_files("drive", files, free=True, spring=True)
    assert values(found)["coulomb"] == pytest.approx(0.4, rel=0.02)
    assert values(found)["frequency"] == pytest.approx(2.3, rel=0.005)
    assert found.data["fit_percent"] > 99.0 and found.holds


def test_a_constant_of_the_output_is_found_with_the_parameters(tmp_path: Path) -> None:
    """A heater in a room of 21.6 degC; without the constant the fit is worse than its mean."""
    t = 5.0 * np.arange(400)
    u = 20.0 * (1.0 + np.sign(np.sin(2.0 * np.pi * t / 700.0)))
    y = [21.6]
    for one in u[:-1].tolist():
        y.append(y[-1] + 5.0 / 430.0 * (0.1 * one + 21.6 - y[-1]))
    file = written(tmp_path / "a.csv", "t_s,u_percent,y_degC", t, u, np.array(y))
    found = from_files("linear", file)
    assert values(found)["offset"] == pytest.approx(21.6, abs=0.05)
    assert values(found)["gain"] == pytest.approx(0.1, rel=0.02) and found.holds
    with pytest.warns(PoorFitWarning, match="farther from the record than a constant"):
        found = from_files("linear", file, offset=0.0)
    assert not found.holds


def cycles() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cycles from 0 to falling peaks and back of a loop with play, numbered."""
    rise = np.linspace(0.0, 1.0, 60)
    u = [top * np.r_[rise, rise[::-1]] for top in range(10, 3, -1)]
    drive = np.concatenate(u)
    made, f = [], 0.0
    for one in drive:
        f = min(max(f, one - 1.0), one + 1.0)
        made.append(f + 0.3 * one)
    return drive, np.array(made), np.repeat(np.arange(len(u)), 120)


def test_whole_cycles_numbered_as_curves_are_cut(tmp_path: Path) -> None:
    u, f, curve = cycles()
    named = from_files("hysteresis", written(tmp_path / "a.csv", "u,f,curve", u, f, curve))
    plain = from_files("hysteresis", written(tmp_path / "b.csv", "u,f", u, f))
    assert values(named) == values(plain)


def test_curves_of_a_test_begin_at_saturation_each(tmp_path: Path) -> None:
    u, f, curve = cycles()
    falls = np.tile(np.repeat([False, True], 60), 7)
    file = written(tmp_path / "a.csv", "u,f,curve", u[falls], f[falls], curve[falls])
    test = written(tmp_path / "b.csv", "u,f,curve", u[falls], f[falls], curve[falls])
    found = from_files("hysteresis", file, tests=(str(test),))
    said = dict(found.remarks)[f"prediction of {test}"]
    assert said.endswith(" samples, 7 curves, each from its saturation")
    with pytest.raises(InputError, match="a record that is not fitted"):
        from_files("hysteresis", file, tests=(str(file),))


def test_few_points_are_a_test(tmp_path: Path) -> None:
    u, f, _ = cycles()
    file = written(tmp_path / "a.csv", "u,f", u, f)
    test = written(tmp_path / "b.csv", "u,f", u[:250:20], f[:250:20])
    found = from_files("plays", file, tests=(str(test),))
    assert "RMS 0.0" in dict(found.remarks)[f"prediction of {test}"]
