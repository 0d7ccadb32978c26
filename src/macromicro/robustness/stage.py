"""Robustness of a machine of one stage: machines that differ from its sheets under its own law.

The law, the motion, the guard and what counts as arrived stay those of the nominal settings: nobody
knows the machine that was drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.machines import owned
from macromicro.machines.joint.machine import Joint
from macromicro.machines.joint.trial import JointTrial
from macromicro.machines.machine import Machine
from macromicro.machines.sequence import Plan
from macromicro.machines.trial import Trial, trials
from macromicro.robustness.requirements import Requirement
from macromicro.robustness.statistics import Share, share
from macromicro.schema.keys import nearest
from macromicro.schema.par import entries, value_at
from macromicro.schema.text import printable
from macromicro.uncertainty.machines import counted, draw, settings_at
from macromicro.uncertainty.table import Uncertain, read

KEPT = ("controller", "guard", "motion", "arrival", "travel")


class Study(NamedTuple):
    """What was found.

    Attributes
    ----------
    machine : Machine | Joint
        The machine.
    rows : tuple[Uncertain, ...]
        What was varied.
    amounts : ndarray, shape (n, rows)
        Of each machine.
    nominal : Trial | JointTrial
        Of the settings themselves.
    found : Sequence[Trial | JointTrial]
        Of the machines, perhaps fewer than were drawn.
    asked : int
        Machines that were drawn.
    seed : int
        Of the draw.
    required : tuple[Requirement, ...]
        Limits on the figures of a run.
    """

    machine: Machine | Joint
    rows: tuple[Uncertain, ...]
    amounts: Array
    nominal: Trial | JointTrial
    found: Sequence[Trial | JointTrial]
    asked: int
    seed: int
    required: tuple[Requirement, ...] = ()

    @property
    def arrives(self) -> Share:
        """Share of the machines on which every move arrives and no fault stops the run."""
        good = sum(t.fault == 0.0 and t.missed == 0.0 for t in self.found)
        return share(good, len(self.found))

    def met(self, *required: Requirement) -> Share:
        """Share of the machines that meet requirements; what is not known is not met.

        Parameters
        ----------
        *required : Requirement
            All of which are to be met.

        Returns
        -------
        Share
            With its interval.
        """
        good = sum(all(getattr(t, r.metric.name) <= r.limit for r in required) for t in self.found)
        return share(good, len(self.found))


def uncertain(machine: Machine, settings: Any) -> tuple[Uncertain, ...]:
    """What is not known about a machine, of what it has.

    Parameters
    ----------
    machine : Machine
        The machine.
    settings : Any
        Its settings.

    Returns
    -------
    tuple[Uncertain, ...]
        Rows of its table of which some parameter is not 0.

    Raises
    ------
    InputError
        There is no such table for this machine.
    """
    if machine.spread is None:
        accepted = "a machine with a table of what is not known (its `spread`)"
        raise InputError("--config", machine.name, accepted)
    rows = owned.uncertain(settings, read(machine.spread))
    known = {e.path for e in entries(settings) if e.number}
    for row in rows:
        for path, _ in row.parts:
            if path not in known:
                where = f"{printable(machine.spread, 300)}, {row.name}, {printable(path)}"
                raise InputError(where, "unknown key", nearest(path, known))
    return tuple(r for r in rows if any(value_at(settings, path) != 0.0 for path, _ in r.parts))


def machines(
    settings: Any, rows: Sequence[Uncertain], n: int, seed: int
) -> tuple[Array, list[Any]]:
    """Draw machines around settings that control them.

    Parameters
    ----------
    settings : Any
        The nominal machine.
    rows : Sequence[Uncertain]
        What is not known.
    n : int
        How many.
    seed : int
        Of the draw.

    Returns
    -------
    amounts : ndarray, shape (n, rows)
        Of each row.
    trees : list[Any]
        Settings, with the nominal law, motion, guard and arrival.
    """
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
    """Run a plan on machines that differ from their sheets.

    Parameters
    ----------
    machine : Machine
        The machine.
    settings : Any
        The nominal one.
    plan : Plan
        What is to be run.
    samples : int
        Machines (`uncertainty.machines.counted`).
    seed : int
        Of the draw and the noise.
    workers : int
        Threads.
    done : Callable[[int], bool], optional
        Hears runs done; when it answers True, the rest is left out.

    Returns
    -------
    Study
        What was found.

    Raises
    ------
    InputError
        Too few or too many samples, or no table for this machine.
    """
    counted(samples)
    rows = uncertain(machine, settings)
    amounts, trees = machines(settings, rows, samples, seed)
    seeds = [seed, *(seed + k for k in range(samples))]
    found = trials(machine, [settings, *trees], plan, seeds, workers, done)
    return Study(machine, rows, amounts, found[0], found[1:], samples, seed)
