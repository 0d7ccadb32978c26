"""The two exponentials that (5.8) joins, Figure 5.14."""

from __future__ import annotations

import numpy as np

from macromicro.thesis.chapter5 import electrothermal


def test_gain_lies_between_its_exponentials_and_meets_each() -> None:
    """(5.7): the weight passes from 1 to 0 around 1.7 V, where it is a half."""
    volts, rise = electrothermal.curve(1.5, 2.0, 501)
    lower, upper = electrothermal.exponentials(volts)
    assert (rise >= lower - 1e-9).all() and (rise <= upper + 1e-9).all()
    assert abs(rise[0] - lower[0]) < 0.05
    assert abs(rise[-1] / upper[-1] - 1.0) < 1e-3
    middle = int(np.argmin(np.abs(volts - 1.7)))
    np.testing.assert_allclose(rise[middle], 0.5 * (lower[middle] + upper[middle]), rtol=1e-6)


def test_lower_exponential_is_cut_off_at_zero() -> None:
    """(5.8): max(0, ...); without it, -37 K and less below 1.46 V."""
    lower, upper = electrothermal.exponentials(np.array([1.3, 1.46]))
    assert lower.tolist() == [0.0, 0.0]
    assert (upper > 82.58).all()
