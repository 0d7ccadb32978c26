"""Inverse of a rate-independent Prandtl-Ishlinskii operator: the mirrored branch (Kuhnen 2003)."""

from __future__ import annotations

import numpy as np

from macromicro.hysteresis.prandtl import Plays, Prandtl


def inverse(p: Prandtl) -> Prandtl:
    """The operator that undoes another one.

    Its input is the other's output less its offset. Weights beside the first are 0 or below, since
    a compensator must lead where the stage lags.

    Parameters
    ----------
    p : Prandtl
        From `prandtl.operator`; its widening is not inverted.

    Returns
    -------
    Prandtl
        Thresholds in the unit of the output, weights input per output, no offset.

    Examples
    --------
    >>> from macromicro.hysteresis import prandtl
    >>> from macromicro.hysteresis.prandtl_inverse import inverse
    >>> p = prandtl.operator(thresholds=[0.0, 10.0], weights=[0.02, 0.01])  # V to um
    >>> prandtl.run(inverse(p), prandtl.run(p, [100.0, 30.0])).round(6).tolist()  # V
    [100.0, 30.0]
    """
    total = np.cumsum(p.weights)
    # r'_i = sum over j <= i of w_j (r_i - r_j).
    thresholds = p.thresholds * total - np.cumsum(p.weights * p.thresholds)
    # w'_0 = 1/w_0, w'_i = -w_i / (W_i W_(i-1)) with W the sum up to i.
    weights = np.empty_like(p.weights)
    weights[0] = 1.0 / p.weights[0]
    weights[1:] = -p.weights[1:] / (total[1:] * total[:-1])
    return Prandtl(thresholds, weights, 0.0, 0.0)


def undone(p: Prandtl, s: Plays) -> Plays:
    """The state of the inverse that belongs to a state of the operator.

    Parameters
    ----------
    p, s : Prandtl, Plays
        The operator (not its inverse) and its state.

    Returns
    -------
    Plays
        State of `inverse(p)`; its array is its own.

    Examples
    --------
    >>> from macromicro.hysteresis import prandtl
    >>> from macromicro.hysteresis.prandtl_inverse import inverse, undone
    >>> p = prandtl.operator(thresholds=[0.0, 10.0], weights=[0.02, 0.01])
    >>> start = undone(p, prandtl.relaxed(p, u=50.0))  # both begin at 50 V
    >>> prandtl.run(inverse(p), [1.5], start).round(6).tolist()  # 1.5 um belong to 50 V
    [50.0]
    """
    # y'_i = sum over j <= i of w_j y_i + sum over j > i of w_j y_j.
    below = np.cumsum(p.weights)
    shares = p.weights * s.y
    y = below * s.y + shares.sum() - np.cumsum(shares)
    return Plays(y, float(y[0]))
