"""Whether a record of an axis that turns shows an eccentric load that nobody spoke of.

Judged as structures of friction are (`axis_choice`): by the force error in blocks held out.
"""

from __future__ import annotations

from collections.abc import Sequence

from macromicro.identify import axis_choice
from macromicro.identify.axis_inverse import Rows
from macromicro.identify.notices import DataWarning, notice


def suspected(rows: Sequence[Rows], structure: str) -> float | None:
    """What gravity at an eccentric load would explain of the force.

    Parameters
    ----------
    rows : Sequence[Rows]
        The records, without such a load; x in rad.
    structure : str
        Of the friction.

    Returns
    -------
    float | None
        By which part it lowers the force error in blocks held out; None: not by enough, or the
        motion does not tell.
    """
    hung = [r._replace(eccentric=True) for r in rows]
    return axis_choice.lowered(list(rows), hung, structure)


def warned(rows: Sequence[Rows], structure: str) -> None:
    """Say that an eccentric load shows, where it does.

    Parameters
    ----------
    rows : Sequence[Rows]
        As for `suspected`.
    structure : str
        Of the friction.
    """
    lowered = suspected(rows, structure)
    if lowered is not None:
        notice(
            DataWarning,
            f"a torque that goes with the sine of the angle {axis_choice.told(lowered)}: is the "
            "load eccentric on a horizontal shaft? Then --eccentric (`eccentric=True`) finds "
            "gravity on it",
        )
