"""Random benches of the two-stage machine for `make_commissioning`."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import make_beyond_both
from commissioning_table import Tried, compared

from macromicro.errors import MacromicroError
from macromicro.settings import Settings
from macromicro.thesis import commissioning, commissioning_page
from macromicro.thesis.procedure import Lab

NUMBER, SEED = 20, 2034


class Found(NamedTuple):
    """An estimate as `compared` takes it."""

    value: float
    half: float


def truth(tree: Settings) -> dict[str, float]:
    """What the estimates with a standard error are, by the bench's figures."""
    belt = tree.bench.belt
    return {"frequency": belt.frequency, "decay": belt.decay, "share": belt.participation}


def tried(number: int | None = None) -> Iterator[Tried]:
    """Commission so many one after the other, and compare them with the truth."""
    wanted = NUMBER if number is None else number
    for k, tree in enumerate(make_beyond_both.drawn(NUMBER, SEED, {})[:wanted]):
        with tempfile.TemporaryDirectory() as folder:
            yield one(f"two_stage {k}", tree, k, Path(folder) / "out")


def one(label: str, tree: Settings, seed: int, out: Path) -> Tried:
    """One machine, commissioned from its sensors."""
    try:
        found = commissioning.commission(Lab(tree, seed), out)
    except MacromicroError as error:
        return Tried(label, {}, refused=str(error))
    values: dict[str, Any] = {}
    for row in found.found[commissioning.CARRIAGE.name]["values"]:
        half = commissioning_page.half_width(row)
        values[row["name"]] = Found(row["value"], half)
    return Tried(label, compared(values, truth(tree)), unmet=found.why)
