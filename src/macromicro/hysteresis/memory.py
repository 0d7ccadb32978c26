"""Memory of a Preisach hysteresis: the reversals of the input that still matter.

With a stack of corners (M_k, m_k) (Figure 2.17), M falling and m rising, m_0 = lo, the last pair at
the present input, and outputs from 0 to 1, (2.11) becomes

    f = sum over k of E(M_k, m_(k-1)) - E(M_k, m_k).

Inputs beyond the table count as its ends; a NaN is ignored. With a full stack the innermost loop
loses its width: the output stays continuous, monotone and within 0 and 1, is wrong by at most
E(M_n, m_n), and is exact again once the loop is wiped out.
"""

# Running sums from the bottom of the stack are kept, so a step needs one value of E, a wiped-out
# corner is popped, and no error accumulates.

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.columns import Meaning
from macromicro.errors import InputError
from macromicro.hysteresis.everett import Everett, lookup
from macromicro.kernel import kernel

DEPTH = 256
# Columns of the stack.
UP, DOWN, AT_UP, AT_DOWN = 0, 1, 2, 3


class Memory(NamedTuple):
    """The corners and the output at each of them. `advance` writes into the array."""

    # Row 0 is negative saturation. One array, because compiled code passes one at less cost than
    # four.
    corners: Annotated[Array, Meaning("row k: M_k, m_k, output at M_k, output at m_k")]
    pairs: Annotated[int, Meaning("rows in use beside row 0, at least 1")]
    u: Annotated[float, Meaning("present input, clamped to the table")]


@kernel
def _reached(table: Everett, memory: Memory, u: float) -> float:
    """`u` clamped to the table, or the present input for NaN."""
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
def peek(table: Everett, memory: Memory, u: float) -> Annotated[float, Meaning("output, 0 to 1")]:
    """Output if the input moved straight from its present value to `u` (2.11).

    Parameters
    ----------
    table, memory : Everett, Memory
        Relay weights, and the present state, which is not changed.
    u : float
        Unit of the input.

    Returns
    -------
    float
        0 to 1.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.hysteresis import fresh, from_density, peek
    >>> table = from_density(lambda alpha, beta: np.ones_like(alpha), lo=0.0, step=1.0, n=11)
    >>> round(peek(table, fresh(table, u=8.0), 2.0), 6)
    0.28
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
def advance(
    table: Everett, memory: Memory, u: Annotated[float, Meaning("input; NaN moves nothing")]
) -> tuple[
    Annotated[Memory, Meaning(name="memory")], Annotated[float, Meaning("output, 0 to 1", name="f")]
]:
    """Move the input straight to `u` (2.11), in amortised constant time.

    Parameters
    ----------
    table, memory : Everett, Memory
        Relay weights, and the present state; its array is changed in place, so it must not be used
        again.
    u : float
        Unit of the input; NaN moves nothing.

    Returns
    -------
    memory : Memory
        The state after the move.
    f : float
        The output, 0 to 1.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.hysteresis import advance, fresh, from_density
    >>> table = from_density(lambda alpha, beta: np.ones_like(alpha), lo=0.0, step=1.0, n=11)
    >>> memory, f = advance(table, fresh(table, u=8.0), 2.0)
    >>> memory.u, round(f, 6)
    (2.0, 0.28)
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
    u, depth : float, int, optional
        Input, clamped to the table (unit of the input), and the number of pairs that the stack can
        hold.

    Returns
    -------
    Memory
        With one pair in use.

    Raises
    ------
    InputError
        `u` is NaN, or `depth` is below 1.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.hysteresis import fresh, from_density
    >>> table = from_density(lambda alpha, beta: np.ones_like(alpha), lo=0.0, step=1.0, n=11)
    >>> memory = fresh(table, u=12.0)  # above the table
    >>> memory.pairs, memory.u
    (1, 10.0)
    """
    if depth < 1:
        raise InputError("hysteresis memory, depth", depth, "at least 1 pair of reversals")
    if math.isnan(u):
        raise InputError("hysteresis memory, input", u, "a number")
    corners = np.zeros((depth + 1, 4))
    corners[0] = (math.inf, -math.inf, 0.0, 0.0)
    memory, _ = advance(table, Memory(corners, 0, -math.inf), float(u))
    return memory
