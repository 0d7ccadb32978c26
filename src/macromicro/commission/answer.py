"""How an axis with a mode of its structure answers a chirp: spectra, response, transients.

The speeds of a pair of passes are subtracted, and their spectrum is explained by that of the
efforts through the linear model of two masses with a drive between them (`sheets.impedance`):

    V(f) = G(f) U(f) + T(f)

V is the spectrum of a record that neither begins nor ends at rest, so T is what a transient
leaves: a sum over the poles of G with free weights, linear in them (Pintelon and Schoukens,
System Identification, 2nd ed., Section 2.6.3).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.commission import shaking
from macromicro.commission.stand import Record
from macromicro.machines import sheets
from macromicro.machines.parts import LOAD, MOTOR

Complex = npt.NDArray[np.complex128]

_ALIASES = 2  # of the sampled spectrum, either side
_GONE = -8.0  # real part of a pole, times the period
EVEN = math.sqrt(0.5)  # antiresonance to resonance where nothing shows it: equal masses
DAMPED = 0.04  # damping ratio of the modes tried


class Shape(NamedTuple):
    """What explains the spectra.

    Attributes
    ----------
    drag : float
        Viscous slope to the mass, 1/s.
    lag : float
        By which efforts act late, s.
    rise : float
        Time constant of the current's rise, by which back-EMF acts late, too, s.
    resonance : float
        Of motor and load against each other, Hz; 0: none.
    ratio : float
        Antiresonance to resonance.
    damping : float
        Ratio, of the load on the drive with the motor held.
    at : str
        Where the encoder is.
    """

    drag: float
    lag: float
    rise: float = 0.0
    resonance: float = 0.0
    ratio: float = EVEN
    damping: float = DAMPED
    at: str = MOTOR

    @property
    def rotor(self) -> float:
        """The motor's part of all that moves."""
        return self.ratio**2 if self.resonance > 0.0 else 0.5

    @property
    def held(self) -> float:
        """Frequency of the load, the motor held, Hz."""
        return self.ratio * self.resonance


class Spectra(NamedTuple):
    """Of all pairs, at the frequencies of the chirp.

    Attributes
    ----------
    f : ndarray, shape (n,)
        Hz.
    effort, speed : ndarray of complex, shape (pairs, n)
        V, m/s.
    dt : float
        Control period, s.
    """

    f: Array
    effort: Complex
    speed: Complex
    dt: float


def spectra(passes: Sequence[Record], dt: float) -> Spectra:
    """Of the differences of pairs.

    Parameters
    ----------
    passes : Sequence[Record]
        As `shaking.shaken` gives them.
    dt : float
        Control period, s.

    Returns
    -------
    Spectra
        Up to where the chirp ends.
    """
    n = min(len(one.t) for one in passes)
    u = np.array([one.u[: n - 1] for one in passes])
    v = np.diff([one.x[:n] for one in passes], axis=1) / dt
    f: Array = np.arange((n + 1) // 2) / ((n - 1) * dt)
    rows = (f >= shaking.LOW) & (f <= shaking.HIGH / dt)
    efforts, speeds = (np.fft.rfft(w[::2] - w[1::2], axis=1)[:, rows] for w in (u, v))
    return Spectra(f[rows], efforts, speeds, dt)


def response(shape: Shape, f: Array, dt: float) -> Complex:
    """Mean speed over a period, per effort, of an axis with a mass of 1, sampled.

    Parameters
    ----------
    shape : Shape
        Of the axis.
    f : ndarray, shape (n,)
        Hz.
    dt : float
        Control period, s.

    Returns
    -------
    ndarray of complex, shape (n,)
        m/s per V, times the mass.
    """
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
    """Spectra that the poles leave, a row each.

    Parameters
    ----------
    shape : Shape
        Of the axis.
    f : ndarray, shape (n,)
        Hz.
    dt : float
        Control period, s.

    Returns
    -------
    ndarray of complex, shape (m, n)
        To be weighted by real numbers.
    """
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
    """Of the speed.

    Parameters
    ----------
    shape : Shape
        Of the axis.

    Returns
    -------
    ndarray of complex, shape (m,)
        1/s.
    """
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
