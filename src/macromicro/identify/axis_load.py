"""Whether a record of an axis that turns shows an eccentric load that nobody spoke of.

Judged as structures of friction are (`axis_choice`): by the force error in blocks held out.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

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
    plain, loaded = (axis_choice.held_out(list(each), structure) for each in (rows, hung))
    if isinstance(plain, str) or isinstance(loaded, str):
        return None
    score, richer = axis_choice.typical(plain), axis_choice.typical(loaded)
    why_not = axis_choice.no_better(score, richer, np.log(plain / loaded), structure)
    return None if why_not else 1.0 - richer / score


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
            f"a torque that goes with the sine of the angle lowers the force error by "
            f"{100.0 * lowered:.0f} % on data held out: is the load eccentric on a horizontal "
            "shaft? Then --eccentric (`eccentric=True`) finds gravity on it",
        )
