"""Random benches of the two-stage machine for `make_commissioning`."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import make_beyond_both
from commissioning_table import Case, Tried, compared

from macromicro.errors import MacromicroError
from macromicro.settings import Settings
from macromicro.thesis import commissioning, commissioning_page
from macromicro.thesis.procedure import Lab

NUMBER, SEED = 100, 2034


class Found(NamedTuple):
    """An estimate as `compared` takes it."""

    value: float
    half: float


def truth(tree: Settings) -> dict[str, float]:
    """What the estimates with a standard error are, by the bench's figures."""
    belt = tree.bench.belt
    return {"frequency": belt.frequency, "decay": belt.decay, "share": belt.participation}


def cases(number: int | None = None) -> Iterator[Case]:
    """So many of those that are drawn together."""
    wanted = NUMBER if number is None else number
    for k, tree in enumerate(make_beyond_both.drawn(NUMBER, SEED, {})[:wanted]):
        yield Case(f"two_stage {k}", partial(one, f"two_stage {k}", tree, k))


def one(label: str, tree: Settings, seed: int) -> Tried:
    """One machine, commissioned from its sensors and compared with the truth."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            found = commissioning.commission(Lab(tree, seed), Path(folder) / "out")
        except MacromicroError as error:
            return Tried(label, {}, refused=str(error))
    values: dict[str, Any] = {}
    for row in found.found[commissioning.CARRIAGE.name]["values"]:
        half = commissioning_page.half_width(row)
        values[row["name"]] = Found(row["value"], half)
    return Tried(label, compared(values, truth(tree)), unmet=found.why)
