"""Belt flexibility: the lightly damped mode that a stopping carriage leaves behind.

Section 6.2: about 20 um at the micro-stage, gone in about two seconds. The belt pulls
beside the guide rod, so the carriage rocks on the belt's compliance and the stage, off
the rod's axis, sees a fraction of that motion.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro import nominal
from macromicro.kernel import kernel
from macromicro.plant import VARIANT
from macromicro.schema.par import Par

FASTEST = 0.4 / nominal.PERIOD  # Hz; beyond half the loop's frequency nothing is seen of it


class Belt(NamedTuple):
    """The mode, as a mass on a spring carried along by the carriage.

    The thesis gives neither frequency nor mass, only amplitude and decay time (I2).
    """

    frequency: Annotated[
        float, Par("Hz", "frequency of the mode", "calibrated to I2", positive=True, hi=FASTEST)
    ] = 21.8
    decay: Annotated[
        float, Par("1/s", "decay rate of its amplitude", "calibrated to I2", lo=0.0)
    ] = 1.15
    participation: Annotated[
        float,
        Par(
            "1",
            "share of the mode in the stage's motion and in the mass",
            "calibrated to I2, S13c",
            lo=0.0,
            hi=1.0,
        ),
    ] = 0.0226
    slope: Annotated[
        float,
        Par(
            "1/m",
            "relative rise of the frequency along the rod, from its middle",
            VARIANT,
            lo=-5.0,
            hi=5.0,
        ),
    ] = 0.0


_MIDDLE = 0.5 * nominal.TRAVEL  # m


@kernel
def tensioned(p: Belt, x: float) -> Belt:
    """The mode where the carriage stands: the free lengths of the belt change with the place.

    Parameters
    ----------
    p : Belt
        Parameters of the mode in the middle of the rod.
    x : float
        Position, m.

    Returns
    -------
    Belt
        Of this place.
    """
    frequency = p.frequency * (1.0 + p.slope * (x - _MIDDLE))
    return Belt(frequency, p.decay, p.participation, p.slope)


@kernel
def step(p: Belt, q: float, speed: float, kick: float, h: float) -> tuple[float, float]:
    """The mode after one step: q'' + 2 d q' + w^2 q = -a by the implicit midpoint rule.

    Without a kick the energy can only fall, whatever the step.

    Parameters
    ----------
    p : Belt
        Parameters of the mode.
    q : float
        Deflection, m.
    speed : float
        Speed of the deflection, m/s.
    kick : float
        What the carriage's speed gains in the step, m/s.
    h : float
        Length of the step, s.

    Returns
    -------
    q : float
        New deflection, m.
    speed : float
        New speed, m/s.
    """
    w = 2.0 * math.pi * p.frequency
    stiff = 0.25 * h * h * w * w
    damp = h * p.decay
    s0 = speed - kick
    s1 = (s0 * (1.0 - damp - stiff) - h * w * w * q) / (1.0 + damp + stiff)
    return q + 0.5 * h * (s0 + s1), s1


@kernel
def reaction(p: Belt, mass: float, q: float, speed: float) -> float:
    """Force of the mode on the carriage.

    Spring and damper push the carriage with what they pull the mode's mass back with.

    Parameters
    ----------
    p : Belt
        Parameters of the mode.
    mass : float
        Mass of the carriage, kg.
    q : float
        Deflection, m.
    speed : float
        Speed of the deflection, m/s.

    Returns
    -------
    float
        N.
    """
    w = 2.0 * math.pi * p.frequency
    return p.participation * mass * (w * w * q + 2.0 * p.decay * speed)
