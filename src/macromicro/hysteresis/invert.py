"""Inverse of the table: the input for a target output."""

# Along a branch of (2.11) one argument of E changes, and within a cell E is linear in it. The
# branch is a polygon, so the input is found on one straight piece without iteration.

from __future__ import annotations

import math
from typing import Annotated

from macromicro.arrays import Array
from macromicro.columns import Meaning
from macromicro.hysteresis.everett import Everett, lookup
from macromicro.hysteresis.memory import AT_DOWN, AT_UP, DOWN, UP, Memory, advance
from macromicro.kernel import kernel

# Targets this near are reached: rounding must not send the input across a flat piece.
NEAR = 1e-15


@kernel
def invert(
    table: Everett, memory: Memory, target: Annotated[float, Meaning("output, 0 to 1")]
) -> Annotated[float, Meaning("input; that of the saturation beyond it")]:
    """The input that brings the output to `target` in one move from the present state."""
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
    if there == here:
        return start
    share = min(max((target - here) / (there - here), 0.0), 1.0)
    return start + share * (end - start)


@kernel
def maximum_for(
    table: Everett, u: float, target: Annotated[float, Meaning("output, 0 to 1")]
) -> Annotated[float, Meaning("input; NaN if no maximum reaches the target")]:
    """The maximum M from which a fall to `u` ends at `target`: E(M, lo) - E(M, u) = target."""
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
    """Outputs along inputs from one sample on; stops before a full stack."""
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
    """Inputs for targets and their outputs; stops before a full stack."""
    for t in range(first, targets.shape[0]):
        if memory.pairs >= memory.corners.shape[0] - 1:
            return memory, t
        u = invert(table, memory, float(targets[t]))
        memory, f = advance(table, memory, u)
        inputs[t] = memory.u
        outputs[t] = f
    return memory, targets.shape[0]
