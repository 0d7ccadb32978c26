"""Robustness of a machine under its nominal law, motion and guard.

Each stage of several is drawn independently.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from macromicro.arrays import Array
from macromicro.batch.stage_job import metrics
from macromicro.errors import ProblemError
from macromicro.machines.composite import AnyMachine, names
from macromicro.machines.joint.settings import NOTHING
from macromicro.machines.machine import Machine
from macromicro.machines.planning import Planned
from macromicro.machines.trial import trials
from macromicro.robustness.requirements import Requirement
from macromicro.robustness.statistics import Share, share
from macromicro.schema.keys import nearest
from macromicro.schema.par import entries, value_at
from macromicro.schema.text import printable
from macromicro.uncertainty.machines import counted, draw, settings_at
from macromicro.uncertainty.table import Uncertain, read

KEPT = ("controller", "guard", "motion", "arrival", "travel")


class Study(NamedTuple):
    machine: AnyMachine
    rows: tuple[Uncertain, ...]  # what was varied
    amounts: Array  # of each machine
    nominal: Any  # figures of the settings themselves (`trial.kind`)
    found: Sequence[Any]  # of the machines, perhaps fewer than were drawn
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


def uncertain(machine: AnyMachine, settings: Any) -> tuple[Uncertain, ...]:
    """The uncertain parameters that a machine has: of each stage, and those of several."""
    if isinstance(machine, Machine):
        return _of_stage(machine, settings)
    rows: list[Uncertain] = []
    for (name, one), tree in zip(machine.stages, machine.trees(settings), strict=True):
        for row in _of_stage(one, tree):
            parts = tuple((f"{name}.{path}", weight) for path, weight in row.parts)
            meaning = f"{name}: {row.meaning}"
            rows.append(row._replace(name=f"{name}_{row.name}", parts=parts, meaning=meaning))
    stack = getattr(settings, "stack", None)
    alone = stack is not None and stack.carries == NOTHING
    shared = () if machine.spread is None else read(machine.spread)
    return (*rows, *(row for row in shared if not (alone and row.name == "body")))


def _of_stage(machine: Machine, settings: Any) -> tuple[Uncertain, ...]:
    if machine.spread is None:
        raise ProblemError(
            "--config",
            f"the machine {machine.name} has no table of uncertain parameters (`spread`)",
        )
    rows = read(machine.spread)
    known = {e.path for e in entries(settings) if e.number}
    for row in rows:
        for path, _ in row.parts:
            if path not in known:
                where = f"{printable(machine.spread, 300)}, {row.name}, {printable(path)}"
                raise ProblemError(where, "unknown key", f"Accepted: {nearest(path, known)}.")
    return tuple(r for r in rows if any(value_at(settings, path) != 0.0 for path, _ in r.parts))


def machines(
    machine: AnyMachine, settings: Any, rows: Sequence[Uncertain], n: int, seed: int
) -> tuple[Array, list[Any]]:
    """Drawn machines under the law, plan, guard and arrival of the settings."""
    amounts = draw(settings, rows, n, seed).amounts
    return amounts, [_kept(machine, settings, settings_at(settings, rows, a)) for a in amounts]


def _kept(machine: AnyMachine, settings: Any, drawn: Any) -> Any:
    """A drawn machine with what stays nominal."""
    pairs = zip(machine.trees(settings), machine.trees(drawn), strict=True)
    trees = [tree._replace(**{k: getattr(own, k) for k in KEPT}) for own, tree in pairs]
    if isinstance(machine, Machine):
        return trees[0]
    return drawn._replace(**dict(zip(names(machine), trees, strict=True)))


def required(machine: AnyMachine, settings: Any) -> tuple[Requirement, ...]:
    """Default requirements: of a machine with a plane, the tolerance of the contour."""
    if isinstance(machine, Machine) or not machine.has_plane:
        return ()
    metric = next(m for m in metrics(machine) if m.name == "contour")
    return (Requirement(metric, 1e6 * settings.path.tolerance, "path.tolerance"),)


def study(
    machine: AnyMachine,
    settings: Any,
    plan: Planned,
    samples: int,
    seed: int,
    workers: int,
    done: Callable[[int], bool] = lambda n: False,
) -> Study:
    counted(samples)
    rows = uncertain(machine, settings)
    amounts, trees = machines(machine, settings, rows, samples, seed)
    seeds = [seed, *(seed + k for k in range(samples))]
    found = trials(machine, [settings, *trees], plan, seeds, workers, done)
    return Study(machine, rows, amounts, found[0], found[1:], samples, seed)
