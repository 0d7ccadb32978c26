"""Requirements: limits with a source, and a user's own from a TOML file.

macro_settling = "0.8 s"      # another limit
vibration = "26 um"           # a limit on a metric without one
micro_overshoot = false       # none
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from macromicro.batch import Metric
from macromicro.errors import InputError, ProblemError
from macromicro.schema.keys import nearest
from macromicro.schema.text import printable, read_toml
from macromicro.units import quantity, shown

WHAT = "a requirements file (.toml)"


class Requirement(NamedTuple):
    metric: Metric  # what is limited
    limit: float  # at most so much, in the metric's unit
    source: str  # of the limit

    @property
    def text(self) -> str:
        """The limit in words: "at most 0.95 s", "none"."""
        if self.limit == 0.0 and not self.metric.unit:
            return "none"
        return f"at most {shown(self.limit, self.metric.unit, digits=6)}"


def load(
    path: Path, metrics: Sequence[Metric], defaults: Sequence[Requirement]
) -> tuple[Requirement, ...]:
    file = printable(path, 300)
    content = read_toml(path, WHAT)
    known = {m.name: m for m in metrics}
    if not content:
        raise ProblemError(file, "the file sets no limit", f"Set a limit of {', '.join(known)}.")
    needed = {r.metric.name: r for r in defaults}
    for key, raw in content.items():
        where = f"{file}, {printable(key)}"
        if key not in known:
            raise ProblemError(where, "unknown metric", f"Accepted: {nearest(key, known)}.")
        if raw is False:
            needed.pop(key, None)
        else:
            limit = _limit(raw, known[key], where)
            needed[key] = Requirement(known[key], limit, f"{path.name}")
    if not needed:
        raise ProblemError(file, "no requirement is left", "Keep at least one limit.")
    return tuple(needed[m.name] for m in metrics if m.name in needed)


def _limit(raw: object, metric: Metric, where: str) -> float:
    if isinstance(raw, bool) or not isinstance(raw, int | float | str):
        example = f'"5 {metric.unit}"' if metric.unit else "0"
        raise InputError(where, printable(raw), f"a limit such as {example}, or false for none")
    written = raw if isinstance(raw, str) else printable(raw)
    value = quantity(written, metric.unit, where)
    if value < 0.0:
        raise InputError(where, written, "zero or more")
    return value
