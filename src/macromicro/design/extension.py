"""The micro-stage's return to zero, and the bias of a late return.

Section 6.3: over repeated cycles the actuator warms and extends more slowly. The laser is
reset after every macro move, so the remaining contraction becomes a bias of all later laser
readings.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import spans
from macromicro.control.supervisor import DONE, MICRO
from macromicro.design.response import MoveResult
from macromicro.recording import Recording

RETURNED = 20.0


class Extension(NamedTuple):
    """One return to zero of the micro-stage."""

    move: int  #: the micro move that it ends
    start_s: float  #: when it is disabled, s
    from_um: float  #: Hall position then, um
    #: after which it stays within 20 um of zero, s; None: not before it is enabled again or the
    #: recording ends
    time_s: float | None
    #: mean Hall position of the last 20 ms before that end, which is where the laser is reset, um
    left_um: float


class Cycle(NamedTuple):
    """A cycle's returns to zero and its bias; None where there are none."""

    cycle: int  #: number, from 1
    returns: int  #: how many
    extension_s: float | None  #: mean time, s
    slowest_s: float | None  #: longest time, s
    left_um: float | None  #: mean of what was left, um
    bias_um: float | None  #: mean final error by the laser, um
    true_bias_um: float | None  #: the same by the bench's truth, um


def extension(recording: Recording) -> list[Extension]:
    """Every return to zero of a recording, from more than 20 um (Section 6.3).

    Parameters
    ----------
    recording : Recording
        Recording of a run.

    Returns
    -------
    list[Extension]
        In order of time.

    Examples
    --------
    >>> from macromicro.design.extension import extension
    >>> from macromicro.recording import Column, Recording
    >>> rows = [[0.0, 1.0, 2.0, 3.0], [3, 2, 2, 2], [0, 0, 0, 0], [0.5, 0.4, 0.1, 0.01]]
    >>> names = "t", "phase", "move", "hall_position"  # phase 3: the micro-stage is enabled
    >>> run = Recording.from_arrays([Column(n, "-", n) for n in names], rows, 1.0, {})
    >>> extension(run)
    [Extension(move=0, start_s=1.0, from_um=400.0, time_s=2.0, left_um=170.0)]
    """
    phase = recording["phase"]
    enabled = spans(phase == MICRO)
    found = []
    ends = [*(on for on, _ in enabled[1:]), len(phase)]
    for (_, off), until in zip(enabled, ends, strict=False):
        if off >= len(phase) or phase[off] == DONE:
            continue
        held = "micro_reference" in recording
        if held and np.any(recording["micro_reference"][off:until] != 0.0):
            continue  # it keeps a set point, and does not return
        place = 1e3 * recording["hall_position"][off:until]
        if not abs(place[0]) > RETURNED:
            continue
        outside = np.flatnonzero(~(np.abs(place) <= RETURNED))
        last = int(outside[-1]) + 1
        found.append(
            Extension(
                move=int(recording["move"][off - 1]),
                start_s=round(float(recording["t"][off]), 9),
                from_um=float(place[0]),
                time_s=round(last * recording.dt, 9) if last < len(place) else None,
                left_um=float(place[-round(0.02 / recording.dt) :].mean()),
            )
        )
    return found


def per_cycle(
    moves: Sequence[MoveResult], returns: Sequence[Extension], moves_per_cycle: int
) -> list[Cycle]:
    """The returns and the bias of every cycle that was begun.

    Parameters
    ----------
    moves : Sequence[MoveResult]
        Moves of the recording.
    returns : Sequence[Extension]
        Returns of the recording.
    moves_per_cycle : int
        Number of moves of the programme.

    Returns
    -------
    list[Cycle]
        In order.

    Examples
    --------
    >>> from macromicro.design.extension import Extension, per_cycle
    >>> from macromicro.design.response import MoveResult
    >>> first = MoveResult(1, "micro", 500.0, "um", 2.0, 2.5, 0.5, 10.0, 1.5, *[None] * 5, True)
    >>> back = Extension(move=1, start_s=4.0, from_um=500.0, time_s=1.2, left_um=3.0)
    >>> (cycle,) = per_cycle([first], [back], moves_per_cycle=2)
    >>> cycle.extension_s, cycle.bias_um
    (1.2, 1.5)
    """
    count = max((m.move for m in moves), default=-1) // moves_per_cycle + 1
    cycles = []
    for k in range(count):
        own = [r for r in returns if r.move // moves_per_cycle == k]
        times = [r.time_s for r in own if r.time_s is not None]
        fine = [m for m in moves if m.stage == "micro" and m.move // moves_per_cycle == k]
        cycles.append(
            Cycle(
                cycle=k + 1,
                returns=len(own),
                extension_s=_mean(times) if len(times) == len(own) else None,
                slowest_s=max(times) if times and len(times) == len(own) else None,
                left_um=_mean([r.left_um for r in own]),
                bias_um=_mean([m.final_error for m in fine if m.final_error is not None]),
                true_bias_um=_mean([m.true_error for m in fine if m.true_error is not None]),
            )
        )
    return cycles


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None
