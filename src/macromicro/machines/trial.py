"""Results of a single-stage run as figures, for tuning and robustness."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Annotated, Any, NamedTuple, TypeVar

import numpy as np

from macromicro.columns import Quantity
from macromicro.machines import results, runs
from macromicro.machines.machine import Machine
from macromicro.machines.sequence import Plan
from macromicro.recording import Recording

Found = TypeVar("Found")


class Trial(NamedTuple):
    """Results of a run in um (mdeg if rotary); infinity: no arrival; NaN: stopped by the guard."""

    fault: Annotated[float, Quantity("1", "code of the fault that stopped the run, 0 for none")]
    missed: Annotated[float, Quantity("1", "moves that did not arrive")]
    settling: Annotated[
        float, Quantity("s", "slowest arrival, counted from the end of the profile")
    ]
    mean_settling: Annotated[float, Quantity("s", "mean of the same")]
    peak_error: Annotated[
        float, Quantity("um", "largest distance from the set point during the move")
    ]
    rms_error: Annotated[float, Quantity("um", "rms of the same, over all moves")]
    overshoot: Annotated[float, Quantity("um", "largest overshoot behind the end of a profile")]
    rest_error: Annotated[float, Quantity("um", "largest error at rest, by the encoder")]
    true_error: Annotated[float, Quantity("um", "largest error at rest, true")]
    effort: Annotated[float, Quantity("V", "largest effort")]
    rough: Annotated[float, Quantity("V", "rms change of the effort from period to period")]


def trial(machine: Machine, settings: Any, plan: Plan, seed: int) -> Trial:
    blocks = runs.Blocks()
    outcome = runs.perform(machine, settings, plan, blocks, seed=seed)
    rows = np.concatenate(blocks.blocks, axis=1)
    recording = Recording.from_arrays(runs.columns(machine), rows, settings.timing.period, {})
    moves = results.moves(recording, plan, settings.arrival, machine.kind.place)
    effort = recording["effort"]
    arrived = results.settling(moves)
    whole = outcome.watch.fault == 0 and len(moves) == len(plan.target)

    def most(values: Iterator[float | None]) -> float:
        known = [abs(v) for v in values if v is not None]
        return 1e3 * max(known, default=0.0) if whole else math.nan

    return Trial(
        fault=float(outcome.watch.fault),
        missed=float(len(plan.target) - results.arrived(moves)),
        settling=max(0.0, *arrived) if whole else math.nan,
        mean_settling=max(0.0, float(np.mean(arrived))) if whole else math.nan,
        peak_error=most(m.peak_error for m in moves),
        rms_error=1e3 * float(np.sqrt(np.mean([m.rms_error**2 for m in moves])))
        if whole
        else math.nan,
        overshoot=most(m.overshoot for m in moves),
        rest_error=most(m.rest_error for m in moves),
        true_error=most(m.true_error for m in moves),
        effort=float(np.max(np.abs(effort))),
        rough=float(np.sqrt(np.mean(np.diff(effort) ** 2))) if len(effort) > 1 else 0.0,
    )


def trials(
    machine: Machine,
    trees: Sequence[Any],
    plan: Plan,
    seeds: Sequence[int],
    workers: int,
    done: Callable[[int], bool] = lambda n: False,
) -> list[Trial]:
    """Run a plan on many machines, in threads; compiled runs release the lock."""
    if trees:
        runs.compile_machine(machine, trees[0], plan)
    return threaded(
        lambda tree, seed: trial(machine, tree, plan, seed), trees, seeds, workers, done
    )


def threaded(
    run: Callable[[Any, int], Found],
    trees: Sequence[Any],
    seeds: Sequence[int],
    workers: int,
    done: Callable[[int], bool] = lambda n: False,
) -> list[Found]:
    found: list[Found] = []
    with ThreadPoolExecutor(workers) as pool:
        waiting = [pool.submit(run, *pair) for pair in zip(trees, seeds, strict=True)]
        for each in waiting:
            found.append(each.result())
            if done(len(found)):
                for rest in waiting:
                    rest.cancel()
                break
    return found
