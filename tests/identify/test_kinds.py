"""Identification from files in two lines of Python, as the command does it."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from macromicro import identify
from macromicro.errors import InputError
from macromicro.identify import Axis, simulate


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drive of 2 kg with friction, in a table of one's own."""
    t = np.arange(6000) * 1e-3
    u = 30.0 * np.sign(np.sin(2.1 * t)) * (0.5 + 0.5 * np.sin(0.7 * t) ** 2)
    axis = Axis(mass=2.0, viscous=8.0, coulomb=6.0, offset=0.0)
    x = simulate(axis, u, 1e-3) + 1e-6 * np.random.default_rng(0).standard_normal(6000)
    file = tmp_path_factory.mktemp("own") / "axis.csv"
    rows = np.stack([t, u, x], axis=1)
    np.savetxt(file, rows, delimiter=",", header="t_s,u_N,x_m", comments="", fmt="%.9g")
    return file


def test_two_lines_give_a_model_and_its_uncertainty(own: Path, tmp_path: Path) -> None:
    found = identify.from_files("drive", own, structure="coulomb")
    found.save(tmp_path / "found")
    assert found.model.mass == pytest.approx(2.0, abs=4.0 * found.uncertainty["mass"])
    assert found.model.coulomb == pytest.approx(6.0, abs=4.0 * found.uncertainty["coulomb"])
    assert 0.0 < found.uncertainty["mass"] < 0.1
    toml = tomllib.loads((tmp_path / "found" / "model.toml").read_text())
    assert toml["machine"] == "axis"
    assert toml["load"]["mass"] == f"{found.model.mass!r} kg"
    assert found.to_toml() == (tmp_path / "found" / "model.toml").read_text()
    written = json.loads((tmp_path / "found" / "result.json").read_text())
    assert written["files"] == [str(own)] and written["kind"] == "drive"
    assert set(found.plot()) == {"free_run", "residuals"}
    assert (tmp_path / "found" / "free_run.png").stat().st_size > 10_000
    assert "mass" in str(found) and str(found).startswith(found.title)


def test_columns_are_named_by_role(own: Path, tmp_path: Path) -> None:
    other = tmp_path / "odd.csv"
    other.write_text(own.read_text().replace("t_s,u_N,x_m", "clock_s,push_N,scale_m"))
    names = {"t": "clock", "u": "push", "x": "scale"}
    one = identify.from_files("drive", [str(other)], names, structure="coulomb")
    two = identify.from_files("drive", own, structure="coulomb")
    assert one.model == two.model


@pytest.mark.parametrize(
    ("kind", "options", "words"),
    [
        ("motor", {}, "drive, carriage, linear, deadzone"),
        ("drive", {"mass": 2.0}, "gain, structure, along, limit, delay"),
    ],
)
def test_what_is_not_known_is_refused(
    own: Path, kind: str, options: dict[str, float], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        identify.from_files(kind, own, **options)


def test_a_file_that_is_not_there_is_named() -> None:
    with pytest.raises(InputError, match=r"nowhere\.csv"):
        identify.from_files("drive", "nowhere.csv")
    with pytest.raises(InputError, match="no file is given"):
        identify.from_files("drive", [])
