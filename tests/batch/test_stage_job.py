"""Variants of a machine of one stage: the figures of single runs, what is impossible, options."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.machines import own

from macromicro import batch
from macromicro.batch import Variants
from macromicro.batch.stage_job import StageJob
from macromicro.control import outside
from macromicro.errors import InputError
from macromicro.machines import machine as machines
from macromicro.machines import planning
from macromicro.machines.runs import StageSetup
from macromicro.machines.trial import Trial
from macromicro.schema.par import entries
from macromicro.sweeps.subject import laws

PROGRAMME = '[[moves]]\nmacro = "5 mm"\nhold = "0.05 s"\n'


@pytest.fixture
def short(tmp_path: Path) -> str:
    """A programme of one move."""
    path = tmp_path / "short.toml"
    path.write_text(PROGRAMME, encoding="utf-8")
    (tmp_path / "less.toml").write_text(PROGRAMME.replace("5 mm", "2 mm"), encoding="utf-8")
    return str(path)


def test_each_variant_has_the_figures_of_a_single_run(short: str) -> None:
    job = batch.job("axis", programme=short, seed=3)
    names = [m.name for m in job.metrics]
    assert tuple(names) == Trial._fields and job.name == "axis"
    masses = np.array([[0.5, 0.0], [2.0, 0.0], [2.0, 7.0]])
    found = job.evaluate(Variants(("load.mass", "seed"), masses))
    machine = machines.named("axis", "")
    assert machine is not None
    for row, (mass, seed) in zip(found, masses, strict=True):
        tree = job.base().with_("load.mass", f"{mass} kg")
        plan = planning.plan(planning.load(Path(short), tree), tree)
        assert tuple(row) == StageSetup(machine, tree, plan).trial(int(seed))
    # What follows from the mass has followed: the gains, and so the arrival.
    assert found[0, names.index("missed")] == found[1, names.index("missed")] == 0.0
    assert found[0, names.index("effort")] != found[1, names.index("effort")]


def test_a_machine_that_cannot_work_is_impossible(short: str) -> None:
    job = batch.job("axis", programme=short)
    with pytest.raises(InputError, match=r"variant 4, .*travel"):
        job.evaluate(Variants(("travel.high",), np.array([[0.4]])), 4)
    with pytest.raises(InputError, match=r"variant 0, load.mass"):
        job.evaluate(Variants(("load.mass",), np.array([[-1.0]])))


@pytest.mark.parametrize("name", ["axis", "piezo", "wire"])
def test_each_machine_is_a_job(name: str) -> None:
    job = batch.job(name)
    assert isinstance(job, StageJob) and job.name == name


def test_a_machine_and_a_law_of_ones_own(short: str) -> None:
    """An edit of either is another sweep."""
    own.module()
    job = batch.job("ownlab:flexure", programme=short.replace("short", "less"))
    assert job.name == "ownlab:flexure" and "blade.mass" in {e.path for e in entries(job.base())}
    ((name, digest),) = laws(job)
    assert name == "machine ownlab:flexure" and len(digest) == 16
    law = "tests.control.own_laws:sliding"
    axis = batch.job("axis").base().with_("law", law)
    (found,) = laws(StageJob("axis", settings=axis))
    assert found == (f"law {law}", outside.digest(law)) and laws(batch.job("axis")) == ()
    with pytest.raises(InputError, match="MODULE:MACHINE of your own"):
        batch.job("axes")


def test_options_are_checked() -> None:
    with pytest.raises(InputError, match="seed"):
        batch.job("axis", seed=-1)
    with pytest.raises(InputError):
        batch.job("axis", programme="no-such-programme")
