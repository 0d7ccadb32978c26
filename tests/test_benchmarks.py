"""The benchmarks follow the package: a part of the loop that is renamed would end them."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

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
