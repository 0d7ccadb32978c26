"""Random benches of the two-stage machine for `make_commissioning`."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import beyond
import commissioning
import make_beyond_both
import numpy as np

from macromicro.settings import Settings
from macromicro.thesis import commissioning as two_stage
from macromicro.thesis import commissioning_page
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


def drawn(random: np.random.Generator, number: int) -> Iterator[Settings]:
    """So many of those that are drawn together, over a Latin square of their own seed."""
    del random
    return iter(beyond.differing(make_beyond_both.spread({}), NUMBER, SEED)[:number])


def tried(tree: Settings, seed: int) -> commissioning.Tried:
    """One machine, commissioned from its sensors and compared with the truth."""
    with tempfile.TemporaryDirectory() as folder:
        found = two_stage.commission(Lab(tree, seed), Path(folder) / "out")
    values = {
        row["name"]: Found(row["value"], commissioning_page.half_width(row))
        for row in found.found[two_stage.CARRIAGE.name]["values"]
    }
    return {"errors": commissioning.compared(values, truth(tree)), "unmet": found.why}


DRAWN = commissioning.Machines("two_stage", NUMBER, SEED, drawn, tried)
