"""Third-order heating (5.6) as transfer function, modes and thermal ladder (equivalent forms)."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.columns import Meaning
from macromicro.errors import InputError
from macromicro.kernel import kernel
from macromicro.models.electrothermal import D0, D1, D2, N0, N1, N2

# (5.6): numerator and denominator, highest power of s first.
PRINTED = ((N2, N1, N0), (1.0, D2, D1, D0))


class Modes(NamedTuple):
    """(5.6) as a sum: T/T_d = sum over i of share_i rate_i / (s + rate_i)."""

    rate1: float  # fastest, rad/s
    rate2: float  # rad/s
    rate3: float  # slowest, rad/s
    share1: float  # of the rise, dimensionless
    share2: float  # of the rise
    share3: float  # of the rise


class Ladder(NamedTuple):
    """Wire, plates and body as capacities in a row, joined by resistances, the last to the air.

    Heat is in K: one K of heat warms, in the end, by r1 + r2 + r3 K; a capacity c (s) takes up c K
    s per K. One factor, in K/W, gives real units.
    """

    c1: Annotated[float, Meaning("of the wire", "s")]
    r1: Annotated[float, Meaning("wire to plates, dimensionless")]
    c2: Annotated[float, Meaning("of the plates", "s")]
    r2: Annotated[float, Meaning("plates to body")]
    c3: Annotated[float, Meaning("of the body", "s")]
    r3: Annotated[float, Meaning("body to air")]


class Heat(NamedTuple):
    """The modes' parts of the temperature; their sum is T."""

    m1: float  # K above ambient
    m2: float  # K above ambient
    m3: float  # K above ambient


COLD = Heat(0.0, 0.0, 0.0)


@kernel
def heated(p: Modes, s: Heat, goal: float, dt: float) -> Heat:
    """State after one step of heating by (5.6): exact for a constant goal."""
    return Heat(
        s.m1 + (p.share1 * goal - s.m1) * (1.0 - math.exp(-p.rate1 * dt)),
        s.m2 + (p.share2 * goal - s.m2) * (1.0 - math.exp(-p.rate2 * dt)),
        s.m3 + (p.share3 * goal - s.m3) * (1.0 - math.exp(-p.rate3 * dt)),
    )


@kernel
def cooled(p: Modes, s: Heat, goal: float, time: float, dt: float) -> Heat:
    """State after one step of cooling by (5.9): all parts fall with one time constant."""
    left = math.exp(-dt / time)
    return Heat(
        p.share1 * goal + (s.m1 - p.share1 * goal) * left,
        p.share2 * goal + (s.m2 - p.share2 * goal) * left,
        p.share3 * goal + (s.m3 - p.share3 * goal) * left,
    )


def step_response(p: Modes, t: npt.ArrayLike) -> Array:
    """T/T_d after a step from cold."""
    time = np.asarray(t, dtype=np.float64)
    parts = [k * -np.expm1(-r * time) for r, k in zip(p[:3], p[3:], strict=True)]
    return np.asarray(sum(parts), dtype=np.float64)


def from_transfer(num: npt.ArrayLike, den: npt.ArrayLike) -> Modes:
    """Modes of a transfer function num(s)/den(s)."""
    top, bottom = np.trim_zeros(np.ravel(num), "f"), np.trim_zeros(np.ravel(den), "f")
    poles = np.roots(bottom)
    usable = len(bottom) == 4 and bool(np.all(np.isreal(poles)) and np.all(poles.real < 0.0))
    if not usable or len(top) > 3 or len(np.unique(poles)) < 3:
        accepted = "order 3, strictly proper, three different negative real poles"
        raise InputError("transfer function, poles", str(poles), accepted)
    poles = np.sort(poles.real)
    residues = np.polyval(top, poles) / np.polyval(np.polyder(bottom), poles)
    return Modes(*(float(v) for v in -poles), *(float(v) for v in -residues / poles))


def transfer(p: Modes) -> tuple[Array, Array]:
    rates, shares = np.array(p[:3]), np.array(p[3:])
    num = np.zeros(3)
    for i in range(3):
        num += shares[i] * rates[i] * np.poly(-np.delete(rates, i))
    return num, np.asarray(np.poly(-rates), dtype=np.float64)


def ladder(p: Modes) -> Ladder:
    """The ladder of some modes: the continued fraction of the impedance.

    Z = 1/(c1 s + 1/(r1 + 1/(c2 s + ...))).
    """
    if min(p) <= 0.0:
        raise InputError("thermal ladder, modes", tuple(p), "rates and shares above 0")
    num, den = transfer(p)
    elements = []
    while len(num):
        c = den[0] / num[0]
        # 1/Z - c s, its leading term being 0
        rest = (den - c * np.append(num, 0.0))[1:]
        r = num[0] / rest[0]
        elements += [c, r]
        num, den = (num - r * rest)[1:], rest
    return Ladder(*(float(v) for v in elements))
