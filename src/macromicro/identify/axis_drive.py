"""Whether the drive does with its input what it was said to do: when its force acts, how far it
grows.

A delay or a limit that nobody spoke of shows in the force that inverse dynamics leaves, and no
error of the parameters tells it. Either is judged as structures of friction are (`axis_choice`): by
the force error in blocks held out.
"""

from __future__ import annotations

import numpy as np

from macromicro.identify import axis_choice
from macromicro.identify.axis_delay import ABOUT, delay, shifted
from macromicro.identify.axis_inverse import STRUCTURES, Rows, columns
from macromicro.identify.notices import DataWarning, notice

_EARLY = 12  # samples: so far, at most, may clocks of two columns be apart the wrong way
_STEP, _FINE = 0.1, 21  # limits tried at first, parts of the largest force, and near the best
_LIMITS = np.arange(0.4, 1.0 + 0.5 * _STEP, _STEP)


def limit(rows: list[Rows]) -> float:
    """The limit of the force under which inverse dynamics leaves the smallest part of it.

    Parameters
    ----------
    rows : list[Rows]
        The records.

    Returns
    -------
    float
        Unit of force; that of the largest force where none is better.
    """
    most = max(float(np.abs(r.force).max()) for r in rows)
    best = min(_LIMITS, key=lambda part: _left(rows, part * most))
    near = np.linspace(max(best - _STEP, _STEP), min(best + _STEP, 1.0), _FINE)
    return most * float(min(near, key=lambda part: _left(rows, float(part) * most)))


def _left(rows: list[Rows], most: float) -> float:
    """The part of a limited force that inverse dynamics leaves, squared."""
    table = np.concatenate([columns(r, STRUCTURES[ABOUT], 1.0) for r in limited(rows, most)])
    force = table[:, -1]
    missed = force - table[:, :-1] @ np.linalg.lstsq(table[:, :-1], force, rcond=None)[0]
    return float(missed @ missed) / (float(force @ force) or 1.0)


def limited(rows: list[Rows], most: float) -> list[Rows]:
    """Records whose force does not go beyond a limit.

    Parameters
    ----------
    rows : list[Rows]
        The records.
    most : float
        The limit.

    Returns
    -------
    list[Rows]
        Likewise.
    """
    return [r._replace(force=np.clip(r.force, -most, most)) for r in rows]


def warned(rows: list[Rows], gain: float) -> None:
    """Say that the force acts late, or does not grow with the input, where it shows.

    Parameters
    ----------
    rows : list[Rows]
        The records.
    gain : float
        Force per unit of u.
    """
    late = _shown_late(rows)
    rows = late or rows
    most = limit(rows)
    cut = limited(rows, most)
    lowered = axis_choice.lowered(rows, cut, ABOUT)
    if lowered is None:
        return
    found = f"as if the force did not grow beyond u = {most / abs(gain):.3g}"
    remedy = (
        "Does the amplifier saturate? Then --limit (`limit`) tells where; drag that grows faster "
        "than the speed looks alike"
    )
    _doubted(found, lowered, remedy)
    if late is None:  # a limit may hide a delay
        _shown_late(cut)


def _shown_late(rows: list[Rows]) -> list[Rows] | None:
    """Say that the force is late where that shows; then as it acts, else None."""
    samples = delay(rows, -_EARLY)
    moved = [r._replace(force=shifted(r.force, samples)) for r in rows]
    # At the end of what is tried it is no shift of the columns.
    within = samples and samples != -_EARLY
    lowered = axis_choice.lowered(rows, moved, ABOUT) if within else None
    if lowered is None:
        return None
    _late(samples, rows[0].run.dt, lowered)
    return moved


def _late(samples: int, dt: float, lowered: float) -> None:
    """Say by how much the force is late."""
    way = "later" if samples > 0 else "earlier"
    many = abs(samples)
    count = f"{many} sample{'s' * (many > 1)}"
    found = f"the force acts {many * dt * 1e3:.4g} ms ({count}) {way} than u says"
    remedy = (
        'A delay, or a lag of driver or filter? Then --delay fit (`delay="fit"`) finds it with '
        "the parameters"
        if samples > 0
        else "Were u and x recorded by two clocks, or is u filtered? Shift one of them"
    )
    _doubted(found, lowered, remedy)


def _doubted(found: str, lowered: float, remedy: str) -> None:
    notice(
        DataWarning,
        f"{found}: that {axis_choice.told(lowered)}, and parameters are off by more than their "
        f"errors. {remedy}",
    )
