"""The Preisach plane step by step (Section 2.4.1), with a model of a smooth relay density.

The model is only driven by its input; the integrals for (2.7)-(2.9) are computed separately.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.hysteresis import FodTable, Preisach, from_density
from macromicro.hysteresis.pictures import staircase

# The limiting triangle, alpha_0 = beta_0 = 1, and the grid of the model's table.
EXTENT, STEP = 1.0, 0.01
# u_1 to u_4 of Figures 2.13-2.16, and two more for a third trapezoid in Figure 2.17.
INPUTS = (0.7, -0.5, 0.4, -0.1)
FURTHER = (0.25, 0.1)
# alpha' and beta' of Figure 2.19.
FOD = (0.5, -0.3)
CENTRE, SPREAD = 0.3, 0.35


class Stage(NamedTuple):
    u: float
    f: float
    beta: Array  # of the staircase L(t)
    alpha: Array  # of the staircase L(t)
    path: Array  # inputs and outputs on the way there, shape (2, points)


class Trapezoid(NamedTuple):
    """Q_k: its corners M_k, m_k and m_(k-1), and its weight."""

    top: float
    low: float
    before: float
    integrated: float  # over the density
    readings: tuple[float, float]  # f_(M, m_k) and f_(M, m_(k-1)) of the model, for (2.10)

    @property
    def difference(self) -> float:
        """(2.10): half the difference of the two readings."""
        return 0.5 * (self.readings[0] - self.readings[1])


class Geometry(NamedTuple):
    stages: list[Stage]  # at u_0 = -beta_0 and after each of the inputs
    trapezoids: list[Trapezoid]  # of the last stage
    output: float  # f by (2.11) from them
    major: Array  # inputs, rising and falling branch, shape (3, points)
    fod: Array  # inputs and outputs down from alpha', shape (2, points)
    corner: tuple[float, float, float]  # f_alpha', f_alpha'beta' and the weight of T(alpha', beta')


def density(alpha: Array, beta: Array) -> Array:
    """mu(alpha, beta), not normalised: a hill about (0.3, -0.3), symmetric as f+ = -f-."""
    return np.asarray(
        np.exp(-((alpha - CENTRE) ** 2 + (beta + CENTRE) ** 2) / (2.0 * SPREAD**2)), dtype=float
    )


def model() -> Preisach:
    """The model: outputs from f- = -1 to f+ = 1, in negative saturation."""
    table = from_density(density, -EXTENT, STEP, round(2.0 * EXTENT / STEP) + 1)
    return Preisach(FodTable(table.lo, table.step, 2.0 * table.values, -1.0))


def collect() -> Geometry:
    element = model()
    stages = [_stage(element, np.array([[element.u], [element.f]]))]
    for u in (*INPUTS, *FURTHER):
        inputs = np.linspace(element.u, u, 101)
        stages.append(_stage(element, np.stack((inputs, element.run(inputs)))))
    corners, reader = element.corners.tolist(), model()
    trapezoids, before = [], -EXTENT
    whole = weight(EXTENT, -EXTENT)
    for top, low in corners:
        integrated = (weight(top, before) - weight(top, low)) / whole
        readings = (fod(reader, top, low), fod(reader, top, before))
        trapezoids.append(Trapezoid(top, low, before, integrated, readings))
        before = low
    output = -1.0 + sum(q.readings[0] - q.readings[1] for q in trapezoids)
    alpha, beta = FOD
    down = np.linspace(alpha, -EXTENT, 151)
    curve = np.stack((down, [fod(reader, alpha, u) for u in down]))
    corner = (fod(reader, alpha, alpha), fod(reader, alpha, beta), weight(alpha, beta) / whole)
    return Geometry(stages, trapezoids, output, np.stack(element.table.major_loop), curve, corner)


def fod(element: Preisach, alpha: float, beta: float) -> float:
    """f_alpha'beta': from negative saturation up to `alpha`, down to `beta`; resets the model."""
    element.reset()
    element.step(alpha)
    return element.step(beta)


def weight(alpha: float, beta: float) -> float:
    """The integral of the density over the triangle T(alpha, beta), not normalised."""
    nodes, shares = np.polynomial.legendre.leggauss(64)
    up = 0.5 * (alpha + beta) + 0.5 * (alpha - beta) * nodes
    scale = SPREAD * math.sqrt(2.0)
    inner = [math.erf((u + CENTRE) / scale) - math.erf((beta + CENTRE) / scale) for u in up]
    hill = np.exp(-((up - CENTRE) ** 2) / scale**2)
    return float(
        0.25 * math.sqrt(math.pi) * scale * (alpha - beta) * np.sum(shares * hill * np.array(inner))
    )


def _stage(element: Preisach, path: Array) -> Stage:
    beta, alpha = staircase(element)
    return Stage(element.u, element.f, beta, alpha, path)
