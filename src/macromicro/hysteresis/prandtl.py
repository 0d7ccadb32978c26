"""The Prandtl-Ishlinskii operator: a weighted sum of play operators (Kuhnen 2003).

A play of threshold r is a slot of width 2 r that the input u carries along:

    y = max(u - r, min(u + r, y)),        f = offset + sum over i of w_i y_i.

It is the model of piezo stages: loops without saturation, of one shape at all places of the
range. With r_0 = 0, w_0 > 0 and the other weights at least 0 it can be inverted in closed form
(`prandtl_inverse`). A loop that widens with the rate has thresholds that grow with it, r_i +
widening |du/dt| (Al Janaideh, Su and Rakheja 2009; linear as in Al Janaideh and Krejci 2013).

K. Kuhnen, "Modeling, identification and compensation of complex hysteretic nonlinearities: a
modified Prandtl-Ishlinskii approach", European Journal of Control 9 (2003) 407-418.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.kernel import compiled, kernel

MOST_PLAYS = 200
# Shorter arrays are done before a compiler would be loaded; the bits are the same.
WORTH_COMPILING = 2000


class Prandtl(NamedTuple):
    """Thresholds and weights.

    Attributes
    ----------
    thresholds : ndarray, shape (n,)
        r_i, rising from 0, unit of the input.
    weights : ndarray, shape (n,)
        w_i, output per input.
    offset : float
        Output when every play stands at 0.
    widening : float
        Growth of all thresholds but r_0 with the rate of the input, s.
    """

    thresholds: Array
    weights: Array
    offset: float
    widening: float


class Plays(NamedTuple):
    """Where each play stands. `advance` writes into the array.

    Attributes
    ----------
    y : ndarray, shape (n,)
        Unit of the input.
    u : float
        Present input.
    """

    y: Array
    u: float


def operator(
    thresholds: npt.ArrayLike,
    weights: npt.ArrayLike,
    offset: float = 0.0,
    widening: float = 0.0,
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
    """
    where = "Prandtl-Ishlinskii"
    try:
        r, w = (np.array(v, dtype=np.float64, ndmin=1) for v in (thresholds, weights))
    except (TypeError, ValueError):
        raise InputError(f"{where}, thresholds and weights", "not numbers", "numbers") from None
    if r.ndim != 1 or r.shape != w.shape or not 1 <= r.size <= MOST_PLAYS:
        accepted = f"as many weights as thresholds, 1 to {MOST_PLAYS}"
        raise InputError(f"{where}, shapes", f"{r.shape} and {w.shape}", accepted)
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
    p : Prandtl
        The operator.
    u : float, optional
        Unit of the input.

    Returns
    -------
    Plays
        Its array is its own.

    Raises
    ------
    InputError
        `u` is not finite.
    """
    if not math.isfinite(u):
        raise InputError("Prandtl-Ishlinskii, input", u, "a finite number")
    return Plays(np.full(p.thresholds.size, float(u)), float(u))


@kernel
def play(r: float, u: float, y: float) -> float:
    """One play operator after its input went straight to `u`.

    Parameters
    ----------
    r : float
        Half the width of the slot, unit of the input.
    u : float
        Input.
    y : float
        Where the play stood.

    Returns
    -------
    float
        Unit of the input.
    """
    return max(u - r, min(u + r, y))


@kernel
def output(p: Prandtl, s: Plays) -> float:
    """The operator's output where its plays stand.

    Parameters
    ----------
    p : Prandtl
        The operator.
    s : Plays
        Its state.

    Returns
    -------
    float
        Unit of the output.
    """
    f = p.offset
    for i in range(p.thresholds.shape[0]):
        f += p.weights[i] * s.y[i]
    return float(f)


@kernel
def advance(p: Prandtl, s: Plays, u: float, rate: float) -> tuple[Plays, float]:
    """Move the input straight to `u`.

    Parameters
    ----------
    p : Prandtl
        The operator.
    s : Plays
        The present state. Its array is changed in place, so it must not be used again.
    u : float
        Unit of the input; NaN moves nothing.
    rate : float
        Rate of the input, per second; its sign does not matter. 0: no widening.

    Returns
    -------
    s : Plays
        The state after the move.
    f : float
        The output.
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
    p : Prandtl
        The operator.
    s : Plays
        The state before; its array is changed in place.
    inputs : ndarray, shape (m,)
        Unit of the input.
    dt : float
        From one input to the next, s; infinity for the rate-independent operator.
    outputs : ndarray, shape (m,)
        Written into.

    Returns
    -------
    Plays
        The state after the last input.
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
    p : Prandtl
        The operator.
    inputs : array_like, shape (m,)
        Unit of the input.
    start : Plays | None, optional
        State before the first input, which stays as it is; None for `relaxed` at 0.
    dt : float, optional
        From one input to the next, s; infinity for the rate-independent operator.

    Returns
    -------
    ndarray, shape (m,)
        Unit of the output.
    """
    along = np.ascontiguousarray(inputs, dtype=np.float64)
    outputs = np.empty_like(along)
    begun = relaxed(p) if start is None else start
    walk = compiled(follow) if along.size >= WORTH_COMPILING else follow
    walk(p, Plays(begun.y.copy(), begun.u), along, float(dt), outputs)
    return outputs
