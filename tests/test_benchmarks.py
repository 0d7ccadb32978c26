"""The benchmarks follow the package: a part of the loop that is renamed would end them."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from macromicro import api
from macromicro.control import supervisor
from macromicro.settings import Settings

ROOT = Path(__file__).parents[1]


@pytest.mark.slow
def test_every_part_of_a_period_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    import parts

    monkeypatch.setattr(parts, "REPEATS", 1)
    found = parts.measure()
    assert {"supervisor", "guard", "note", "whole tick"} <= set(found)
    assert all(0.0 < ns < 1e7 for ns in found.values())


def test_the_benchmarks_are_type_checked() -> None:
    """mypy would have found what a test of each figure costs minutes to find."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert {"src", "tools/soak", "benchmarks"} <= set(project["tool"]["mypy"]["files"])


@pytest.mark.slow
def test_the_cycles_of_an_exported_law_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """The PI law of the micro-stage: a division and some products, in software."""
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    import cycles

    if cycles.missing():
        pytest.skip(cycles.missing())
    found = cycles.measure("micro")
    assert found.mcu == "atmega328p"
    assert 300 < found.mean < found.most < 4000
    assert 100 < found.flash < 4000 and 0 < found.ram < 100


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pd-tuned", "pi-antiwindup", "inverse", "pid-heat"])
def test_a_law_that_is_timed_does_what_it_did(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Over the readings of its own run it gives that run's efforts, each time anew."""
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    import laws

    fine = name in laws.MICRO
    step, periods = laws.replay(name, fine)
    settings = Settings()
    run = api.run(
        laws.PROGRAMME, settings=settings._replace(controller=settings.controller.joined(name, ""))
    )
    busy = run["phase"] == (supervisor.MICRO if fine else supervisor.MACRO)
    efforts = run["ctrl" if fine else "motor"][busy]
    assert periods == len(efforts) > 2000
    assert step() == step() == pytest.approx(float(np.sum(efforts)), rel=1e-9)
    assert float(np.sum(np.abs(efforts))) > 100.0
