"""One closed loop of a Prandtl-Ishlinskii operator: its size, and operators of a given size."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis.prandtl import Prandtl, operator


class Loop(NamedTuple):
    """A slow cycle from one end of an input span to the other and back."""

    stroke: float  # from end to end, unit of the output
    width: float  # between both branches in the middle of the span, unit of the output


def measured(thresholds: Array, weights: Array, span: float) -> Loop:
    """The loop over a span, wherever it lies.

    Between the ends -A and A a play of threshold r < A moves by 2 (A - r), and its two branches are
    2 min(r, A - r) apart in the middle.
    """
    left = np.maximum(0.5 * span - thresholds, 0.0)
    stroke = float(np.sum(2.0 * weights * left))
    return Loop(stroke, float(np.sum(2.0 * weights * np.minimum(thresholds, left))))


def shaped(loop: Loop, span: float, spread: float, plays: int, widening: float = 0.0) -> Prandtl:
    """The operator with a given loop and weights w_0 and b exp(-r / (spread span))."""
    r = 0.5 * span * np.arange(plays) / plays
    shape = np.exp(-r / (spread * span))
    shape[0] = 0.0
    one = measured(r, shape, span)
    weights = loop.width / one.width * shape
    weights[0] = (loop.stroke - loop.width * one.stroke / one.width) / span
    if not weights[0] > 0.0:
        most = one.width / one.stroke
        share = loop.width / loop.stroke
        accepted = f"below {most:.3g} of the stroke with weights of spread {spread:g}"
        raise InputError("hysteresis, width of the loop", float(f"{share:.6g}"), accepted)
    return operator(r, weights, 0.0, widening)
