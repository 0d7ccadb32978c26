"""The Prandtl-Ishlinskii operator: a weighted sum of play operators (Kuhnen 2003).

    y = max(u - r, min(u + r, y)),        f = offset + sum over i of w_i y_i

With r_0 = 0, w_0 > 0 and the other weights at least 0 it has a closed-form inverse
(`inverse`). With the rate, thresholds grow to r_i + widening |du/dt| (Al Janaideh, Su and
Rakheja 2009).

K. Kuhnen, "Modeling, identification and compensation of complex hysteretic nonlinearities: a
modified Prandtl-Ishlinskii approach", European Journal of Control 9 (2003) 407-418.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.columns import Meaning
from macromicro.errors import InputError, ProblemError
from macromicro.kernel import compiled, kernel

MOST_PLAYS = 200
# Shorter arrays are done before a compiler would be loaded; the bits are the same.
WORTH_COMPILING = 2000


class Prandtl(NamedTuple):
    """Thresholds and weights."""

    thresholds: Annotated[Array, Meaning("r_i, rising from 0, unit of the input")]
    weights: Annotated[Array, Meaning("w_i, output per input")]
    offset: Annotated[float, Meaning("output when every play stands at 0")]
    widening: Annotated[
        float, Meaning("growth of all thresholds but r_0 with the rate of the input", "s")
    ]


class Plays(NamedTuple):
    """Where each play stands. `advance` writes into the array."""

    y: Annotated[Array, Meaning("unit of the input")]
    u: Annotated[float, Meaning("present input")]


def operator(
    thresholds: npt.ArrayLike, weights: npt.ArrayLike, offset: float = 0.0, widening: float = 0.0
) -> Prandtl:
    """An operator from lists, checked so that it dissipates and can be inverted.

    Parameters
    ----------
    thresholds : array_like, shape (n,)
        Unit of the input.
    weights : array_like, shape (n,)
        Output per input.
    offset : float, optional
        Unit of the output.
    widening : float, optional
        s.

    Returns
    -------
    Prandtl
        For the kernels.

    Raises
    ------
    InputError
        Unequal lengths, thresholds that do not rise from 0, a weight below 0, no reversible part.
    ProblemError
        Values that are not numbers.

    Examples
    --------
    >>> from macromicro.hysteresis import prandtl
    >>> p = prandtl.operator(thresholds=[0.0, 10.0], weights=[0.02, 0.01])  # V, and um/V
    >>> prandtl.run(p, [100.0, 0.0]).round(6).tolist()  # um; the second play lags by 10 V
    [2.9, 0.1]
    """
    where = "Prandtl-Ishlinskii"
    try:
        r, w = (np.array(v, dtype=np.float64, ndmin=1) for v in (thresholds, weights))
    except (TypeError, ValueError):
        problem = "the values are not numbers"
        remedy = "Give lists of numbers."
        raise ProblemError(f"{where}, thresholds and weights", problem, remedy) from None
    if r.ndim != 1 or r.shape != w.shape or not 1 <= r.size <= MOST_PLAYS:
        found = f"thresholds and weights have the shapes {r.shape} and {w.shape}"
        raise ProblemError(where, found, f"Give as many weights as thresholds, 1 to {MOST_PLAYS}.")
    if r[0] != 0.0 or not np.all(np.diff(r) > 0.0) or not np.isfinite(r[-1]):
        raise InputError(f"{where}, thresholds", r.tolist(), "0 first, then rising")
    if not (np.all(np.isfinite(w)) and np.all(w >= 0.0) and w[0] > 0.0):
        raise InputError(
            f"{where}, weights", w.tolist(), "the first above 0, the others at least 0"
        )
    if not (math.isfinite(offset) and math.isfinite(widening) and widening >= 0.0):
        accepted = "a finite offset, a widening of at least 0"
        raise InputError(f"{where}, offset and widening", (offset, widening), accepted)
    return Prandtl(r, w, float(offset), float(widening))


def relaxed(p: Prandtl, u: float = 0.0) -> Plays:
    """No past: every play in the middle of its slot, as after a decaying swing about `u`.

    Parameters
    ----------
    p, u : Prandtl, float, optional
        The operator, and an input in its unit.

    Returns
    -------
    Plays
        Its array is its own.

    Raises
    ------
    InputError
        `u` is not finite.

    Examples
    --------
    >>> from macromicro.hysteresis import prandtl
    >>> p = prandtl.operator(thresholds=[0.0, 10.0], weights=[0.02, 0.01])
    >>> prandtl.relaxed(p, u=50.0).y.tolist()
    [50.0, 50.0]
    """
    if not math.isfinite(u):
        raise InputError("Prandtl-Ishlinskii, input", u, "a finite number")
    return Plays(np.full(p.thresholds.size, float(u)), float(u))


@kernel
def play(r: float, u: float, y: float) -> float:
    """One play operator after its input went straight to `u`.

    Parameters
    ----------
    r, u, y : float
        Half the width of the slot, the input, and the play's position before.

    Returns
    -------
    float
        Unit of the input.

    Examples
    --------
    >>> from macromicro.hysteresis.prandtl import play
    >>> play(r=10.0, u=100.0, y=0.0)
    90.0
    >>> play(r=10.0, u=95.0, y=90.0)  # within the slot
    90.0
    """
    return max(u - r, min(u + r, y))


@kernel
def output(p: Prandtl, s: Plays) -> Annotated[float, Meaning("output")]:
    """The operator's output for the position of its plays.

    Parameters
    ----------
    p, s : Prandtl, Plays
        The operator and its state.

    Returns
    -------
    float
        Unit of the output.

    Examples
    --------
    >>> from macromicro.hysteresis import prandtl
    >>> p = prandtl.operator(thresholds=[0.0, 10.0], weights=[0.02, 0.01])
    >>> prandtl.output(p, prandtl.relaxed(p, u=50.0))
    1.5
    """
    f = p.offset
    for i in range(p.thresholds.shape[0]):
        f += p.weights[i] * s.y[i]
    return float(f)


@kernel
def advance(
    p: Prandtl,
    s: Plays,
    u: Annotated[float, Meaning("input; NaN moves nothing")],
    rate: Annotated[float, Meaning("rate of the input; 0: no widening")],
) -> tuple[Annotated[Plays, Meaning(name="s")], Annotated[float, Meaning("output", name="f")]]:
    """Move the input straight to `u`.

    Parameters
    ----------
    p, s : Prandtl, Plays
        The operator and its state, whose array is changed in place, so it must not be used again.
    u : float
        Unit of the input; NaN moves nothing.
    rate : float
        Rate of the input, unit of the input per s, of either sign; 0: no widening.

    Returns
    -------
    s : Plays
        The state after the move.
    f : float
        The output, in its unit.

    Examples
    --------
    >>> from macromicro.hysteresis import prandtl
    >>> p = prandtl.operator(thresholds=[0.0, 10.0], weights=[0.02, 0.01])
    >>> s, f = prandtl.advance(p, prandtl.relaxed(p), u=100.0, rate=0.0)
    >>> s.y.tolist(), round(f, 6)
    ([100.0, 90.0], 2.9)
    """
    if math.isnan(u):
        return s, output(p, s)
    wider = p.widening * abs(rate)
    s.y[0] = u
    for i in range(1, p.thresholds.shape[0]):
        s.y[i] = play(p.thresholds[i] + wider, u, float(s.y[i]))
    after = Plays(s.y, u)
    return after, output(p, after)


@kernel
def follow(p: Prandtl, s: Plays, inputs: Array, dt: float, outputs: Array) -> Plays:
    """Outputs along inputs, written into an array.

    Parameters
    ----------
    p, s : Prandtl, Plays
        The operator, and the state before; its array is changed in place.
    inputs : ndarray, shape (m,)
        Unit of the input.
    dt : float
        Sample time, s; infinity for the rate-independent operator.
    outputs : ndarray, shape (m,)
        Written into.

    Returns
    -------
    Plays
        The state after the last input.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.hysteresis import prandtl
    >>> p = prandtl.operator(thresholds=[0.0, 10.0], weights=[0.02, 0.01])
    >>> outputs = np.empty(2)
    >>> s = prandtl.follow(p, prandtl.relaxed(p), np.array([100.0, 0.0]), np.inf, outputs)
    >>> outputs.round(6).tolist()
    [2.9, 0.1]
    """
    for k in range(inputs.shape[0]):
        u = float(inputs[k])
        s, f = advance(p, s, u, (u - s.u) / dt)
        outputs[k] = f
    return s


def run(
    p: Prandtl, inputs: npt.ArrayLike, start: Plays | None = None, dt: float = math.inf
) -> Array:
    """Outputs along inputs; compiled for long ones.

    Parameters
    ----------
    p, inputs : Prandtl, array_like, shape (m,)
        The operator and its input.
    start : Plays | None, optional
        State before the first input, not changed; None for `relaxed` at 0.
    dt : float, optional
        Sample time, s; infinity for the rate-independent operator.

    Returns
    -------
    ndarray, shape (m,)
        Unit of the output.

    Examples
    --------
    >>> from macromicro.hysteresis import prandtl
    >>> p = prandtl.operator(thresholds=[0.0, 10.0], weights=[0.02, 0.01])
    >>> prandtl.run(p, [100.0, 0.0, 100.0]).round(6).tolist()
    [2.9, 0.1, 2.9]
    """
    along = np.ascontiguousarray(inputs, dtype=np.float64)
    outputs = np.empty_like(along)
    begun = relaxed(p) if start is None else start
    walk = compiled(follow) if along.size >= WORTH_COMPILING else follow
    walk(p, Plays(begun.y.copy(), begun.u), along, float(dt), outputs)
    return outputs


def inverse(p: Prandtl) -> Prandtl:
    """The operator that undoes another one: the mirrored branch (Kuhnen 2003).

    Its input is the other's output less its offset. Weights beside the first are 0 or below, since
    a compensator must lead where the stage lags.

    Parameters
    ----------
    p : Prandtl
        From `operator`; its widening is not inverted.

    Returns
    -------
    Prandtl
        Thresholds in the unit of the output, weights input per output, no offset.

    Examples
    --------
    >>> from macromicro.hysteresis import prandtl
    >>> p = prandtl.operator(thresholds=[0.0, 10.0], weights=[0.02, 0.01])  # V to um
    >>> prandtl.run(prandtl.inverse(p), prandtl.run(p, [100.0, 30.0])).round(6).tolist()  # V
    [100.0, 30.0]
    """
    total = np.cumsum(p.weights)
    # r'_i = sum over j <= i of w_j (r_i - r_j).
    thresholds = p.thresholds * total - np.cumsum(p.weights * p.thresholds)
    # w'_0 = 1/w_0, w'_i = -w_i / (W_i W_(i-1)) with W the sum up to i.
    weights = np.empty_like(p.weights)
    weights[0] = 1.0 / p.weights[0]
    weights[1:] = -p.weights[1:] / (total[1:] * total[:-1])
    return Prandtl(thresholds, weights, 0.0, 0.0)
