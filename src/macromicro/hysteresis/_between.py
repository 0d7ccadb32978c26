"""Interpolation between first-order curves along the output, for steep branches."""

# Smooth interpolation in the input would split a steep branch between two curves into two half
# steps. Here the inputs at which both curves reach a share of their fall are interpolated.

from __future__ import annotations

from itertools import pairwise

import numpy as np

from macromicro.arrays import Array
from macromicro.hysteresis.curves import Curve

_BETWEEN = 3  # curves between two neighbours
_LEVELS = 120
_LEAN = 1e-6
_LEAST = 0.02  # of the loop's height: a curve that falls by less has no levels


def along_output(curves: list[Curve], nodes: Array, rising: Array) -> list[Curve]:
    """Curves between neighbours."""
    low, height = float(rising[0]), float(rising[-1] - rising[0])
    share = np.linspace(1.0, 0.0, _LEVELS)
    found = []
    for first, second in pairwise(curves):
        ways = [_inputs(curve, low, share) for curve in (first, second)]
        if min(float(c.f[0]) - low for c in (first, second)) < _LEAST * height:
            continue
        for k in range(1, _BETWEEN + 1):
            w = k / (_BETWEEN + 1)
            u = (1.0 - w) * ways[0] + w * ways[1]
            top = float(np.interp(u[0], nodes, rising))
            found.append(Curve(u, low + share * (top - low)))
    return found


def _inputs(curve: Curve, low: float, share: Array) -> Array:
    """Inputs at which given shares of a curve's fall remain."""
    left = (curve.f - low) / max(float(curve.f[0]) - low, 1e-300)
    # Noise makes a curve rise for a moment, or stand: it falls a little at every point.
    left = np.minimum.accumulate(left) - np.linspace(0.0, _LEAN, left.size)
    return np.asarray(np.interp(-share, -left, curve.u))
