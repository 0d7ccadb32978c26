"""Checks of a sprung drive: parameters that its records do not show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify import _counts
from macromicro.identify._spread import larger, robust_covariance
from macromicro.identify._sprung_search import SIGNED, End
from macromicro.identify._sprung_spread import Scattered, blocks, parted, scattered
from macromicro.identify.coverage import Drawn
from macromicro.identify.notices import ConvergenceWarning, DataWarning, notice
from macromicro.identify.runs import Run
from macromicro.identify.sprung import Sprung

_BLIND = 1e-6  # of the largest singular value of the slopes: this way nothing moves
_KNOWN = 0.02  # of a parameter: an error that does no harm, whatever it goes with
_TOGETHER = 0.98  # correlation of errors
_FEW = 8.0  # samples in one period, at least


def covariance(
    records: Sequence[Run], best: End, names: tuple[str, ...], lag: float, *, speed: bool
) -> Scattered:
    """Covariance, NaN for parameters that the records do not show; warns of those."""
    if not best.settled:
        notice(ConvergenceWarning, "output error: not settled; the last values are returned")
    used = np.flatnonzero(np.abs(best.slopes).max(axis=0) > 0.0)
    spread = np.full((best.slopes.shape[1],) * 2, np.nan)
    rounded = _rounded(records, best, used)
    if rounded is not None:
        known = Scattered(*rounded)
    else:
        known = scattered(records, best, used, lag, speed=speed)
        if known.repeats is None:  # what repeats along the way is no noise of any colour
            wide = larger(_coloured(records, best, used), known.covariance)
            known = known._replace(covariance=wide)
    spread[np.ix_(used, used)] = known.covariance
    draws = None
    if known.draws is not None:
        draws = np.zeros((len(known.draws), len(names)))
        named = used < len(names)
        draws[:, used[named]] = known.draws[:, named]
    own = spread[: len(names), : len(names)]
    lost = _unseen(best.slopes[:, used], [names[k] if k < len(names) else "" for k in used])
    for name in lost:
        at = names.index(name)
        own[at, :] = own[:, at] = np.nan
    for k, name in enumerate(names):
        if name not in SIGNED and getattr(best.axis, name) <= 0.0:
            own[k, :] = own[:, k] = np.nan
            notice(
                DataWarning,
                f"{name} ended at 0: the record does not determine it, so it has no standard error",
            )
    _mixed(own, names, np.array([getattr(best.axis, n) for n in names]))
    _coarse(records, best.axis)
    return Scattered(own, draws, known.repeats)


def _rounded(records: Sequence[Run], best: End, used: npt.NDArray[np.intp]) -> Drawn | None:
    """Errors where rounding of the output is the only residual; otherwise None."""
    outputs, parts = [r.x for r in records], parted(records, best.residual)
    runs = [x - missed for x, missed in zip(outputs, parts, strict=True)]
    size = np.linalg.norm(best.slopes[:, used], axis=0)
    slopes = best.slopes[:, used] / size
    steps = _counts.steps(outputs, parts)
    if steps is None:
        return None
    back = np.linalg.pinv(slopes)
    told = _counts.redrawn(back.__matmul__, slopes, runs, steps, zeroed=True)
    if not _counts.alone(slopes, told.covariance, outputs, runs, steps, zeroed=True):
        return None
    return Drawn(told.covariance / np.outer(size, size), told.draws / size)


def _coloured(records: Sequence[Run], best: End, used: npt.NDArray[np.intp]) -> Array:
    """Covariance with coloured residuals, by means over blocks."""
    means = blocks(records, best, used)
    return robust_covariance(
        np.concatenate([m.slopes for m in means]),
        np.concatenate([m.residual for m in means]),
        np.cumsum([len(m.residual) for m in means]),
    )


def _unseen(slopes: Array, names: list[str]) -> list[str]:
    """Parameters of which only a sum is observable, also in words; they have no error."""
    size = np.linalg.norm(slopes, axis=0)
    values, ways = np.linalg.svd(slopes / size, full_matrices=False)[1:]
    lost: list[str] = []
    for value, way in zip(values, ways, strict=True):
        if value > _BLIND * values[0]:
            continue
        weight = np.abs(way)
        mixed = [n for n, w in zip(names, weight, strict=True) if n and w > 0.1 * weight.max()]
        if mixed:
            notice(
                DataWarning,
                f"{' and '.join(mixed)} cannot be separated in this record: only their "
                "combined effect shows, and they have no standard errors",
            )
        lost += mixed
    return lost


def _mixed(covariance: Array, names: tuple[str, ...], values: Array) -> None:
    """Warn of parameters that the records cannot separate."""
    size = np.sqrt(np.diag(covariance))
    known = size < _KNOWN * np.abs(values)
    with np.errstate(invalid="ignore", divide="ignore"):
        together = covariance / np.outer(size, size)
    for i in range(len(names)):
        for k in range(i):
            if abs(together[i, k]) > _TOGETHER and not (known[i] and known[k]):
                notice(
                    DataWarning,
                    f"{names[k]} and {names[i]} cannot be separated in this record "
                    f"(correlation {together[i, k]:.3f}); the printed errors hold for both "
                    "jointly",
                )


def _coarse(records: Sequence[Run], axis: Sprung) -> None:
    """Warn of a sample time too long for the oscillation."""
    dt = max(r.dt for r in records)
    if axis.frequency * dt * _FEW > 1.0:
        notice(
            DataWarning,
            f"{1.0 / (axis.frequency * dt):.3g} samples in a period of {axis.frequency:.4g} Hz: a "
            "slower oscillation may fit as well; sample faster",
        )
