"""Kernels that use every word of the language, and functions that use others."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.kernel import kernel

LOW, HIGH = 1, 3
START = (0.5, 2)


class Pair(NamedTuple):
    """Two numbers."""

    a: float
    b: float = 2.0


class Sums(NamedTuple):
    """Sums and their number."""

    values: Array
    number: int


@kernel
def divided(x: float, y: float) -> tuple[float, float]:
    """Quotient and remainder."""
    return x // y, x % y


@kernel
def shared(i: int, j: int) -> tuple[int, int, float]:
    """The same of whole numbers."""
    return i // j, i % j, i / j


@kernel
def rounded(x: float) -> tuple[int, int, int, int, int]:
    """Whole numbers near another."""
    return round(x), int(x), math.floor(x), math.ceil(x), math.trunc(x)


@kernel
def ranked(x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """Of numbers, NaN and two zeros among them."""
    return min(x, y), max(x, y), min(x, y, z), max(z, y, x)


@kernel
def ordered(x: float, y: float, z: float) -> tuple[bool, bool, bool, bool]:
    """Comparisons in chains."""
    return x < y <= z, not x > y, x == y != z, x < 0.0 or (y < 0.0 and z < 0.0)


@kernel
def powered(x: float, y: float) -> tuple[float, float]:
    """Powers: of a base above 0."""
    return (x * x) ** y, math.pow(abs(x), 2.5)


@kernel
def signs(x: float, y: float) -> tuple[float, float, float, float]:
    """Signs, and terms in an order that counts."""
    return -x - -y, x - (y - x), x / (y / x), -(-x - 1.0) * -y


@kernel
def whole_steps(x: float, n: int) -> tuple[float, int]:
    """Loops: up, down, with an end of their own, and early ends."""
    total, turns = 0.0, 0
    for k in range(n):
        if k == HIGH:
            continue
        total += x * k
    for k in range(LOW, 9, 2):
        total -= k
        if total < -100.0:
            break
    for k in range(n, 0, -1):
        total = total / 2.0 + k
    while turns < n and total > 1.0:
        total *= 0.5
        turns += 1
    return total, turns


@kernel
def shrinking(n: int) -> tuple[int, int]:
    """The end of a loop counts as it was before the loop."""
    turns = 0
    for _ in range(n):
        n -= 1
        turns += 1
    return n, turns


@kernel
def swapped(x: float, y: float) -> tuple[float, float]:
    """All values count before the first is set."""
    x, y = y, x
    a, b = x, y
    a, b = b, a + b
    return a, b


@kernel
def branched(x: float, p: Pair) -> Pair:
    """Branches, one in another, and a default."""
    q = Pair(x)
    if x > 1.0:
        q = Pair(p.b, p.a)
    elif x > 0.0 and p.a < p.b:
        kept = p
        q = Pair(kept.a + x, 1)
    else:
        if p.b in (0.0, 1.0):
            return p
        p = Pair(x, p.b)
        q = p
    return q


@kernel
def either(x: float, p: Pair) -> float:
    """Two values at once, of one pair or another."""
    q = Pair(x, 1.0)
    a, b = (p, q) if x > 0.0 else (q, p)
    low, high = (0, x) if p.a > x else (1, p.b)
    return a.a - b.b + low * high


@kernel
def started(x: float) -> float:
    """Constants of a module."""
    first, number = START
    return x * first + number + math.pi


@kernel
def summed(s: Sums, x: float) -> tuple[Sums, float]:
    """An array that is changed where it lies."""
    last = len(s.values) - 1
    for k in range(last, 0, -1):
        s.values[k] = s.values[k - 1]
    s.values[0] = x
    total = 0.0
    for k in range(s.values.shape[0]):
        total += s.values[k]
    return Sums(s.values, s.number + 1), total + s.values[-1]


@kernel
def of_another(x: float) -> float:
    """Calls by name and with what another returns."""
    inner = branched(p=Pair(x, 1.0), x=x)
    return branched(x, branched(x, inner)).a + summed_pair(Pair(x))


@kernel
def summed_pair(p: Pair) -> float:
    """Parts of a tuple."""
    a, b = p
    return a + p[1] * b


ROWS = Sums(np.zeros(4), 0)


@kernel
def by_text(x: float) -> float:
    if x == "one":
        return 1.0
    return x


@kernel
def by_numpy(x: float) -> float:
    return float(np.sin(x))


@kernel
def by_list(x: float) -> float:
    found = [x, x]
    return found[0]


@kernel
def by_other(x: float) -> float:
    return plain(x)


def plain(x: float) -> float:
    return x


@kernel
def by_error(x: float) -> float:
    try:
        return 1.0 / x
    except ZeroDivisionError:
        return 0.0


@kernel
def by_hypot(x: float) -> float:
    return math.hypot(x, 1.0)


@kernel
def by_itself(x: float) -> float:
    return by_itself(x - 1.0) if x > 0.0 else x


@kernel
def by_both(x: float) -> float:
    y = x
    if x > 0.0:
        y = Pair(x, x)  # type: ignore[assignment]
    return y


@kernel
def by_index(s: Sums, x: float) -> float:
    return float(s.values[x])  # type: ignore[call-overload]


@kernel
def by_items(s: Sums) -> float:
    total = 0.0
    for each in s.values:
        total += each
    return total


@kernel
def by_turns(x: float) -> float:
    while summed_pair(Pair(x)) > 1.0 and divided(x, 2.0)[0] > 0.0:
        x -= 1.0
    return x


@kernel
def by_order(s: Sums, x: float) -> float:
    return summed(s, x)[1] + summed(s, 1.0)[1]


@kernel
def by_word(x: float) -> float:
    return x and 1.0
