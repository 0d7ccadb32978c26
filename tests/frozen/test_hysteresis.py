"""Tables, models, inverses and diagnostics of hysteresis."""

from __future__ import annotations

import warnings
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from macromicro.hysteresis import (
    FodTable,
    Preisach,
    congruency,
    from_density,
    wiping_out,
)
from macromicro.hysteresis.forc import read_forc

from ..hysteresis.relays import refined, relay_grid, relay_run
from .record import frozen

FORC = Path(__file__).parents[2] / "examples/data/forc/hchb_forc"


def hills(alpha: np.ndarray, beta: np.ndarray) -> np.ndarray:
    return np.exp(-(((alpha - 75.0) / 14.0) ** 2) - ((beta - 50.0) / 12.0) ** 2)


TRUE = FodTable.from_everett(from_density(hills, 20.0, 1.0, 91), 0.1, 4.1)


def curves(noise: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """First-order curves of the true table, with own reversals and own abscissae."""
    random = np.random.default_rng(3)
    made = []
    for turn in np.linspace(48.0, 109.0, 14):
        model = Preisach(TRUE)
        model.reset("negative")
        model.step(float(turn))
        way = np.linspace(turn, 20.0 + random.uniform(0.0, 4.0), 60)
        made.append((way, model.run(way) + noise * random.standard_normal(way.size)))
    return made


@pytest.mark.parametrize(
    ("noise", "shape"),
    [
        (0.0, "free"), (0.01, "free"), (0.01, "monotone"),
        pytest.param(0.01, "nonnegative", marks=pytest.mark.slow),
        pytest.param(0.0, "monotone", marks=pytest.mark.slow),
        pytest.param(0.0, "nonnegative", marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_tables_from_curves(shape: str, noise: float) -> None:
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        table = FodTable.from_curves(curves(noise), shape=shape)  # type: ignore[arg-type]
    found = {
        "lo": table.lo,
        "step": table.step,
        "values": table.values,
        "f_low": table.f_low,
        "told": sorted({type(w.message).__name__ for w in told}),
    }
    frozen(f"table-{shape}-{noise:g}", found, rel=1e-5, absolute=1e-9)


def walk() -> np.ndarray:
    random = np.random.default_rng(9)
    turns = random.uniform(25.0, 108.0, 40)
    return np.concatenate([np.linspace(a, b, 30) for a, b in pairwise(turns)])


def test_models_and_their_inverse() -> None:
    model = Preisach(TRUE)
    model.reset("negative")
    u = walk()
    f = model.run(u)
    again = Preisach(TRUE)
    again.reset("negative")
    frozen("preisach", {"f": f, "corners": model.corners, "back": again.run_inverse(f)}, rel=1e-7)


def test_diagnostics() -> None:
    model = Preisach(TRUE)
    model.reset("negative")
    u = np.concatenate([walk(), np.linspace(30.0, 90.0, 100), np.linspace(90.0, 30.0, 100)] * 2)
    f = model.run(u) + 0.002 * np.sin(np.arange(u.size))
    frozen("wiping-out", wiping_out(u, f), rel=1e-7)
    frozen("congruency", congruency(u, f), rel=1e-7)


def test_a_grid_of_relays() -> None:
    weights = np.tril(np.outer(np.arange(1.0, 9.0), np.arange(2.0, 10.0)))
    grid = relay_grid(weights, 0.0, 1.0)
    u = np.array([0.0, 5.5, 2.5, 7.5, 1.5, 6.0, 3.0])
    off = np.zeros(len(grid.up), dtype=bool)
    frozen("relays", {"refined": refined(weights), "run": relay_run(grid, off, u)})


def test_a_measured_file() -> None:
    file = read_forc(FORC)
    found = [(len(a), float(np.sum(a)), float(np.sum(b))) for a, b in file.curves[:30]]
    frozen("forc", {"curves": len(file.curves), "first": found}, rel=1e-9)
