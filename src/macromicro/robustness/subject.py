"""What a study runs: a machine with a programme, judged by the metrics of its runs."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.batch import Metric
from macromicro.batch.variants import CODE, FAULT
from macromicro.robustness.requirements import Requirement
from macromicro.runs.setup import Setup
from macromicro.uncertainty.table import Uncertain

_LIMITS = tomllib.loads(Path(__file__).with_name("required.toml").read_text(encoding="utf-8"))


class Subject(NamedTuple):
    name: str  # of the machine
    metrics: tuple[Metric, ...]  # of a run: `FAULT` first, `CODE` last
    main: tuple[str, ...]  # names of those that are drawn, six at most
    run: Callable[[Any, int], Sequence[float]]  # the metrics of settings with a seed
    workers: int  # threads
    uncertain: tuple[Uncertain, ...]  # what is varied
    required: tuple[Requirement, ...]  # where a user names no others
    default: Any  # settings that a file need not give
    as_toml: Callable[[Any], str]  # of settings, for ``macromicro run --config``
    kept: Callable[[Any], Any] = lambda tree: tree  # drawn settings, with what stays nominal


def of(setup: Setup, workers: int, *, variants: bool = False) -> Subject:
    """Any machine; `variants`: with effects that no model has."""
    metrics = setup.metrics
    has_code = metrics[-1] == CODE

    def run(settings: Any, seed: int) -> Sequence[float]:
        found = setup.with_settings(settings).trial(seed)
        return found if has_code else (float(found[0] != 0.0), *found[1:], found[0])

    if not has_code:
        metrics = (FAULT, *metrics[1:], CODE)
    return Subject(
        name=setup.name,
        metrics=metrics,
        main=setup.main,
        run=run,
        workers=workers,
        uncertain=setup.uncertain(variants=variants),
        required=usual_requirements(metrics, setup.limits),
        default=setup.default,
        as_toml=lambda settings: setup.with_settings(settings).as_file(),
        kept=setup.kept,
    )


def usual_requirements(
    metrics: Sequence[Metric], limits: dict[str, tuple[float, str]]
) -> tuple[Requirement, ...]:
    """The usual requirements, and a machine's own limits with their sources."""
    known = {metric.name: metric for metric in metrics}
    usual = {name: (row["limit"], row["source"]) for name, row in _LIMITS.items()}
    return tuple(
        Requirement(known[name], *limit)
        for name, limit in (usual | limits).items()
        if name in known
    )
