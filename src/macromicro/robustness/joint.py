"""Robustness of a machine of two axes, whose squareness varies as well.

Each axis is drawn independently, as in `robustness.stage`. Law, plan, guard and arrival
stay those of the nominal settings.
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
    """Uncertain parameters of both axes and of their squareness."""
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
    """Default requirements: the tolerance of the contour."""
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
    counted(samples)
    rows = uncertain(machine, settings)
    amounts, trees = machines(settings, rows, samples, seed)
    seeds = [seed, *(seed + k for k in range(samples))]
    found = trials(machine, [settings, *trees], plan, seeds, workers, done)
    return Study(machine, rows, amounts, found[0], found[1:], samples, seed)
