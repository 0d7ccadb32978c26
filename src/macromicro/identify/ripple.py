"""A force that repeats along the way: cogging of a motor, teeth of a belt or a gear.

    w = A sin(k x + phi)

It goes with the place and is no noise: errors of a fit that leaves it out are not those of a noise
with its spectrum.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array

_LEAST, _MOST = 2.0, 200.0  # periods in the range of places
_FINE = 6  # tried in a period more of that range
_SHARE = 0.3  # of the force's power: less may be chance
_ENOUGH = 20_000  # samples that are tried
_AT_ONCE = 200_000  # values of a sine


class Ripple(NamedTuple):
    """A periodic force.

    Attributes
    ----------
    turn : float
        k, rad per unit of place.
    size : float
        A, unit of force.
    sine, cosine : float
        A cos phi and A sin phi.
    """

    turn: float
    size: float
    sine: float
    cosine: float

    def at(self, place: Array, shift: float | Array = 0.0) -> Array:
        """The force at places.

        Parameters
        ----------
        place : ndarray, shape (n,)
            Places.
        shift : float or ndarray, shape (n,), optional
            By which the phase is later, rad.

        Returns
        -------
        ndarray, shape (n,)
            Unit of force.
        """
        angle = self.turn * place + shift
        return np.asarray(self.sine * np.sin(angle) + self.cosine * np.cos(angle))


def ripple(force: list[Array], place: list[Array], taken: list[Array]) -> Ripple | None:
    """The periodic force that explains much of what is left of a force.

    Parameters
    ----------
    force : list[ndarray]
        What is left of each record, shape (n,).
    place : list[ndarray]
        Where, shape (n,).
    taken : list[ndarray]
        What each parameter of the fit adds to the force, shape (n, p).

    Returns
    -------
    Ripple or None
        None where no period explains a third of the power, beside the parameters.
    """
    every = max(sum(map(len, force)) // _ENOUGH, 1)
    x = np.concatenate([p[::every] for p in place])
    extent = float(np.ptp(x))
    if not extent > 0.0:
        return None
    basis = np.linalg.qr(_scaled(np.concatenate([t[::every] for t in taken])))[0]
    left = np.concatenate([f[::every] for f in force])
    left = left - basis @ (basis.T @ left)
    turns = 2.0 * np.pi * np.arange(_LEAST, _MOST, 1.0 / _FINE) / extent
    best = turns[np.argmax(_explained(turns, x, left, basis)[0])]
    if best == turns[0]:  # no period, but what goes with the place more slowly than any
        return None
    nearby = best + np.linspace(-1.0, 1.0, 41) * (turns[1] - turns[0])
    powers, pairs = _explained(nearby, x, left, basis)
    at = int(np.argmax(powers))
    if not powers[at] > _SHARE * float(left @ left):
        return None
    sine, cosine = pairs[at].tolist()
    return Ripple(float(nearby[at]), float(np.hypot(sine, cosine)), sine, cosine)


def _scaled(table: Array) -> Array:
    size = np.linalg.norm(table, axis=0)
    return table / np.where(size > 0.0, size, 1.0)


def _explained(turns: Array, x: Array, left: Array, basis: Array) -> tuple[Array, Array]:
    """Power that periods explain beside the parameters, and the sine and cosine of each."""
    powers, found = np.zeros(len(turns)), np.zeros((len(turns), 2))
    many = max(_AT_ONCE // len(x), 1)
    for first in range(0, len(turns), many):
        rows = slice(first, first + many)
        angle = np.outer(turns[rows], x)
        sine, cosine = np.sin(angle), np.cos(angle)
        moments = np.stack([sine @ left, cosine @ left], axis=1)
        lost = np.stack([sine @ basis, cosine @ basis], axis=1)
        crossed = np.einsum("kn,kn->k", sine, cosine)
        whole = np.einsum("kn,kn->k", sine, sine)
        square = np.array([[whole, crossed], [crossed, len(x) - whole]]).transpose(2, 0, 1)
        square -= lost @ lost.transpose(0, 2, 1)
        # Of a sine alone where the cosine is a combination of the parameters.
        found[rows] = np.einsum("kij,kj->ki", np.linalg.pinv(square, 1e-12, True), moments)
        powers[rows] = np.einsum("ki,ki->k", moments, found[rows])
    return powers, found
