"""`--test FILE`: in the same table and figure, a record that was not fitted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from macromicro import identify
from macromicro.errors import InputError
from macromicro.identify._report import Pair
from macromicro.models.mass import Axis, simulate

DT = 0.005
AXIS = Axis(mass=95.0, viscous=203.0, coulomb=20.0, offset=-3.0)


def written(place: Path, name: str, axis: Axis = AXIS, rate: float = 2.2) -> str:
    """A record of an axis, with noise of its own."""
    t = np.arange(3000) * DT
    u = 40.0 * np.sign(np.sin(rate * t)) + 30.0 * np.sin(5.7 * t)
    noise = np.random.default_rng(len(name)).standard_normal(len(t))
    x = simulate(axis, u + 0.3 * noise, DT) + 1e-6 * noise
    np.savez(place / name, t_s=t, u_N=u, x_m=x)
    return str(place / name)


def test_a_drive_on_records_of_its_own_and_of_another_axis(tmp_path: Path) -> None:
    own, same = written(tmp_path, "own.npz"), written(tmp_path, "same.npz", rate=1.7)
    other = written(tmp_path, "other.npz", AXIS._replace(mass=140.0, viscous=300.0))
    found = identify.from_files("drive", own, tests=(same, other), structure="coulomb")
    values = {line.name: line for line in found.lines}
    assert values["test 1"].value > 99.0 and values["test 2"].value < 85.0
    assert "not fitted" in values["test 1"].note and "same.npz" in values["test 1"].note
    assert [one["samples"] for one in found.data["tests"]] == [3000, 3000]
    axes = found.plot()["free_run"].axes
    assert [a.get_title("left") or a.get_title() for a in axes[:3]] == [
        "fitted",
        "not fitted: same.npz",
        "not fitted: other.npz",
    ]


def test_a_linear_model_on_speeds_and_on_positions(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    for name in ("fitted", "unseen"):
        u = np.repeat(rng.standard_normal(60), 10)
        y = np.zeros(600)
        for k in range(1, 600):
            y[k] = 0.9 * y[k - 1] + 2.0 * u[k - 1]
        x = np.concatenate([[0.0], np.cumsum(y)[:-1]]) * 0.01
        t = 0.01 * np.arange(600)
        np.savez(tmp_path / f"{name}.npz", t=t, u=u, y=y + 0.01 * rng.standard_normal(600))
        np.savez(tmp_path / f"{name}-x.npz", t=t, u=u, x=x)
        np.savez(tmp_path / f"{name}-slow.npz", t=2.0 * t, u=u, y=y)
    for kind in ("", "-x"):
        file, test = (str(tmp_path / f"{n}{kind}.npz") for n in ("fitted", "unseen"))
        found = identify.from_files("linear", file, tests=(test,))
        assert found.lines[-1].name == "test" and found.lines[-1].value > 99.0
        assert len(found.plot()["free_run"].axes) == 4
    with pytest.raises(InputError, match=r"sample time is 0\.02 s, that of the fit 0\.01 s"):
        files = (str(tmp_path / "fitted.npz"), str(tmp_path / "unseen-slow.npz"))
        identify.from_files("linear", files[0], tests=(files[1],))


def test_a_sensors_table_on_another_sweep(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    for name, bend in (("fitted", 0.1), ("unseen", 0.1), ("worn", 0.4)):
        v = np.concatenate([np.linspace(0.5, 4.5, 900), np.linspace(4.5, 0.5, 900)])
        x = 2.0 * v + bend * np.sin(2.0 * v) + 1e-3 * rng.standard_normal(1800)
        np.savez(tmp_path / f"{name}.npz", v_V=v, x_mm=x)
    tests = tuple(str(tmp_path / f"{name}.npz") for name in ("unseen", "worn"))
    found = identify.from_files("hall", str(tmp_path / "fitted.npz"), tests=tests)
    good, bad = found.data["tests"]
    assert good["rms"] < 2e-3 and bad["rms"] == pytest.approx(0.3 / np.sqrt(2.0), rel=0.2)
    labels = found.plot()["calibration"].axes[0].get_legend_handles_labels()[1]
    assert labels[2:] == ["not fitted: unseen.npz", "not fitted: worn.npz"]


def test_what_cannot_be_a_test(tmp_path: Path) -> None:
    own = written(tmp_path, "own.npz")
    with pytest.raises(InputError, match=r"^test: .*a record that is not fitted"):
        identify.from_files("drive", own, tests=(own,))
    with np.load(own) as file:
        np.savez(tmp_path / "counts.npz", t_s=file["t_s"], u_N=file["u_N"], x_counts=file["x_m"])
    with pytest.raises(InputError, match="x is in counts"):
        identify.from_files("drive", own, tests=(str(tmp_path / "counts.npz"),))
    with pytest.raises(InputError, match="no such file"):
        identify.from_files("drive", own, tests=(str(tmp_path / "nothing.npz"),))


def test_an_output_that_stays_has_no_percentage() -> None:
    still = Pair("a", np.arange(3.0), np.ones(3), np.ones(3))
    assert still.rms == 0.0 and np.isnan(still.percent)
