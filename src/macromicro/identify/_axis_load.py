"""Test for an unstated eccentric load of a rotary axis, by the force error in held-out blocks."""

from __future__ import annotations

from collections.abc import Sequence

from macromicro.identify import _axis_choice
from macromicro.identify.axis_inverse import Rows
from macromicro.identify.notices import DataWarning, notice


def suspected(rows: Sequence[Rows], structure: str) -> float | None:
    """Share of the force error that gravity on an eccentric load would explain."""
    hung = [r._replace(eccentric=True) for r in rows]
    return _axis_choice.lowered(list(rows), hung, structure)


def warned(rows: Sequence[Rows], structure: str) -> None:
    lowered = suspected(rows, structure)
    if lowered is not None:
        notice(
            DataWarning,
            f"a torque proportional to the sine of the angle {_axis_choice.told(lowered)}. If "
            "the load is eccentric on a horizontal shaft, --eccentric (`eccentric=True`) "
            "identifies gravity on it",
        )
