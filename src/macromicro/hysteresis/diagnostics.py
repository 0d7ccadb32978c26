"""Deviation of measured data from any Preisach model: wiping-out and congruency (Section 2.4.1)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis.curves import recorded

SHARES = np.linspace(0.0, 1.0, 21)


class Deviation(NamedTuple):
    """Gaps as shares of the output's range; what a Preisach model would have as 0."""

    rms: float  #: RMS of the gaps
    largest: float  #: largest size of a gap
    gaps: Array  #: signed for wiping-out, sizes for congruency
    #: where in the recording each comes from: the corner and the return to it, or the two reversals
    #: that are compared
    samples: npt.NDArray[np.int64]


class Branch(NamedTuple):
    """A branch from one reversal to where it meets an older corner, or to the next reversal.

    Examples
    --------
    >>> from macromicro.hysteresis.diagnostics import Branch
    >>> Branch(start=1, end=4, rising=True, limit=4.0).limit  # unit of the input
    4.0
    """

    start: int  #: sample of its reversal
    end: int  #: sample of the next reversal
    rising: bool
    limit: float  #: input up to which the branch depends on its own reversal only


def reversals(u: npt.ArrayLike, swing: float) -> npt.NDArray[np.int64]:
    """Samples at which the input turns.

    Parameters
    ----------
    u : array_like, shape (m,)
        Input.
    swing : float
        Least swing that counts, unit of `u`.

    Returns
    -------
    ndarray, shape (k,)
        Indices of `u`.

    Examples
    --------
    >>> from macromicro.hysteresis.diagnostics import reversals
    >>> reversals([0.0, 4.0, 2.0, 3.0, 1.0, 5.0], swing=1.5).tolist()  # 2 to 3 is too small
    [1, 4]
    """
    return np.array(_extremes(u, swing)[0][1:], dtype=np.int64)


def turning_points(values: npt.ArrayLike, least: float) -> list[int]:
    """Extremes between legs, with the first and the last sample.

    Parameters
    ----------
    values : array_like, shape (m,)
        Any quantity over time.
    least : float
        Size of a leg, at least.

    Returns
    -------
    list[int]
        Indices of `values`, rising.

    Raises
    ------
    ProblemError
        Fewer than two values, or a leg of no size.

    Examples
    --------
    >>> from macromicro.hysteresis.diagnostics import turning_points
    >>> turning_points([0.0, 4.0, 2.0, 3.0, 1.0, 5.0], least=1.5)  # 2 to 3 is too small
    [0, 1, 4, 5]
    """
    last = np.size(values) - 1
    if last < 1 or not least > 0.0:
        found = f"the number of values is {last + 1}, the least leg {least:g}"
        raise ProblemError("turning points", found, "Give 2 or more, and a leg above 0.")
    extremes, end = _extremes(values, least)
    return sorted({0, *extremes, end, last})


def _extremes(u: npt.ArrayLike, swing: float) -> tuple[list[int], int]:
    """Where each swing begins, and where the last one ends; the last sample without a swing."""
    inputs = np.asarray(u, dtype=np.float64).tolist()
    begins: list[int] = []
    low = high = 0
    way = 0
    for t, value in enumerate(inputs):
        if value > inputs[high]:
            high = t
        if value < inputs[low]:
            low = t
        if way >= 0 and inputs[high] - value >= swing:
            begins.append(high)
            way, low = -1, t
        elif way <= 0 and value - inputs[low] >= swing:
            begins.append(low)
            way, high = 1, t
    return begins, {1: high, -1: low}.get(way, len(inputs) - 1)


def wiping_out(u: npt.ArrayLike, f: npt.ArrayLike, swing: float | None = None) -> Deviation:
    """By how much the output misses a corner when its input comes back to it.

    After a minor loop the input reaches an earlier extreme again; a Preisach model is then back at
    the output that it had there, and continues as if the loop had not been (Section 2.4.1).

    Parameters
    ----------
    u, f : array_like, shape (m,)
        Input and output.
    swing : float | None, optional
        Least swing that counts as a reversal, unit of `u`; by default 1 % of the input's range.

    Returns
    -------
    Deviation
        One gap per corner that is met again.

    Raises
    ------
    InputError
        Unequal lengths, or a bad `swing`.
    ProblemError
        NaN, a constant input or output, or no minor loop that closes.

    Examples
    --------
    >>> from macromicro.hysteresis import wiping_out
    >>> u = [0.0, 4.0, 2.0, 4.0, 5.0]  # V; a minor loop leaves 4 V and comes back to it
    >>> f = [0.0, 8.0, 5.0, 7.8, 10.0]  # um; an ideal model would be back at 8.0 um
    >>> round(wiping_out(u, f).largest, 3)
    0.02
    """
    inputs, outputs, band = _record(u, f, swing)
    gaps, samples = [], []
    stack: list[int] = []
    turns = reversals(inputs, band).tolist()
    for start, end in _pieces(turns, inputs.size):
        stack.append(start)
        sign = 1.0 if inputs[end] > inputs[start] else -1.0
        while len(stack) >= 2 and sign * (inputs[end] - inputs[stack[-2]]) > 0.0:
            corner, away = stack[-2:]
            # The oldest corner counts if nothing older was wiped out on the way from it.
            seen = sign * inputs[:corner]
            if len(stack) > 2 or sign * inputs[away] >= float(np.min(seen)):
                back, found = _at(inputs, outputs, start, end, float(inputs[corner]))
                gaps.append(found - outputs[corner])
                samples.append((corner, back))
            del stack[-2:]
    if not gaps:
        remedy = "Record at least one that does."
        raise ProblemError("recording, wiping-out", "no minor loop closes", remedy)
    return _deviation(gaps, samples, outputs)


def congruency(
    u: npt.ArrayLike, f: npt.ArrayLike, swing: float | None = None, tolerance: float | None = None
) -> Deviation:
    """By how much branches from equal reversals, after different pasts, differ in shape.

    Branches that start at the same input in the same direction are compared, as changes from a
    common input, as far as both go before they meet an older corner; the gap is the largest
    difference.

    Parameters
    ----------
    u, f : array_like, shape (m,)
        Input and output.
    swing : float | None, optional
        Least swing that counts as a reversal, unit of `u`; by default 1 % of the input's range.
    tolerance : float | None, optional
        How far apart equal reversals may be, unit of `u`; by default a quarter of `swing`.

    Returns
    -------
    Deviation
        One gap per pair of branches.

    Raises
    ------
    InputError
        As for `wiping_out`.
    ProblemError
        As for `wiping_out`, or no two branches can be compared.

    Examples
    --------
    >>> from macromicro.hysteresis import congruency
    >>> u = [0.0, 4.0, 2.0, 4.0, 5.0, 2.0, 4.0, 6.0]  # V; two branches rise from 2 V
    >>> f = [0.0, 7.0, 4.0, 7.0, 8.5, 4.5, 7.7, 10.0]  # um; up to 4 V by 3.0 um and by 3.2 um
    >>> round(congruency(u, f).largest, 3)
    0.02
    """
    inputs, outputs, band = _record(u, f, swing)
    near = 0.25 * band if tolerance is None else tolerance
    branches = _branches(inputs, reversals(inputs, band).tolist())
    gaps, samples = [], []
    for k, one in enumerate(branches):
        for other in branches[:k]:
            apart = abs(inputs[one.start] - inputs[other.start])
            if one.rising is not other.rising or apart > near:
                continue
            sign = 1.0 if one.rising else -1.0
            first = sign * max(sign * inputs[one.start], sign * inputs[other.start])
            last = sign * min(sign * one.limit, sign * other.limit)
            if sign * (last - first) < band:
                continue
            at = first + SHARES * (last - first)
            shapes = [_shape(inputs, outputs, branch, at) for branch in (one, other)]
            gaps.append(float(np.max(np.abs(shapes[0] - shapes[1]))))
            samples.append((other.start, one.start))
    if not gaps:
        remedy = "Record at least two that do."
        raise ProblemError("recording, congruency", "no two branches start at equal inputs", remedy)
    return _deviation(gaps, samples, outputs)


def _record(u: npt.ArrayLike, f: npt.ArrayLike, swing: float | None) -> tuple[Array, Array, float]:
    inputs, outputs = recorded(u, f, 3)
    if np.ptp(outputs) == 0.0:
        found = f"the output is constant at {outputs[0]:g}"
        raise ProblemError("recording, output", found, "Record an output that changes.")
    extent = float(np.ptp(inputs))
    band = 0.01 * extent if swing is None else float(swing)
    if not 0.0 < band < extent:
        raise InputError("recording, swing", swing, f"above 0, below the range {extent:g}")
    return inputs, outputs, band


def _pieces(turns: list[int], size: int) -> list[tuple[int, int]]:
    if not turns:
        return []
    return list(zip(turns, [*turns[1:], size - 1], strict=True))


def _branches(inputs: Array, turns: list[int]) -> list[Branch]:
    """Branches with the input up to which each depends on its own reversal only."""
    branches: list[Branch] = []
    stack: list[int] = []
    for start, end in _pieces(turns, inputs.size):
        rising = bool(inputs[end] > inputs[start])
        sign = 1.0 if rising else -1.0
        stack.append(start)
        # With no older corner in the stack there may be one from before the recording, but
        # none within what the recording has seen.
        seen = sign * inputs[:start]
        older = sign * inputs[stack[-2]] if len(stack) >= 2 else float(np.max(seen))
        limit = sign * min(sign * float(inputs[end]), float(older))
        branches.append(Branch(start, end, rising, limit))
        while len(stack) >= 2 and sign * (inputs[end] - inputs[stack[-2]]) > 0.0:
            del stack[-2:]
    return branches


def _shape(inputs: Array, outputs: Array, branch: Branch, at: Array) -> Array:
    """Change of the output along the branch from the first of the inputs `at` on."""
    u, f = inputs[branch.start : branch.end + 1], outputs[branch.start : branch.end + 1]
    order = np.argsort(u, kind="stable")
    found = np.interp(at, u[order], f[order])
    return np.asarray(found - found[0], dtype=np.float64)


def _at(inputs: Array, outputs: Array, start: int, end: int, u: float) -> tuple[int, float]:
    """First sample of the piece that reaches `u`, and the output there."""
    sign = 1.0 if inputs[end] > inputs[start] else -1.0
    reached = sign * inputs[start : end + 1] >= sign * u
    back = start + int(np.argmax(reached))
    before, after = inputs[back - 1], inputs[back]
    share = 1.0 if after == before else float((u - before) / (after - before))
    return back, float(outputs[back - 1] + share * (outputs[back] - outputs[back - 1]))


def _deviation(gaps: list[float], samples: list[tuple[int, int]], outputs: Array) -> Deviation:
    shares = np.array(gaps) / float(np.ptp(outputs))
    largest = float(np.max(np.abs(shares)))
    return Deviation(float(np.sqrt(np.mean(shares**2))), largest, shares, np.array(samples))
