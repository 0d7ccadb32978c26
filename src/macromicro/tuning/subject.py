"""What is tuned: a machine, the gains of its law, and how its runs are judged; less is better."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.batch import Metric
from macromicro.errors import InputError, ProblemError
from macromicro.machines.loops import Complex
from macromicro.runs.trials import trials
from macromicro.sampling import scale
from macromicro.schema.par import Entry, entries
from macromicro.schema.text import printable
from macromicro.uncertainty.table import Uncertain

Figures = Mapping[str, float]  # of a run, by name

FAILED = 1e6
MOST = 1e6  # of a penalty's weight


class Knob(NamedTuple):
    """A gain that is searched, or a quantity that gains follow from."""

    name: str
    unit: str  # of the next three
    # low, high: bounds
    low: float
    high: float
    present: float  # where the search starts
    log: bool = True  # searched on a logarithmic scale

    def at(self, share: float) -> float:
        """The value at a place from 0 to 1."""
        return float(scale(np.array(share), self.low, self.high, log=self.log))

    @property
    def share(self) -> float:
        """The place of the present value."""
        if self.log:
            share = math.log(self.present / self.low) / math.log(self.high / self.low)
        else:
            share = (self.present - self.low) / (self.high - self.low)
        return min(max(share, 0.0), 1.0)


class Penalty(NamedTuple):
    name: str  # as the option names it
    weight: float  # by default, for each of what `amount` counts
    unit: str  # of the weight
    meaning: str
    # of a run, and of the run with the first gains on the same machine
    amount: Callable[[Figures, Figures], float]


def has_failed(run: Figures) -> bool:
    """Whether a fault stopped it or a move did not arrive."""
    return bool(run.get("fault", 0.0) or run.get("missed", 0.0))


class Objective(NamedTuple):
    name: str  # as the option names it
    unit: str  # of its value
    meaning: str
    value: Callable[[Figures], float]  # of a run, without penalties
    penalties: tuple[Penalty, ...] = ()

    def cost(self, found: Figures, first: Figures, weights: Mapping[str, float]) -> float:
        """The value with its penalties; a run that failed costs `FAILED` or more."""
        if has_failed(found):
            return FAILED * (1.0 + found.get("missed", 0.0))
        total = self.value(found)
        for each in self.penalties:
            weight = weights.get(each.name, each.weight)
            if weight:
                total += weight * each.amount(found, first)
        return total if math.isfinite(total) else FAILED

    def described(self, weights: Mapping[str, float]) -> str:
        some: list[str] = []
        none: list[str] = []
        for each in self.penalties:
            weight = weights.get(each.name, each.weight)
            words = f"{each.name}: {weight:g} {each.unit} x ({each.meaning})"
            (some if weight else none).append(words if weight else each.name)
        text = f"{self.name} = {self.meaning}, and penalties: {'; '.join(some) or 'none'}"
        return text + (f" (no penalty for: {', '.join(none)})" if none else "")


class Panel(NamedTuple):
    """A curve of a run, for a figure."""

    title: str
    unit: str
    t: Array  # s
    y: Array
    band: float | None = None  # half width about 0, drawn as lines
    target: tuple[Array, Array] | None = None  # times and set points
    limits: tuple[float, float] | None = None  # of the axis


class Bode(NamedTuple):
    """The open loop of a linear model."""

    frequency: Array  # Hz
    loop: Complex
    title: str


class Margin(NamedTuple):
    name: str
    meaning: str
    value: float
    unit: str


class Subject:
    """A machine under a law. Each family of machines has its own."""

    name: str  # of what is tuned: a stage or a machine
    machine: str
    law: str
    start: Any  # settings
    default: Any  # settings that a file need not give
    paths: tuple[str, ...]  # of the gains
    metrics: tuple[Metric, ...]  # of a run
    objectives: tuple[Objective, ...]
    remarks: tuple[str, ...] = ()
    parts: tuple[tuple[str, Subject], ...] = ()  # stages that are searched alone first

    def objective(self, name: str) -> Objective:
        """What is minimised when a user asks for an objective by name."""
        for each in self.objectives:
            if each.name == name:
                return each
        known = ", ".join(each.name for each in self.objectives)
        raise InputError("--objective", printable(name), f"one of {known}")

    def knobs(self, settings: Any) -> tuple[Knob, ...]:
        raise NotImplementedError

    def applied(self, settings: Any, values: Sequence[float]) -> Any:
        """Settings with the gains of the knobs' values."""
        raise NotImplementedError

    def prepare(self) -> None:
        """Compile what the runs need."""
        self.run(self.start, 0)

    def run(self, settings: Any, seed: int) -> Figures:
        raise NotImplementedError

    @property
    def uncertain(self) -> tuple[Uncertain, ...]:
        raise NotImplementedError

    def under(self, settings: Any, other: Any) -> Any:
        """Another machine with the law of these settings."""
        raise NotImplementedError

    def allowed(self, settings: Any) -> bool:
        """Whether gains may be tried."""
        return True

    def accepted(self, settings: Any) -> bool:
        """Whether the best gains may be taken; this may cost a few runs."""
        return True

    def further(self, settings: Any) -> list[tuple[str, Any]]:
        """More versions by name, once the parts have been tuned."""
        return []

    def panels(self, settings: Any, seed: int) -> list[Panel]:
        raise NotImplementedError

    def bodes(self, settings: Any) -> tuple[Bode, ...]:
        """Open loops of the linear model, of each stage that has one."""
        return ()

    def margins(self, settings: Any) -> tuple[Margin, ...]:
        return ()

    def doubts(self, settings: Any, found: Figures) -> tuple[str, ...]:
        """What a user should know of the best gains and their run."""
        return ()

    def as_toml(self, settings: Any) -> str:
        """A file for ``macromicro run --config``."""
        raise NotImplementedError

    def gains(self, settings: Any) -> dict[str, tuple[float, str]]:
        """Gains and their units by path, as a user reads them."""
        found: dict[str, Entry] = {e.path: e for e in entries(settings)}
        pars = {path: found[path].par for path in self.paths}
        return {
            path: (float(par.given(found[path].value)), par.read_in) for path, par in pars.items()
        }

    def runs(self, trees: Sequence[Any], seeds: Sequence[int], workers: int) -> list[Figures]:
        """Figures of runs, in threads; compiled runs release the lock."""
        return trials(self.run, trees, seeds, workers)

    def weights(self, asked: Mapping[str, float]) -> dict[str, float]:
        """Check the weights of penalties that a user asks for."""
        objectives = [*self.objectives, *(o for _, part in self.parts for o in part.objectives)]
        known = list(dict.fromkeys(p.name for o in objectives for p in o.penalties))
        for name, weight in asked.items():
            where = f"--penalty {printable(name)}"
            if name not in known:
                raise ProblemError(where, "unknown penalty", f"Accepted: {', '.join(known)}.")
            if not 0.0 <= weight <= MOST:
                raise InputError(where, weight, f"a number from 0 to {MOST:g}")
        return dict(asked)
