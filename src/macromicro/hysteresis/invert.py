"""The way back: which input brings the output to a target, solved cell by cell.

Along a branch of (2.11) only one argument of E changes, and within a cell of the table E
is linear in it. So the branch is a polygon with its corners on the grid lines, and the
input for a target is found on one straight piece of it, without iteration.
"""

from __future__ import annotations

import math

from macromicro.arrays import Array
from macromicro.hysteresis.everett import Everett, lookup
from macromicro.hysteresis.memory import AT_DOWN, AT_UP, DOWN, UP, Memory, advance
from macromicro.kernel import kernel

# Targets this near are reached: rounding must not send the input across a flat piece.
NEAR = 1e-15


@kernel
def invert(table: Everett, memory: Memory, target: float) -> float:
    """The input that brings the output to `target` in one move from the present state.

    First the corners are passed that the move wipes out, then the grid lines up to the piece that
    holds the target.

    Parameters
    ----------
    table : Everett
        Relay weights of the model.
    memory : Memory
        The present state; not changed. Its stack must not be full.
    target : float
        Output, 0 to 1.

    Returns
    -------
    float
        Unit of the input. Beyond the saturations: the input of the saturation; for NaN the present
        input.
    """
    k = memory.pairs
    now = float(memory.corners[k, AT_DOWN])
    if target > now + NEAR:
        start = memory.u
        while k > 0 and memory.corners[k, AT_UP] < target - NEAR:
            start = float(memory.corners[k, UP])
            k -= 1
        end = min(float(memory.corners[k, UP]), table.lo + (table.n - 1) * table.step)
        low = float(memory.corners[k, DOWN])
        base = float(memory.corners[k, AT_DOWN])
        here = base + lookup(table, start, low)
        i = int((start - table.lo) / table.step)
        while start < end:
            i += 1
            line = min(table.lo + i * table.step, end)
            if line > start:
                there = base + lookup(table, line, low)
                if there >= target - NEAR:
                    return _between(start, line, here, there, target)
                start, here = line, there
        return end
    if target < now - NEAR:
        start = memory.u
        while k > 1 and memory.corners[k - 1, AT_DOWN] > target + NEAR:
            k -= 1
            start = float(memory.corners[k, DOWN])
        end = max(float(memory.corners[k - 1, DOWN]), table.lo)
        high = float(memory.corners[k, UP])
        base = float(memory.corners[k, AT_UP])
        here = base - lookup(table, high, start)
        i = math.ceil((start - table.lo) / table.step)
        while start > end:
            i -= 1
            line = max(table.lo + i * table.step, end)
            if line < start:
                there = base - lookup(table, high, line)
                if there <= target + NEAR:
                    return _between(start, line, here, there, target)
                start, here = line, there
        return end
    return memory.u


@kernel
def _between(start: float, end: float, here: float, there: float, target: float) -> float:
    """The input between `start` and `end` at which the straight piece meets the target."""
    if there == here:
        return start
    share = min(max((target - here) / (there - here), 0.0), 1.0)
    return start + share * (end - start)


@kernel
def maximum_for(table: Everett, u: float, target: float) -> float:
    """The maximum M from which a fall to `u` ends at `target`: E(M, lo) - E(M, u) = target.

    The history is: negative saturation, rise to M, fall to `u`.

    Parameters
    ----------
    table : Everett
        Relay weights of the model.
    u : float
        Input at the end, clamped to the table.
    target : float
        Output, 0 to 1.

    Returns
    -------
    float
        Unit of the input; NaN if no M reaches the target.
    """
    hi = table.lo + (table.n - 1) * table.step
    start = min(max(u, table.lo), hi)
    here = lookup(table, start, table.lo)
    if target == here:
        return start
    i = int((start - table.lo) / table.step)
    while start < hi:
        i += 1
        line = min(table.lo + i * table.step, hi)
        if line > start:
            there = lookup(table, line, table.lo) - lookup(table, line, u)
            if min(here, there) <= target <= max(here, there):
                return _between(start, line, here, there, target)
            start, here = line, there
    return math.nan


@kernel
def follow(
    table: Everett,
    memory: Memory,
    inputs: Array,
    outputs: Array,
    first: int,
    scale: float,
    offset: float,
) -> tuple[Memory, int]:
    """Outputs along inputs, from one sample on; stops before a full stack.

    Parameters
    ----------
    table : Everett
        Relay weights of the model.
    memory : Memory
        State at the start; its array is changed.
    inputs : ndarray, shape (m,)
        Unit of the input.
    outputs : ndarray, shape (m,)
        Written here: ``f * scale + offset``.
    first : int
        Sample to begin with.
    scale, offset : float
        From an output of 0 to 1 to the unit of `outputs`.

    Returns
    -------
    memory : Memory
        The state at the end.
    done : int
        The first sample that is not done.
    """
    for t in range(first, inputs.shape[0]):
        if memory.pairs >= memory.corners.shape[0] - 1:
            return memory, t
        memory, f = advance(table, memory, float(inputs[t]))
        outputs[t] = f * scale + offset
    return memory, inputs.shape[0]


@kernel
def follow_inverse(
    table: Everett, memory: Memory, targets: Array, inputs: Array, outputs: Array, first: int
) -> tuple[Memory, int]:
    """The input for each target in turn, and the output that it gives; stops before a full stack.

    Parameters
    ----------
    table : Everett
        Relay weights of the model.
    memory : Memory
        State at the start; its array is changed.
    targets : ndarray, shape (m,)
        Outputs, 0 to 1.
    inputs : ndarray, shape (m,)
        Written here, unit of the input.
    outputs : ndarray, shape (m,)
        Written here, 0 to 1.
    first : int
        Sample to begin with.

    Returns
    -------
    memory : Memory
        The state at the end.
    done : int
        The first sample that is not done.
    """
    for t in range(first, targets.shape[0]):
        if memory.pairs >= memory.corners.shape[0] - 1:
            return memory, t
        u = invert(table, memory, float(targets[t]))
        memory, f = advance(table, memory, u)
        inputs[t] = memory.u
        outputs[t] = f
    return memory, targets.shape[0]
