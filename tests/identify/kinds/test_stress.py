"""`identify stress`: files and columns, the table, loads beyond those measured."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from tests.identify.kinds.seen import facts, given, plots, table
from tests.identify.kinds.test_stress_map import loop

from macromicro.errors import InputError
from macromicro.identify import DataWarning
from macromicro.identify.kinds import stress
from macromicro.identify.kinds.stress import Options
from macromicro.identify.picking import Picked


def file(folder: Path, *loads: float) -> Path:
    parts = [(*loop(s, 0.002, int(s)), np.full(3000, s)) for s in loads]
    columns = (np.concatenate(each) for each in zip(*parts, strict=True))
    name = "-".join(f"{s:g}" for s in loads)
    return table(folder / f"{name}.csv", "T_degC,strain [%],load_MPa", *columns)


def test_one_file_or_several(tmp_path: Path) -> None:
    both = [
        stress.identify(given(*files), Options())
        for files in (
            [file(tmp_path, 50.0, 100.0, 200.0, 250.0)],
            [file(tmp_path, s) for s in (250.0, 50.0, 200.0, 100.0)],
        )
    ]
    lines = facts(both[0].lines)
    assert facts(both[1].lines).keys() == lines.keys()
    for name, line in facts(both[1].lines).items():
        assert line.value == pytest.approx(lines[name].value, rel=1e-9)
    assert lines["heating, slope"].unit == "K/MPa"
    assert lines["heating, slope"].value == pytest.approx(0.15, abs=0.002)
    assert lines["cooling, slope"].value == pytest.approx(0.12, abs=0.002)
    assert lines["heating, 50 %"].value == pytest.approx(80.0 + 0.15 * 150.0, abs=0.2)
    assert "at 150 MPa" in lines["heating, 50 %"].note
    assert lines["stroke at 50"].unit == "%"
    told = [name for name in lines if name.startswith("left out")]
    assert told == ["left out 100", "left out 200"]
    assert all(lines[name].value < 1.0 for name in told)
    remarks = dict(both[0].remarks)
    assert "beyond these it extrapolates" in remarks["valid"] and "50 to 250" in remarks["valid"]


def test_written_and_drawn(tmp_path: Path) -> None:
    made = stress.identify(given(file(tmp_path, 50.0, 100.0, 200.0)), Options())
    made.save(tmp_path / "out")
    told = tomllib.loads((tmp_path / "out" / "model.toml").read_text("utf-8"))["stress"]
    assert told["heating_slope"] == pytest.approx(facts(made.lines)["heating, slope"].value)
    sheet = np.loadtxt(tmp_path / "out" / "stress_map.csv", delimiter=",", skiprows=1)
    assert sheet.shape == (50, 7)
    np.testing.assert_allclose(sheet[:, 1], made.model.heating.at_zero, rtol=1e-7)
    np.testing.assert_allclose(sheet[:, 5], made.model.cooling.slopes, rtol=1e-7)
    figures = made.plot()
    assert len(plots(figures["curves"])[0].lines) == 6
    assert plots(figures["thresholds"])[0].x == "load [MPa]"


def test_a_load_that_was_not_fitted(tmp_path: Path) -> None:
    fitted = file(tmp_path, 50.0, 100.0, 200.0, 250.0)
    inside, beyond = file(tmp_path, 150.0), file(tmp_path, 300.0)
    made = stress.identify(given(fitted), Options(tests=(str(inside),)))
    assert facts(made.lines)["test"].value > 97.0  # 1 % of range is some 2.5 % of deviation
    with pytest.warns(DataWarning, match="300 is beyond those measured, 50 to 250"):
        stress.identify(given(fitted), Options(tests=(str(beyond),)))


def rows(**values: np.ndarray) -> Picked:
    return Picked("a.csv", values, {}, {}, {})


def test_a_load_that_is_measured_scatters() -> None:
    """About 100 and 150 N, by 1 %, in one file after another."""
    random = np.random.default_rng(0)
    wanted = np.repeat([100.0, 150.0, 100.0], 500)
    load = wanted * (1.0 + 0.005 * random.standard_normal(1500))
    (found,) = stress.levels([rows(load=load)])
    assert len(np.unique(found)) == 2
    np.testing.assert_allclose(found, wanted, rtol=1e-3)
    (near,) = stress.levels([rows(load=np.array([0.0, -20.0, 0.1]))])
    np.testing.assert_array_equal(near, [0.05, -20, 0.05])


@pytest.mark.parametrize("one", [False, True])
def test_a_load_cell_as_it_measures(tmp_path: Path, one: bool) -> None:
    """Loads that overlap by noise, and rise by a spring as the wire contracts: mean and scatter."""
    random = np.random.default_rng(2)
    held = (50.0, 120.0, 200.0, 290.0)
    parts = []
    for k, s in enumerate(held):
        t, y = loop(s, 0.002, k)
        cell = s + 30.0 * (y - y.mean()) / np.ptp(y) + 12.0 * random.standard_normal(len(t))
        parts.append((t, y, cell))
    names = "T_degC,strain [%],load_MPa"
    if one:
        joined = (np.concatenate(each) for each in zip(*parts, strict=True))
        files = [table(tmp_path / "all.csv", names, *joined)]
    else:
        files = [table(tmp_path / f"{k}.csv", names, *part) for k, part in enumerate(parts)]
    made = stress.identify(given(*files), Options())
    lines, remarks = facts(made.lines), dict(made.remarks)
    np.testing.assert_allclose(made.data["loads"], held, atol=1.0)
    assert lines["heating, slope"].value == pytest.approx(0.15, abs=0.005)
    scatter = [float(part.split(" +- ")[1].split()[0]) for part in remarks["load cell"].split(",")]
    np.testing.assert_allclose(scatter, [part[2].std() for part in parts], rtol=0.06)


def test_refused(tmp_path: Path) -> None:
    t, y = loop(100.0)
    wild = table(tmp_path / "w.csv", "T_degC,x,load_N", t, y, np.linspace(1.0, 2.0, len(t)))
    with pytest.raises(InputError, match="two or more"):
        stress.identify(given(wild), Options())
    with pytest.raises(InputError, match="two or more"):
        stress.identify(given(file(tmp_path, 50.0)), Options())
