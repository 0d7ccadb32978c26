"""Response of an axis with a structural mode to a chirp: spectra and transients.

    V(f) = G(f) U(f) + T(f)

V, U are differences of pairs of passes, G the two-mass model (`sheets.impedance`), and T a sum over
the poles of G with free weights (Pintelon and Schoukens, System Identification, 2nd ed., Section
2.6.3).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.commission import _shaking
from macromicro.commission.stand import Record
from macromicro.machines import sheets
from macromicro.machines.parts import LOAD, MOTOR

Complex = npt.NDArray[np.complex128]

_ALIASES = 2  # of the sampled spectrum, either side
_GONE = -8.0  # real part of a pole, times the period
EVEN = math.sqrt(0.5)  # antiresonance to resonance where nothing shows it: equal masses
DAMPED = 0.04  # damping ratio of the modes tried


class Shape(NamedTuple):
    drag: float  # viscous slope to the mass, 1/s
    lag: float  # of the effort, s
    rise: float = 0.0  # time constant of the current's rise, by which back-EMF acts late, too, s
    resonance: float = 0.0  # of motor and load against each other, Hz; 0: none
    ratio: float = EVEN  # antiresonance to resonance
    damping: float = DAMPED  # ratio, of the load on the drive with the motor held
    at: str = MOTOR  # side of the encoder

    @property
    def rotor(self) -> float:
        return self.ratio**2 if self.resonance > 0.0 else 0.5

    @property
    def held(self) -> float:
        """Antiresonance: frequency of the load with the motor fixed, Hz."""
        return self.ratio * self.resonance


class Spectra(NamedTuple):
    """Spectra of all pairs at the frequencies of the chirp."""

    f: Array  # Hz
    # effort, speed: V, m/s
    effort: Complex
    speed: Complex
    dt: float  # control period, s


def spectra(passes: Sequence[Record], dt: float) -> Spectra:
    n = min(len(one.t) for one in passes)
    u = np.array([one.u[: n - 1] for one in passes])
    v = np.diff([one.x[:n] for one in passes], axis=1) / dt
    f: Array = np.arange((n + 1) // 2) / ((n - 1) * dt)
    rows = (f >= _shaking.LOW) & (f <= _shaking.HIGH / dt)
    efforts, speeds = (np.fft.rfft(w[::2] - w[1::2], axis=1)[:, rows] for w in (u, v))
    return Spectra(f[rows], efforts, speeds, dt)


def response(shape: Shape, f: Array, dt: float) -> Complex:
    """Mean speed over a period, per effort, of an axis with a mass of 1, sampled."""
    k = np.arange(-_ALIASES, _ALIASES + 1)[:, None]
    s = np.asarray(2j * math.pi * (f + k / dt), np.complex128)
    drag, seen = sheets.impedance(
        s,
        rotor=shape.rotor,
        moved=1.0 - shape.rotor,
        viscous=0.0,
        frequency=shape.held,
        damping=shape.damping,
    )
    speed: Complex = 1.0 / (drag * (1.0 + shape.rise * s) + shape.drag)
    if shape.at == LOAD:
        speed = speed * seen
    # Position after a hold, and its difference over the period that begins with the effort.
    back = np.exp(-2j * math.pi * f * dt)
    shift = (1.0 - back) ** 2 / (back * dt**2)
    found: Complex = shift * np.sum(speed / s**2 * np.exp(-s * shape.lag), axis=0)
    return found


def transients(shape: Shape, f: Array, dt: float) -> Complex:
    """Spectra that the poles leave, a row each."""
    z = np.exp(-2j * math.pi * f * dt)
    rows = [np.ones_like(z), z]
    for p in poles(shape) * dt:
        if p.real < _GONE:
            continue  # gone within a period: the constants hold it
        if p.imag == 0.0:
            rows.append(1.0 / (1.0 - math.exp(p.real) * z))
        elif p.imag > 0.0:
            pole = np.exp(p)
            both = 1.0 - 2.0 * pole.real * z + abs(pole) ** 2 * z * z
            rows += [1.0 / both, z / both]
    return np.array(rows)


def poles(shape: Shape) -> Complex:
    rotor, moved, winding = shape.rotor, 1.0 - shape.rotor, np.array([shape.rise, 1.0])
    if shape.resonance <= 0.0:
        free, stiff = np.array([1.0, 0.0]), np.array([1.0])
    else:
        w = 2.0 * math.pi * shape.held
        spring = moved * np.array([2.0 * shape.damping * w, w * w])  # times s
        stiff = np.polyadd([moved, 0.0, 0.0], spring)
        free = np.polyadd(np.polymul([rotor, 0.0], stiff), np.polymul([moved, 0.0], spring))
    every = np.polyadd(np.polymul(free, winding), shape.drag * stiff)
    found: Complex = np.roots(every).astype(np.complex128)
    return found
