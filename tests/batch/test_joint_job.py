"""Variants of a machine of two axes: the figures of single runs, on parameters of both."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from macromicro import batch, cli
from macromicro.batch import Variants
from macromicro.errors import InputError
from macromicro.machines import composite, compositions
from macromicro.machines.joint import course, planning
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.runs import StageSetup
from macromicro.machines.trial import kind
from macromicro.sweeps.subject import laws, parameters

PLOTTER = Path(__file__).parents[2] / "examples" / "machines" / "xy-plotter.toml"
PROGRAMME = '[[paths]]\nx = "20 mm"\ny = "10 mm"\nhold = "0.05 s"\n'


@pytest.fixture
def short(tmp_path: Path) -> str:
    """A programme of one move."""
    path = tmp_path / "short.toml"
    path.write_text(PROGRAMME, encoding="utf-8")
    return str(path)


def test_each_variant_has_the_figures_of_a_single_run(short: str) -> None:
    settings = compositions.load(PLOTTER)[1]
    job = batch.job("xy", programme=short, seed=3, settings=settings)
    names = [m.name for m in job.metrics]
    assert tuple(names) == kind(XY_MACHINE)._fields and job.name == "xy"
    assert [m.unit for m in job.metrics if m.name in {"missed", "contour"}] == ["", "um"]
    paths = ("x.friction.coulomb", "y.load.payload", "seed")
    values = np.array([[10.0, 0.5, 0.0], [16.0, 0.5, 0.0], [10.0, 2.0, 0.0], [10.0, 0.5, 7.0]])
    found = job.evaluate(Variants(paths, values))
    for row, (friction, payload, seed) in zip(found, values, strict=True):
        tree = settings.with_({"x.friction.coulomb": f"{friction} N"})
        tree = tree.with_({"y.load.payload": f"{payload} kg"})
        # What x carries has followed, as in a file.
        assert tree.x.load.payload == pytest.approx(1.6 + 0.8 + payload)
        plan = planning.plan(course.load(Path(short)), tree)
        setup = StageSetup(composite.under(XY_MACHINE, tree), tree, plan)
        assert tuple(row) == setup.trial(int(seed))
    assert found[:, names.index("missed")].tolist() == [0.0] * 4
    assert len(np.unique(found[:3, names.index("peak_error_x")])) == 3
    assert found[3].tolist() == found[0].tolist()  # these encoders have no noise


def test_what_one_axis_cannot_do_is_an_impossible_variant(short: str) -> None:
    job = batch.job("xy", programme=short)
    with pytest.raises(InputError, match=r"variant 2, .*y\.travel"):
        job.evaluate(Variants(("y.travel.high",), np.array([[0.4]])), 2)
    with pytest.raises(InputError, match=r"variant 0, x.load.mass"):
        job.evaluate(Variants(("x.load.mass",), np.array([[-1.0]])))
    assert laws(job) == () and {"x.hidden.bits", "y.controller.position"} & set(parameters(job))


@pytest.mark.slow
def test_a_sweep_over_both_axes_by_processes_gives_a_table(
    short: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    spec, out = tmp_path / "both.toml", tmp_path / "out"
    (tmp_path / "plotter.toml").write_text(PLOTTER.read_text(encoding="utf-8"), encoding="utf-8")
    spec.write_text(
        'job = "xy"\nmethod = "grid"\nmetrics = ["contour", "missed"]\nconfig = "plotter.toml"\n'
        f'[options]\nprogramme = "{short}"\n[parameters]\n'
        '"x.friction.coulomb" = ["8 N", "12 N"]\n"y.friction.coulomb" = ["4 N", "6 N", "8 N"]\n',
        encoding="utf-8",
    )
    words = ["macromicro", "sweep", str(spec), "--out", str(out), "--workers", "2"]
    monkeypatch.setattr(sys, "argv", words)
    assert cli.main() == 0, capsys.readouterr().err
    assert "6 of 6 variants" in capsys.readouterr().out
    table = pq.read_table(out / "results.parquet").to_pydict()
    assert table["x.friction.coulomb"] == [8.0] * 3 + [12.0] * 3
    assert table["y.friction.coulomb"] == [4.0, 6.0, 8.0] * 2
    assert table["missed"] == [0.0] * 6 and len(set(table["contour"])) == 6
    monkeypatch.setattr(sys, "argv", [*words, "--law", "cascade", "--overwrite"])
    assert cli.main() == 2 and "law of each axis" in capsys.readouterr().err
