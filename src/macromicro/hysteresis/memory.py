"""The memory of a Preisach hysteresis: the input's reversals that still matter.

The corners (M_k, m_k) of Figure 2.17 are kept in a stack with M_1 > M_2 > ... and
m_1 < m_2 < ... ; the last pair ends at the present input: m_n = u, and after a rise
M_n = m_n = u. With the table E of `everett`, m_0 = lo, and the output counted from 0
(all relays down) to 1 (all up), (2.11) becomes

    f = sum over k of E(M_k, m_(k-1)) - E(M_k, m_k),

because f_{M,m} = f_M - E(M, m). The running sums are kept, so that a step looks up one
value of E and a wiped-out corner (a larger maximum or a smaller minimum) is just popped.
A sum always starts from the bottom of the stack, so it does not drift.

Inputs beyond the table count as its ends, which are the saturations. A NaN is ignored:
memory and output stay as they are.

A full stack: the innermost loop, which is the narrowest, loses its width. The input then
rises back along the descending curve that it came down, up to the corner that it left,
where the true curve meets it again. The output stays continuous, monotone and within 0
and 1, is wrong by at most the weight E(M_n, m_n) of that loop, and is exact again as soon
as the loop is wiped out.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis.everett import Everett, lookup
from macromicro.kernel import kernel

DEPTH = 256
# Columns of the stack.
UP, DOWN, AT_UP, AT_DOWN = 0, 1, 2, 3


class Memory(NamedTuple):
    """The corners and the output at each of them. `advance` writes into the array.

    Attributes
    ----------
    corners : ndarray, shape (depth + 1, 4)
        Row k holds M_k, m_k (unit of the input), the output when the input reached M_k and the
        output at m_k (0 to 1). Row 0 is negative saturation. One array, because compiled code
        passes one at less cost than four.
    pairs : int
        Rows in use beside row 0, at least 1.
    u : float
        Present input, clamped to the table.
    """

    corners: Array
    pairs: int
    u: float


@kernel
def _reached(table: Everett, memory: Memory, u: float) -> float:
    """The input that counts: `u` clamped to the table, the present input for NaN."""
    if math.isnan(u):
        return memory.u
    return min(max(u, table.lo), table.lo + (table.n - 1) * table.step)


# The search for the rows that remain and the branch from there are written out in each
# kernel below: as functions of their own they would double the time (counted references
# to the arrays). On a rise the maxima up to u are wiped out, then the branch starts at the
# minimum of the row on top. On a fall the minima down to u are, and the branch starts at
# the maximum of the row on top, whose minimum u replaces. Row 0 is infinitely wide, so
# neither search leaves the array. A rise that finds no free row retraces the fall.


@kernel
def peek(table: Everett, memory: Memory, u: float) -> float:
    """Output if the input moved straight from its present value to `u` (2.11).

    Time is constant but for the corners that the move would wipe out.

    Parameters
    ----------
    table : Everett
        Relay weights of the model.
    memory : Memory
        The present state; not changed.
    u : float
        Unit of the input.

    Returns
    -------
    float
        0 to 1.
    """
    v = _reached(table, memory, u)
    k = memory.pairs
    if v > memory.u:
        while memory.corners[k, UP] <= v:
            k -= 1
        if k < memory.corners.shape[0] - 1:
            return min(
                float(memory.corners[k, AT_DOWN])
                + lookup(table, v, float(memory.corners[k, DOWN])),
                1.0,
            )
    elif v < memory.u:
        while memory.corners[k - 1, DOWN] >= v:
            k -= 1
    else:
        return float(memory.corners[k, AT_DOWN])
    return max(
        float(memory.corners[k, AT_UP]) - lookup(table, float(memory.corners[k, UP]), v), 0.0
    )


@kernel
def advance(table: Everett, memory: Memory, u: float) -> tuple[Memory, float]:
    """Move the input straight to `u` (2.11).

    Amortised constant time: each corner is pushed once and popped once.

    Parameters
    ----------
    table : Everett
        Relay weights of the model.
    memory : Memory
        The present state. Its array is changed in place, so it must not be used again.
    u : float
        Unit of the input; NaN moves nothing.

    Returns
    -------
    memory : Memory
        The state after the move.
    f : float
        The output, 0 to 1.
    """
    # Rows of the stack, for inputs 0 -> 8 -> 2 -> 6 -> 3 -> u: (8, 2), (6, 3), nested intervals.
    # A rise to u = 5 stays inside the last one and opens (5, 5): f = f(3) + E(5, 3). One to u = 7
    # passes 6, which from then on is as if it had never been: (6, 3) is popped,
    # and the branch is that which left the corner at 2: f = f(2) + E(7, 2). A fall mirrors this
    # with the minima, and moves the present end of the last row: f = f(M) - E(M, u).
    # Each row keeps the outputs at its two corners, so a branch needs one value of E.
    v = _reached(table, memory, u)
    k = memory.pairs
    if v > memory.u:
        while memory.corners[k, UP] <= v:
            k -= 1
        if k < memory.corners.shape[0] - 1:
            f = min(
                float(memory.corners[k, AT_DOWN])
                + lookup(table, v, float(memory.corners[k, DOWN])),
                1.0,
            )
            k += 1
            memory.corners[k, UP] = v
            memory.corners[k, AT_UP] = f
        else:
            f = max(
                float(memory.corners[k, AT_UP]) - lookup(table, float(memory.corners[k, UP]), v),
                0.0,
            )
    elif v < memory.u:
        while memory.corners[k - 1, DOWN] >= v:
            k -= 1
        f = max(
            float(memory.corners[k, AT_UP]) - lookup(table, float(memory.corners[k, UP]), v), 0.0
        )
    else:
        f = float(memory.corners[k, AT_DOWN])
    memory.corners[k, DOWN] = v
    memory.corners[k, AT_DOWN] = f
    return Memory(memory.corners, k, v), f


def fresh(table: Everett, u: float, depth: int = DEPTH) -> Memory:
    """A memory that has risen to an input from negative saturation (all relays down).

    Parameters
    ----------
    table : Everett
        Relay weights of the model.
    u : float
        Input, clamped to the table.
    depth : int, optional
        Number of pairs that it can hold.

    Returns
    -------
    Memory
        With one pair in use.

    Raises
    ------
    InputError
        `u` is NaN, or `depth` is below 1.
    """
    if depth < 1:
        raise InputError("hysteresis memory, depth", depth, "at least 1 pair of reversals")
    if math.isnan(u):
        raise InputError("hysteresis memory, input", u, "a number")
    corners = np.zeros((depth + 1, 4))
    corners[0] = (math.inf, -math.inf, 0.0, 0.0)
    memory, _ = advance(table, Memory(corners, 0, -math.inf), float(u))
    return memory
