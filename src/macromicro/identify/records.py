"""Records of input and output, checked, averaged and filtered before a linear fit.

Arrays u[n], y[n] every `dt` seconds, in the caller's units.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify.notices import SaturationWarning, notice

_ELSEWHERE = 0.05  # of a saturated record is below its extreme, at least
GAP = 5.0  # usual time steps; a longer one is a gap
Signals = npt.ArrayLike | Sequence[npt.ArrayLike]


class Record(NamedTuple):
    u: Array  # input
    y: Array  # output
    w: Array  # weights of the samples


class Steps(NamedTuple):
    """Time steps, by the row before each, and those that are odd."""

    sizes: Array  # s; NaN from one run to another
    usual: float  # median of those that rise, s; 0 where none does
    gaps: npt.NDArray[np.int64]
    falls: npt.NDArray[np.int64]


def steps(t: Array, run: Array | None = None) -> Steps:
    """The steps of some times, each run by itself."""
    sizes = np.diff(t)
    if run is not None:
        sizes[np.diff(run) != 0.0] = np.nan
    rising = sizes[sizes > 0.0]
    usual = float(np.median(rising)) if len(rising) else 0.0
    gaps = sizes > GAP * usual if usual else np.zeros(len(sizes), dtype=np.bool_)
    return Steps(sizes, usual, np.flatnonzero(gaps), np.flatnonzero(sizes < 0.0))


def signal(values: Any, where: str) -> Array:
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(where, type(values).__name__, "an array of numbers") from None
    if array.ndim != 1:
        raise ProblemError(where, f"the shape is {array.shape}", "Give an array of one dimension.")
    bad = np.flatnonzero(~np.isfinite(array))
    if len(bad):
        found = f"row {bad[0]} is {array[bad[0]]} (rows that are not finite: {len(bad)})"
        raise ProblemError(where, found, "Cut or repair them first.")
    return array


def _as_list(values: Any) -> list[Any]:
    if isinstance(values, np.ndarray):
        return [values]
    items = list(values) if isinstance(values, Iterable) else [values]
    return [items] if items and np.ndim(items[0]) == 0 else items


def records(u: Signals, y: Signals, weights: Signals | None, least: int) -> list[Record]:
    """Checked records from arrays or lists of arrays; warns of saturated inputs."""
    inputs, outputs = _as_list(u), _as_list(y)
    loads = [None] * len(inputs) if weights is None else _as_list(weights)
    if not inputs or len(inputs) != len(outputs) or len(loads) != len(inputs):
        found = f"inputs, outputs and weights number {len(inputs)}, {len(outputs)} and {len(loads)}"
        raise ProblemError("records", found, "Give as many of each, one or more.")
    done = []
    for i, (ui, yi, wi) in enumerate(zip(inputs, outputs, loads, strict=True)):
        at = f"[{i}]" if len(inputs) > 1 else ""
        uu, yy = signal(ui, f"u{at}"), signal(yi, f"y{at}")
        ww = np.ones_like(yy) if wi is None else signal(wi, f"weights{at}")
        if not len(uu) == len(yy) == len(ww):
            found = f"inputs, outputs and weights are {len(uu)}, {len(yy)} and {len(ww)} long"
            raise ProblemError(f"record{at}", found, "Give arrays of one length.")
        if len(uu) < least:
            raise ProblemError(f"record{at}", f"{len(uu)} samples given", f"Give {least} or more.")
        if (ww < 0.0).any() or not ww.any():
            raise InputError(f"weights{at}", float(ww.min()), "zero or more, not all zero")
        flag_saturation(uu, f"u{at}")
        done.append(Record(uu, yy, ww))
    if not any(np.ptp(r.u) or r.u[0] for r in done):
        remedy = "Record an input that moves the machine."
        raise ProblemError("u", "the input is zero throughout", remedy)
    return done


def flag_saturation(u: Array, where: str, limit: float | None = None) -> Array:
    """The input within a limit, or as it is with a warning of saturation."""
    # Saturated: it changes from sample to sample but stays at its greatest magnitude for runs of 3
    # or more, 1 % of the record in all. What is hardly ever elsewhere goes between two levels.
    size = np.abs(u)
    if limit is not None:
        over = int((size > limit * (1.0 + 1e-9)).sum())
        if over:
            notice(
                SaturationWarning,
                f"{where}: {over} of {len(u)} samples beyond the limit of {limit:g}; "
                "taken as the limit",
            )
        return np.clip(u, -limit, limit)
    if not size.max() > 0.0:
        return u
    top = size >= size.max() * (1.0 - 1e-6)
    held = int((top[2:] & top[1:-1] & top[:-2]).sum())
    below = ~top[1:]
    moves = float(np.mean(np.diff(u)[below] != 0.0)) if below.mean() > _ELSEWHERE else 0.0
    if held >= max(0.01 * len(u), 3) and moves > 0.5:
        notice(
            SaturationWarning,
            f"{where}: the input stays at its extreme ({size.max():g}) for {int(top.sum())} of "
            f"{len(u)} samples, as a saturated one does; nothing was changed",
        )
    return u


def average_runs(runs: Sequence[tuple[npt.ArrayLike, npt.ArrayLike]]) -> tuple[Array, Array]:
    """Mean input and mean travel over runs of both directions (Section 4.2.5).

    Runs whose input sums to less than zero are mirrored; each travel counts from its first sample;
    runs are cut to the shortest. Averaging N runs divides rounding noise by sqrt(N) and cancels
    what depends on the direction.

    Parameters
    ----------
    runs : Sequence[tuple[npt.ArrayLike, npt.ArrayLike]]
        Pairs of input and position, shape (n,) each.

    Returns
    -------
    u : ndarray, shape (n,)
        Mean input.
    x : ndarray, shape (n,)
        Mean travel.

    Raises
    ------
    InputError
        A run of unequal or non-finite arrays.
    ProblemError
        There is no run.

    Examples
    --------
    >>> from macromicro.identify import average_runs
    >>> there, back = [100.0, 104.0, 112.0], [300.0, 294.0, 286.0]  # counts, at 1 V and at -1 V
    >>> u, x = average_runs([([1.0, 1.0, 1.0], there), ([-1.0, -1.0, -1.0], back)])
    >>> x
    array([ 0.,  5., 13.])
    """
    if not runs:
        raise ProblemError("runs", "there is no run", "Give one or more of (input, position).")
    pairs = [
        (signal(u, f"runs[{i}].u"), signal(x, f"runs[{i}].x")) for i, (u, x) in enumerate(runs)
    ]
    for i, (u, x) in enumerate(pairs):
        if len(u) != len(x) or len(u) < 2:
            found = f"inputs and positions number {len(u)} and {len(x)}"
            raise ProblemError(f"runs[{i}]", found, "Give as many of each, two or more.")
    n = min(len(u) for u, _ in pairs)
    signs = [-1.0 if u.sum() < 0.0 else 1.0 for u, _ in pairs]
    mean_u = np.mean([s * u[:n] for s, (u, _) in zip(signs, pairs, strict=True)], axis=0)
    mean_x = np.mean([s * (x[:n] - x[0]) for s, (_, x) in zip(signs, pairs, strict=True)], axis=0)
    return mean_u, mean_x


def differentiated(u: npt.ArrayLike, x: npt.ArrayLike, dt: float) -> tuple[Array, Array]:
    """Input and speed from positions: y[k] = (x[k+1] - x[k]) / dt.

    With this alignment the thesis' model (4.4), position / input = dt b / ((z - 1)(z + a)), is y[k]
    = -a y[k-1] + b u[k-1].

    Parameters
    ----------
    u : array_like, shape (n,)
        Input.
    x : array_like, shape (n,)
        Position.
    dt : float
        Sample time, s.

    Returns
    -------
    u : ndarray, shape (n - 1,)
        Input.
    y : ndarray, shape (n - 1,)
        Speed, unit of x per s.

    Raises
    ------
    InputError
        Unequal or too short arrays, or `dt` not above zero.

    Examples
    --------
    >>> from macromicro.identify import differentiated
    >>> u, speed = differentiated([1.0, 1.0, 0.0], [0.0, 2.0, 5.0], dt=0.5)  # V, counts
    >>> speed  # counts/s
    array([4., 6.])
    """
    place, push = signal(x, "x"), signal(u, "u")
    if len(place) != len(push) or len(place) < 2 or not dt > 0.0:
        found = f"inputs and positions number {len(push)} and {len(place)}, dt is {dt}"
        raise ProblemError("record", found, "Give as many of each, 2 or more, and dt above 0.")
    return push[:-1].copy(), np.diff(place) / dt


def integrated(u: npt.ArrayLike, y: npt.ArrayLike, dt: float) -> tuple[Array, Array]:
    """Prefilter dt / (1 - z^-1) on both signals: the inverse of differentiation.

    Rounding makes white noise on positions, so their difference carries noise (1 - z^-1) e / dt;
    this filter whitens it again and leaves the model unchanged.

    Parameters
    ----------
    u, y : array_like, shape (n,)
        Input and output.
    dt : float
        Sample time, s.

    Returns
    -------
    u : ndarray, shape (n,)
        Filtered.
    y : ndarray, shape (n,)
        Filtered.

    Raises
    ------
    InputError
        A signal is not finite.

    Examples
    --------
    >>> from macromicro.identify import integrated
    >>> u, y = integrated([1.0, 1.0, 0.0], [0.0, 2.0, 4.0], dt=0.5)
    >>> u, y
    (array([0.5, 1. , 1. ]), array([0., 1., 3.]))
    """
    return np.cumsum(signal(u, "u")) * dt, np.cumsum(signal(y, "y")) * dt


def lowpassed(
    u: npt.ArrayLike, y: npt.ArrayLike, dt: float, cutoff: float, order: int = 2
) -> tuple[Array, Array]:
    """Causal Butterworth low-pass on both signals: the model is unchanged.

    For differentiated counts, whose noise grows with frequency. Needs a start at rest.

    Parameters
    ----------
    u, y : array_like, shape (n,)
        Input and output.
    dt : float
        Sample time, s.
    cutoff : float
        Cut-off frequency, Hz.
    order : int, optional
        Order of the filter.

    Returns
    -------
    u : ndarray, shape (n,)
        Filtered.
    y : ndarray, shape (n,)
        Filtered.

    Raises
    ------
    InputError
        `cutoff` is not below half the sampling rate, or a signal is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.identify import lowpassed
    >>> t = 1e-3 * np.arange(2000)
    >>> slow, fast = np.sin(2.0 * np.pi * 2.0 * t), np.sin(2.0 * np.pi * 200.0 * t)
    >>> u, y = lowpassed(slow, fast, dt=1e-3, cutoff=20.0)
    >>> np.round([np.ptp(u[1000:]), np.ptp(y[1000:])], 2)  # 2 Hz passes, 200 Hz does not
    array([2.  , 0.01])
    """
    from scipy.signal import butter, sosfilt

    if not 0.0 < cutoff < 0.5 / dt:
        raise InputError("cutoff", cutoff, f"between 0 and {0.5 / dt:g} Hz")
    sections = butter(order, 2.0 * dt * cutoff, output="sos")
    return sosfilt(sections, signal(u, "u")), sosfilt(sections, signal(y, "y"))


def fit_percent(outputs: Sequence[Array], runs: Sequence[Array]) -> float:
    """100 (1 - |y - model| / |y - mean y|) over all records, each about its own mean."""
    missed = sum(float(((y - f) ** 2).sum()) for y, f in zip(outputs, runs, strict=True))
    spread = sum(float(((y - y.mean()) ** 2).sum()) for y in outputs)
    return 100.0 * (1.0 - (missed / spread) ** 0.5) if spread > 0.0 else float("nan")


def rms(parts: Sequence[Array]) -> float:
    """RMS of all values of several arrays."""
    return math.sqrt(sum(float(p @ p) for p in parts) / sum(map(len, parts)))
