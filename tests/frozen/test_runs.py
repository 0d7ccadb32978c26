"""Recordings of runs, column by column, for three seeds; the settings; a sweep and a tune."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import macromicro
from tests.command import command

from .record import frozen

SEEDS = (0, 1, 2)
TURNED = """
[bench.friction]
coulomb = "7 N"
[sensors.hall]
gain = "2.5 V"
[controller.sequence]
tolerance = "25 counts"
"""


def _columns(run: Any) -> dict[str, Any]:
    return {c.name: [c.unit, c.dtype, run[c.name]] for c in run.columns}


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", ["thesis", "staircase", "full-travel"])
def test_run(name: str, seed: int) -> None:
    run = macromicro.run(name, seed=seed)
    frozen(f"run-{name}-{seed}", {"columns": _columns(run), "moves": macromicro.moves(run)})


@pytest.mark.parametrize(
    "seed", [0, pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.slow)]
)
def test_ten_cycles_with_a_fan(seed: int) -> None:
    run = macromicro.run("thesis", seed=seed, cycles=10, fan=True)
    frozen(f"run-ten-{seed}", {"columns": _columns(run), "moves": macromicro.moves(run)})


def test_run_of_changed_settings(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(TURNED, encoding="utf-8")
    settings = macromicro.load_settings(file)
    run = macromicro.run("thesis", seed=3, settings=settings)
    frozen("run-changed", {"columns": _columns(run), "moves": macromicro.moves(run, settings)})


def _told(*words: str) -> str:
    done = command(*words, cwd=Path.cwd())
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_config_show() -> None:
    frozen("config-show", _told("config", "show").splitlines())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stage", "words"),
    [("macro", ("--evaluations", "60")), ("micro", ("--evaluations", "12", "--objective", "iae"))],
)
def test_tune(stage: str, words: tuple[str, ...], tmp_path: Path) -> None:
    found = _told("tune", stage, "--json", *words, "--out", str(tmp_path / "tuned"))
    frozen(f"tune-{stage}", _timeless(json.loads(found)))


def _timeless(found: Any) -> Any:
    """Without what names a place or a duration."""
    if isinstance(found, dict):
        gone = {"seconds", "out", "folder", "version", "duration"}
        return {k: _timeless(v) for k, v in found.items() if k not in gone}
    return [_timeless(v) for v in found] if isinstance(found, list) else found


@pytest.mark.slow
@pytest.mark.parametrize("name", ["sweep-gains", "sweep-friction"])
def test_sweep(name: str, tmp_path: Path) -> None:
    spec = Path(__file__).parents[2] / "examples" / f"{name}.toml"
    out = tmp_path / "out"
    _told("sweep", str(spec), "--out", str(out), "--workers", "1")
    table = pd.concat(pd.read_parquet(p) for p in sorted(out.rglob("*.parquet")))
    numbers = table.select_dtypes("number").drop(columns=["seconds"], errors="ignore")
    frozen(f"sweep-{name}", {c: numbers[c].to_numpy(float) for c in sorted(numbers)})
