"""A programme on the whole bench of the two-stage machine, judged by its metrics."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from macromicro import batch
from macromicro.arrays import Array
from macromicro.batch import SEED, Job, Variants
from macromicro.batch.programme_metrics import METRICS
from macromicro.machines.compositions import UNNAMED
from macromicro.robustness.requirements import Requirement
from macromicro.robustness.study import Subject
from macromicro.schema import config
from macromicro.settings import Settings
from macromicro.uncertainty.machines import columns
from macromicro.uncertainty.table import UNCERTAIN, Uncertain

# What is drawn.
MAIN = ("macro_settling", "macro_overshoot", "micro_error", "contraction", "extension", "vibration")
_BY_NAME = {m.name: m for m in METRICS}

_LIST = tomllib.loads(Path(__file__).with_name("required.toml").read_text(encoding="utf-8"))
REQUIRED = tuple(
    Requirement(_BY_NAME[name], row["limit"], row["source"]) for name, row in _LIST.items()
)


def subject(job: Job, workers: int, uncertain: Sequence[Uncertain] = UNCERTAIN) -> Subject:
    """The two-stage machine, run by a job of the batch engine in threads."""

    def evaluate(trees: Sequence[Any], seeds: Sequence[int], done: Callable[[int], bool]) -> Array:
        rows: list[Array] = []
        for _, piece in batch.run(job, variants(uncertain, trees, seeds), workers):
            rows.extend(piece)
            if done(len(rows)):
                break
        return np.array(rows)

    def as_toml(tree: Any) -> str:
        return config.changed_toml(tree, Settings())

    return Subject(
        UNNAMED, job.metrics, MAIN, evaluate, tuple(uncertain), REQUIRED, Settings(), as_toml
    )


def variants(
    uncertain: Sequence[Uncertain], trees: Sequence[Settings], seeds: Sequence[int]
) -> Variants:
    paths, values = columns(uncertain, trees)
    return Variants((*paths, SEED), np.column_stack((values, np.array(seeds, dtype=float))))
