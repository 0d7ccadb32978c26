"""Phases of a measured response on the branch of a model's."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def degrees(
    values: npt.NDArray[np.complex128], model: npt.NDArray[np.complex128]
) -> npt.NDArray[np.float64]:
    """Phases on the branch of a model's, whose first lies between -360 and 0 degrees."""
    turn = np.degrees(np.unwrap(np.angle(model)))
    turn -= 360.0 * np.ceil(turn[0] / 360.0)
    found: npt.NDArray[np.float64] = turn + np.degrees(np.angle(values / model))
    return found
