"""Requirements: limits with a source, and a user's own from a TOML file.

macro_settling = "0.8 s"      # another limit
vibration = "26 um"           # a limit on a metric without one
micro_overshoot = false       # none
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from macromicro.batch import Metric
from macromicro.errors import InputError, ProblemError
from macromicro.robustness._metrics import NAMES, QUANTITIES
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

    def met(self, rows: NDArray[np.float64]) -> NDArray[np.bool_]:
        return np.asarray(rows[:, NAMES.index(self.metric.name)] <= self.limit)


_MORE = "more is allowed (assumption)"
_DEFAULTS: tuple[tuple[str, float, str], ...] = (
    ("fault", 0.0, "the guard must not stop a good machine"),
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
_BY_NAME = {m.name: m for m in QUANTITIES}

DEFAULTS = tuple(Requirement(_BY_NAME[name], limit, source) for name, limit, source in _DEFAULTS)


def load(
    path: Path,
    metrics: Sequence[Metric] = QUANTITIES,
    defaults: Sequence[Requirement] = DEFAULTS,
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
