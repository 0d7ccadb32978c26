"""Results of a two-axis run as figures, for tuning and robustness."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np

from macromicro.columns import Quantity
from macromicro.machines.guard_words import OTHER_AXIS
from macromicro.machines.joint import results, runs
from macromicro.machines.joint.machine import Joint
from macromicro.machines.joint.planning import JointPlan
from macromicro.machines.joint.settings import AXES
from macromicro.machines.results import arrived, settling
from macromicro.machines.trial import threaded
from macromicro.recording import Recording


class JointTrial(NamedTuple):
    """Results of a run; infinity: no arrival; NaN: stopped by a guard."""

    fault: Annotated[float, Quantity("1", "code of the fault that stopped the run, 0 for none")]
    missed: Annotated[float, Quantity("1", "moves that did not arrive")]
    contour: Annotated[float, Quantity("um", "largest distance from the path, by the encoders")]
    rms_contour: Annotated[float, Quantity("um", "rms of the same, over all moves")]
    true_contour: Annotated[float, Quantity("um", "largest distance from the path, true")]
    settling: Annotated[
        float, Quantity("s", "slowest arrival of both, counted from the end of the profile")
    ]
    peak_error_x: Annotated[float, Quantity("um", "largest distance from the set point, x")]
    peak_error_y: Annotated[float, Quantity("um", "the same, y")]
    true_error: Annotated[float, Quantity("um", "largest distance from the target at rest, true")]
    rough_x: Annotated[float, Quantity("V", "rms change of the effort from period to period, x")]
    rough_y: Annotated[float, Quantity("V", "the same, y")]


def trial(machine: Joint, settings: Any, plan: JointPlan, seed: int) -> JointTrial:
    done = runs.record(machine, settings, plan, seed=seed, warn=False)
    return measured(done.recording, done.outcome, plan, settings)


def measured(
    recording: Recording, outcome: runs.Outcome, plan: JointPlan, settings: Any
) -> JointTrial:
    moves = results.moves(recording, plan, settings)
    fault = next((w.fault for w in outcome.watches if w.fault not in (0, OTHER_AXIS)), 0)
    whole = fault == 0 and len(moves) == len(plan.legs)
    beside = [m.contour for m in moves if m.contour is not None]
    late = settling(moves)

    def most(values: Iterator[float | None]) -> float:
        known = [abs(v) for v in values if v is not None]
        return 1e3 * max(known, default=0.0) if whole else math.nan

    rough = [
        float(np.sqrt(np.mean(np.diff(recording[f"{name}_effort"]) ** 2)))
        if len(recording) > 1
        else 0.0
        for name in AXES
    ]
    squares = [c.rms**2 for c in beside]
    return JointTrial(
        fault=float(fault),
        missed=float(len(plan.legs) - arrived(moves)),
        contour=most(c.peak for c in beside),
        rms_contour=1e3 * math.sqrt(float(np.mean(squares))) if whole and squares else math.nan,
        true_contour=most(c.true_peak for c in beside),
        settling=max(0.0, *late) if whole else math.nan,
        peak_error_x=most(m.axes[0].peak_error for m in moves),
        peak_error_y=most(m.axes[1].peak_error for m in moves),
        true_error=most(m.true_error for m in moves),
        rough_x=rough[0],
        rough_y=rough[1],
    )


def trials(
    machine: Joint,
    trees: Sequence[Any],
    plan: JointPlan,
    seeds: Sequence[int],
    workers: int,
    done: Callable[[int], bool] = lambda n: False,
) -> list[JointTrial]:
    """Run a plan on many machines, in threads; compiled runs release the lock."""
    if trees:
        runs.compile_machine(machine, trees[0], plan)
    return threaded(
        lambda tree, seed: trial(machine, tree, plan, seed), trees, seeds, workers, done
    )
