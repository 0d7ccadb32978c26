"""A sweep of the machine of a settings file: several stages on one clock, which have no name."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from tests import two_stages

from macromicro import batch
from macromicro.batch import Variants
from macromicro.errors import InputError
from macromicro.machines import composite, compositions, programmes
from macromicro.machines.runs import StageSetup
from macromicro.sweeps._spec import load


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    two_stages.write(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_it_gives_the_figures_of_single_runs(lab: Path) -> None:
    machine, settings = compositions.load(lab / "machine.toml")
    job = batch.job(str(lab / "machine.toml"), programme=str(lab / "moves.toml"))
    names = [metric.name for metric in job.metrics]
    rows = job.evaluate(Variants(("x.friction.coulomb",), np.array([[2.0], [3.0]])))
    for row, coulomb in zip(rows, (2.0, 3.0), strict=True):
        tree = settings.with_("x.friction.coulomb", f"{coulomb:g} N")
        under = composite.under(machine, tree)
        moves = programmes.choose(under, tree, str(lab / "moves.toml"))
        found = StageSetup(under, tree, programmes.plan(under, tree, moves)).trial(0)
        for name in ("missed", "settling"):
            assert row[names.index(name)] == getattr(found, name), name


def test_an_edited_machine_is_another_sweep(lab: Path) -> None:
    before, _ = load(lab / "sweep.toml", batch.job)
    assert json.dumps(before.canonical).count("machine.toml") == 1
    (lab / "machine.toml").write_text(
        two_stages.MACHINE + '\n[x.friction]\nviscous = "60 N*s/m"\n', "utf-8"
    )
    after, _ = load(lab / "sweep.toml", batch.job)
    assert before.digest != after.digest


@pytest.mark.parametrize(
    ("more", "match"),
    [
        ('config = "other.toml"\n', "config: job is a settings file"),
        ("", r"sweep.toml, job: .*x.frction"),
    ],
)
def test_what_does_not_fit_is_refused(lab: Path, more: str, match: str) -> None:
    text = (lab / "sweep.toml").read_text("utf-8")
    (lab / "sweep.toml").write_text(more + text, "utf-8")
    if not more:
        (lab / "machine.toml").write_text(
            two_stages.MACHINE + "\n[x.frction]\nviscous = 1.0\n", "utf-8"
        )
    with pytest.raises(InputError, match=match):
        load(lab / "sweep.toml", batch.job)
