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
