"""Measured first-order curves: checked, sorted, and in one convention (Section 2.4.1, Figure 2.19).

Descending curves start on the rising branch at the reversal; ascending ones become descending with
u -> -u and f -> -f.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError

Kind = Literal["descending", "ascending"]
KINDS = ("descending", "ascending")


class CurveWarning(UserWarning):
    """Base: the curves deserve a look. The message says what was found and done."""


class MissingRowsWarning(CurveWarning):
    """Rows with NaN or infinity were left out."""


class OrderWarning(CurveWarning):
    """Rows were not in the order of their input and were sorted."""


class CutWarning(CurveWarning):
    """Rows before the reversal were left out."""


class DroppedCurveWarning(CurveWarning):
    """A curve with fewer than two different inputs was left out."""


class ClosureWarning(CurveWarning):
    """The two branches of the major loop do not meet in negative saturation."""


class ClockwiseWarning(CurveWarning):
    """The loop runs clockwise, so its relay density is mostly negative."""


class Curve(NamedTuple):
    """One curve: inputs `u`, not rising, the reversal first; outputs `f`; shape (m,) each."""

    u: Array
    f: Array


def direction(u: Array) -> float:
    """Rank correlation of the input with time."""
    if u.size < 2 or np.ptp(u) == 0.0:
        return 0.0
    _, inverse, counts = np.unique(u, return_inverse=True, return_counts=True)
    rank = (np.cumsum(counts) - 0.5 * counts)[inverse]
    return float(np.corrcoef(rank, np.arange(u.size))[0, 1])


def tidy(curves: Iterable[tuple[npt.ArrayLike, npt.ArrayLike]], kind: str) -> list[Curve]:
    """Usable curves as descending ones, by rising reversal; warns of what is left out."""
    if kind not in KINDS:
        raise InputError("first-order curves, kind", kind, "'descending' or 'ascending'")
    sign = 1.0 if kind == "descending" else -1.0
    found = [_one(f"curves[{k}]", pair, kind, sign) for k, pair in enumerate(curves)]
    kept = [curve for curve in found if curve is not None]
    if len(kept) < 2:
        problem = f"{len(kept)} of {len(found)} are usable"
        raise ProblemError("first-order curves", problem, "Give at least 2 usable curves.")
    f = np.concatenate([curve.f for curve in kept])
    if np.ptp(f) == 0.0:
        raise InputError("first-order curves, output", float(f[0]), "an output that changes")
    return sorted(kept, key=lambda curve: (curve.u[0], -curve.u[-1]))


def _one(
    where: str, pair: tuple[npt.ArrayLike, npt.ArrayLike], kind: str, sign: float
) -> Curve | None:
    """One curve as a descending one; None, with a warning, if it is too short."""
    u, f = _numbers(where, pair)
    u, f = sign * u, sign * f
    good = np.isfinite(u) & np.isfinite(f)
    if not good.all():
        bad = int(u.size - good.sum())
        _warn(MissingRowsWarning, f"{where}: {bad} of {u.size} rows not finite; left out")
        u, f = u[good], f[good]
    different = np.unique(u).size
    if u.size >= 3 and different == 1:
        remedy = "Record an input that moves."
        raise ProblemError(f"{where}, input", f"the input is constant at {sign * u[0]:g}", remedy)
    if different < 2:
        _warn(DroppedCurveWarning, f"{where}: only {different} different inputs; left out")
        return None
    trend = direction(u)
    if trend > 0.9:
        way, first = ("rises", "highest") if sign > 0.0 else ("falls", "lowest")
        problem = f"the input {way} throughout, without a reversal at its start"
        remedy = f"Give {kind} curves, the {first} input first, or kind={KINDS[sign > 0.0]!r}."
        raise ProblemError(where, problem, remedy)
    top = int(np.argmax(u))
    if trend > -0.9 and top >= 2 and direction(u[: top + 1]) > 0.9 and direction(u[top:]) < -0.9:
        _warn(CutWarning, f"{where}: {top} rows before the reversal left out")
        u, f = u[top:], f[top:]
    elif trend > -0.9:
        _warn(OrderWarning, f"{where}: rows are not in the order of their input; sorted")
    order = np.argsort(-u, kind="stable")
    return Curve(u[order], f[order])


def _numbers(where: str, pair: tuple[npt.ArrayLike, npt.ArrayLike]) -> tuple[Array, Array]:
    accepted = "a pair (u, f) of two equally long lists of numbers"
    try:
        u, f = (np.asarray(column, dtype=np.float64) for column in pair)
    except (TypeError, ValueError):
        raise ProblemError(where, "the values are not numbers", f"Give {accepted}.") from None
    if u.ndim != 1 or u.shape != f.shape:
        raise ProblemError(where, f"the shapes are {u.shape} and {f.shape}", f"Give {accepted}.")
    return u, f


def averaged(u: Array, f: Array, width: float) -> tuple[Array, Array]:
    order = np.argsort(u, kind="stable")
    u, f = u[order], f[order]
    bins = np.floor((u - u[0]) / width).astype(np.int64) if math.isfinite(width) else 0 * order
    # The ends stay where they are: the branch must not lose half a bin there.
    bins[u == u[-1]] = bins[-1] + 1
    bins[u > u[0]] += 1
    _, index = np.unique(bins, return_inverse=True)
    count = np.bincount(index)
    return np.bincount(index, u) / count, np.bincount(index, f) / count


def _warn(kind: type[CurveWarning], message: str) -> None:
    warnings.warn(message, kind, stacklevel=5)


def recorded(u: npt.ArrayLike, f: npt.ArrayLike, least: int) -> tuple[Array, Array]:
    """Input and output over time, checked: as many finite numbers of each, an input that moves."""
    try:
        inputs, outputs = np.asarray(u, dtype=np.float64), np.asarray(f, dtype=np.float64)
    except (TypeError, ValueError):
        remedy = "Give two lists of numbers."
        raise ProblemError("recording", "the values are not numbers", remedy) from None
    if inputs.ndim != 1 or inputs.shape != outputs.shape or inputs.size < least:
        found = f"input and output have the shapes {inputs.shape} and {outputs.shape}"
        raise ProblemError("recording", found, f"Give equally long lists, {least} numbers or more.")
    good = np.isfinite(inputs) & np.isfinite(outputs)
    if not good.all():
        found = f"the value at sample {int(np.argmin(good))} is NaN or infinite"
        raise ProblemError("recording", found, "Remove or repair it.")
    if np.ptp(inputs) == 0.0:
        found = f"the input is constant at {inputs[0]:g}"
        raise ProblemError("recording, input", found, "Record an input that moves.")
    return inputs, outputs
