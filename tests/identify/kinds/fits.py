"""A fit of a drive that was not made, with figures to be told."""

from __future__ import annotations

import math

import numpy as np

from macromicro.identify.axis_fit import DriveFit
from macromicro.identify.axis_inverse import Estimate
from macromicro.models.mass import Axis

N, DT = 200, 0.002
T = np.arange(N) * DT
X = 0.25 + 0.1 * np.sin(20.0 * T)


def fit(
    axis: Axis, names: tuple[str, ...], std: tuple[float, ...], gain: float = 1.0, delay: int = 0
) -> DriveFit:
    """A fit with these errors; inverse dynamics found twice the values, in the opposite order."""
    other = axis._replace(**{n: 2.0 * getattr(axis, n) for n in names})
    spread = np.array(std) ** 2
    inverse = Estimate(other, names[::-1], np.diag(4.0 * spread[::-1]), 0.3, 7.5)
    refined = Estimate(axis, names, np.diag(spread), 0.0125, 4.25)
    holdout = {"viscous": 0.5, "coulomb": 0.25}
    free, rest = (X + 1.0,), (0.01 * np.sin(3.0 * T),)
    return DriveFit(
        "coulomb", inverse, refined, holdout, 0.02, ((0.0, 0.0),), free, rest, gain, delay
    )


AXIS = Axis(mass=1.5, viscous=12.0, coulomb=3.0)
NAMES, STD = ("mass", "viscous", "coulomb"), (0.1, 0.5, math.nan)
HUNG = Axis(mass=0.01, viscous=0.1, coulomb=0.05, sine=0.3, cosine=-0.4)
HUNG_NAMES, HUNG_STD = ("mass", "sine", "cosine"), (0.001, 0.01, 0.02)


def si(text: str) -> float:
    return float(text.split(maxsplit=1)[0])
