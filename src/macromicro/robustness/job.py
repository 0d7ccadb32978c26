"""A programme on the whole bench of the two-stage machine, judged by its metrics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from macromicro import batch
from macromicro.arrays import Array
from macromicro.batch import SEED, Job, Variants
from macromicro.batch.programme_metrics import METRICS
from macromicro.machines.compositions import UNNAMED
from macromicro.robustness.requirements import NO_FAULT, Requirement
from macromicro.robustness.study import Subject
from macromicro.schema import config
from macromicro.settings import Settings
from macromicro.uncertainty.machines import columns
from macromicro.uncertainty.table import UNCERTAIN, Uncertain

# What is drawn.
MAIN = ("macro_settling", "macro_overshoot", "micro_error", "contraction", "extension", "vibration")
_MORE = "more is allowed (assumption)"
_DEFAULTS: tuple[tuple[str, float, str], ...] = (
    ("fault", 0.0, NO_FAULT),
    ("macro_missed", 0.0, "Section 6.1: every macro move is followed by micro moves"),
    ("micro_missed", 0.0, "Section 6.2: every level is reached"),
    ("macro_settling", 0.95, f"Section 6.4.2: 0.75 s; a quarter {_MORE}"),
    ("macro_overshoot", 1.0, "Section 4.3.3: no overshoot, to a count"),
    ("contraction", 0.7, f"Section 5.3.2: 0.5 s; 0.2 s {_MORE}"),
    ("extension", 1.3, f"Section 5.3.2: 1 s; 0.3 s {_MORE}"),
    ("micro_error", 5.0, "Section 5.3.2: 5 um (S13c)"),
    (
        "true_micro_error",
        5.0,
        "the same of the position itself: the laser's zero may be off (Section 6.3)",
    ),
    ("micro_overshoot", 10.0, "assumption: the band within which a micro move has settled"),
)
_BY_NAME = {m.name: m for m in METRICS}

REQUIRED = tuple(Requirement(_BY_NAME[name], limit, source) for name, limit, source in _DEFAULTS)


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
