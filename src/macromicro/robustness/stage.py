"""Robustness of a machine of one stage under its nominal law, motion and guard."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.machines import owned
from macromicro.machines.joint.machine import Joint
from macromicro.machines.joint.trial import JointTrial
from macromicro.machines.machine import Machine
from macromicro.machines.sequence import Plan
from macromicro.machines.trial import Trial, trials
from macromicro.robustness._statistics import Share, share
from macromicro.robustness.requirements import Requirement
from macromicro.schema.keys import nearest
from macromicro.schema.par import entries, value_at
from macromicro.schema.text import printable
from macromicro.uncertainty.machines import counted, draw, settings_at
from macromicro.uncertainty.table import Uncertain, read

KEPT = ("controller", "guard", "motion", "arrival", "travel")


class Study(NamedTuple):
    machine: Machine | Joint
    rows: tuple[Uncertain, ...]  # what was varied
    amounts: Array  # of each machine
    nominal: Trial | JointTrial  # of the settings themselves
    found: Sequence[Trial | JointTrial]  # of the machines, perhaps fewer than were drawn
    asked: int  # machines that were drawn
    seed: int  # of the draw
    required: tuple[Requirement, ...] = ()  # limits on the figures of a run

    @property
    def arrives(self) -> Share:
        """Share of the machines on which every move arrives and no fault stops the run."""
        good = sum(t.fault == 0.0 and t.missed == 0.0 for t in self.found)
        return share(good, len(self.found))

    def met(self, *required: Requirement) -> Share:
        """Share of the machines that meet requirements; unknown metrics count as not met."""
        good = sum(all(getattr(t, r.metric.name) <= r.limit for r in required) for t in self.found)
        return share(good, len(self.found))


def uncertain(machine: Machine, settings: Any) -> tuple[Uncertain, ...]:
    """The uncertain parameters that a machine has."""
    if machine.spread is None:
        raise ProblemError(
            "--config",
            f"the machine {machine.name} has no table of uncertain parameters (`spread`)",
        )
    rows = owned.uncertain(settings, read(machine.spread))
    known = {e.path for e in entries(settings) if e.number}
    for row in rows:
        for path, _ in row.parts:
            if path not in known:
                where = f"{printable(machine.spread, 300)}, {row.name}, {printable(path)}"
                raise ProblemError(where, "unknown key", f"Accepted: {nearest(path, known)}.")
    return tuple(r for r in rows if any(value_at(settings, path) != 0.0 for path, _ in r.parts))


def machines(
    settings: Any, rows: Sequence[Uncertain], n: int, seed: int
) -> tuple[Array, list[Any]]:
    amounts = draw(settings, rows, n, seed).amounts
    own = {name: getattr(settings, name) for name in KEPT}
    return amounts, [settings_at(settings, rows, each)._replace(**own) for each in amounts]


def study(
    machine: Machine,
    settings: Any,
    plan: Plan,
    samples: int,
    seed: int,
    workers: int,
    done: Callable[[int], bool] = lambda n: False,
) -> Study:
    counted(samples)
    rows = uncertain(machine, settings)
    amounts, trees = machines(settings, rows, samples, seed)
    seeds = [seed, *(seed + k for k in range(samples))]
    found = trials(machine, [settings, *trees], plan, seeds, workers, done)
    return Study(machine, rows, amounts, found[0], found[1:], samples, seed)
