"""Robustness of a machine of two axes: both differ from their sheets, and stand less square.

Each axis is drawn as one alone (`robustness.stage`), independently of the other. Law, motion, guard
and what counts as arrived stay those of the nominal settings, and so does the plan.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from macromicro.arrays import Array
from macromicro.batch.stage_job import told
from macromicro.batch.variants import Metric
from macromicro.machines.joint.machine import Joint
from macromicro.machines.joint.planning import JointPlan
from macromicro.machines.joint.settings import AXES, NOTHING, of
from macromicro.machines.joint.trial import JointTrial, trials
from macromicro.robustness import stage
from macromicro.robustness.requirements import Requirement
from macromicro.robustness.stage import KEPT, Study
from macromicro.uncertainty.machines import counted, draw, settings_at
from macromicro.uncertainty.table import Uncertain, read

METRICS: tuple[Metric, ...] = told(JointTrial)


def uncertain(machine: Joint, settings: Any) -> tuple[Uncertain, ...]:
    """What is not known about both axes, and about how they stand.

    Parameters
    ----------
    machine : Joint
        The machine.
    settings : Any
        Its settings.

    Returns
    -------
    tuple[Uncertain, ...]
        The rows of each axis with its letter in front of names and paths, then those of the pair.
    """
    rows: list[Uncertain] = []
    for name, own, tree in zip(AXES, machine.axes, of(settings), strict=True):
        for row in stage.uncertain(own, tree):
            parts = tuple((f"{name}.{path}", weight) for path, weight in row.parts)
            meaning = f"{name}: {row.meaning}"
            rows.append(row._replace(name=f"{name}_{row.name}", parts=parts, meaning=meaning))
    alone = settings.stack.carries == NOTHING
    rows += [row for row in read(machine.spread) if not (alone and row.name == "body")]
    return tuple(rows)


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
        Settings, with the nominal law, motion, guard and arrival of each axis.
    """
    amounts = draw(settings, rows, n, seed).amounts

    def drawn(each: Array) -> Any:
        tree = settings_at(settings, rows, each)
        kept = {
            name: getattr(tree, name)._replace(**{k: getattr(own, k) for k in KEPT})
            for name, own in zip(AXES, of(settings), strict=True)
        }
        return tree._replace(**kept)

    return amounts, [drawn(each) for each in amounts]


def required(settings: Any) -> tuple[Requirement, ...]:
    """What is required unless a file says otherwise: the tolerance of the contour.

    Parameters
    ----------
    settings : Any
        Of the machine.

    Returns
    -------
    tuple[Requirement, ...]
        By the encoders, as the machine would be measured by itself.
    """
    metric = next(m for m in METRICS if m.name == "contour")
    return (Requirement(metric, 1e6 * settings.path.tolerance, "path.tolerance"),)


def study(
    machine: Joint,
    settings: Any,
    plan: JointPlan,
    samples: int,
    seed: int,
    workers: int,
    done: Callable[[int], bool] = lambda n: False,
) -> Study:
    """Run a plan on machines that differ from their sheets.

    Parameters
    ----------
    machine : Joint
        The machine.
    settings : Any
        The nominal one.
    plan : JointPlan
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
        Too few or too many samples.
    """
    counted(samples)
    rows = uncertain(machine, settings)
    amounts, trees = machines(settings, rows, samples, seed)
    seeds = [seed, *(seed + k for k in range(samples))]
    found = trials(machine, [settings, *trees], plan, seeds, workers, done)
    return Study(machine, rows, amounts, found[0], found[1:], samples, seed)
