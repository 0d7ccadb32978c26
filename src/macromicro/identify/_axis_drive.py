"""Test for an unstated delay or limit of a drive, by the force error in held-out blocks."""

from __future__ import annotations

import numpy as np

from macromicro.identify import _axis_choice
from macromicro.identify._axis_delay import ABOUT, delay, shifted
from macromicro.identify.axis_inverse import STRUCTURES, Rows, columns
from macromicro.identify.notices import DataWarning, notice

_EARLY = 12  # samples: so far, at most, may clocks of two columns be apart the wrong way
_STEP, _FINE = 0.1, 21  # limits tried at first, parts of the largest force, and near the best
_LIMITS = np.arange(0.4, 1.0 + 0.5 * _STEP, _STEP)


def limit(rows: list[Rows]) -> float:
    """The force limit with the smallest residual of inverse dynamics."""
    most = max(float(np.abs(r.force).max()) for r in rows)
    best = min(_LIMITS, key=lambda part: _left(rows, part * most))
    near = np.linspace(max(best - _STEP, _STEP), min(best + _STEP, 1.0), _FINE)
    return most * float(min(near, key=lambda part: _left(rows, float(part) * most)))


def _left(rows: list[Rows], most: float) -> float:
    """Squared residual share of a limited force."""
    table = np.concatenate([columns(r, STRUCTURES[ABOUT], 1.0) for r in limited(rows, most)])
    force = table[:, -1]
    missed = force - table[:, :-1] @ np.linalg.lstsq(table[:, :-1], force, rcond=None)[0]
    return float(missed @ missed) / (float(force @ force) or 1.0)


def limited(rows: list[Rows], most: float) -> list[Rows]:
    return [r._replace(force=np.clip(r.force, -most, most)) for r in rows]


def warned(rows: list[Rows], gain: float) -> None:
    late = _shown_late(rows)
    rows = late or rows
    most = limit(rows)
    cut = limited(rows, most)
    lowered = _axis_choice.lowered(rows, cut, ABOUT)
    if lowered is None:
        return
    found = f"the force seems to saturate at u = {most / abs(gain):.3g}"
    remedy = (
        "If the amplifier saturates, --limit (`limit`) finds the limit; drag that grows "
        "faster than the speed looks alike"
    )
    _doubted(found, lowered, remedy)
    if late is None:  # a limit may hide a delay
        _shown_late(cut)


def _shown_late(rows: list[Rows]) -> list[Rows] | None:
    """Warn of a late force; returns the shifted records then."""
    samples = delay(rows, -_EARLY)
    moved = [r._replace(force=shifted(r.force, samples)) for r in rows]
    # At the end of what is tried it is no shift of the columns.
    within = samples and samples != -_EARLY
    lowered = _axis_choice.lowered(rows, moved, ABOUT) if within else None
    if lowered is None:
        return None
    _late(samples, rows[0].run.dt, lowered)
    return moved


def _late(samples: int, dt: float, lowered: float) -> None:
    way = "later" if samples > 0 else "earlier"
    many = abs(samples)
    count = f"{many} sample{'s' * (many > 1)}"
    found = f"the force acts {many * dt * 1e3:.4g} ms ({count}) {way} than u"
    remedy = (
        'If there is a delay, or a lag of driver or filter, --delay fit (`delay="fit"`) identifies '
        "it with the parameters"
        if samples > 0
        else "If u and x were recorded by two clocks, or u is filtered, shift one of them"
    )
    _doubted(found, lowered, remedy)


def _doubted(found: str, lowered: float, remedy: str) -> None:
    notice(
        DataWarning,
        f"{found}: this {_axis_choice.told(lowered)}, and the parameters are wrong by more "
        f"than their errors. {remedy}",
    )
