"""The size of a loop, and operators of a given size."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.hysteresis.prandtl import operator, run
from macromicro.hysteresis.prandtl_loop import Loop, measured, shaped


@given(
    st.lists(st.floats(0.0, 2.0), min_size=1, max_size=8), st.floats(5.0, 200.0),
    st.floats(-50.0, 50.0),
)  # fmt: skip
@settings(max_examples=50, deadline=None)
def test_size_of_a_loop_is_that_of_the_operator(
    others: list[float], span: float, begin: float
) -> None:
    """Wherever it lies, also with thresholds of half the span and more."""
    p = operator(7.0 * np.arange(len(others) + 1), [0.5, *others])
    path = begin + span * np.r_[np.linspace(0, 1, 101), np.linspace(1, 0, 101)[1:]]
    f = run(p, np.tile(path, 2))[-201:]
    expected = (f[100] - f[0], f[150] - f[50])
    assert measured(p.thresholds, p.weights, span) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@given(
    st.floats(1e-6, 1e3), st.floats(0.1, 1000.0), st.floats(0.0, 0.3), st.floats(0.17, 1.0),
    st.integers(8, 40),
)  # fmt: skip
@settings(max_examples=50, deadline=None)
def test_an_operator_has_the_loop_that_it_was_asked_for(
    stroke: float, span: float, share: float, spread: float, plays: int
) -> None:
    p = shaped(Loop(stroke, share * stroke), span, spread, plays, 0.5)
    found = measured(p.thresholds, p.weights, span)
    assert found == pytest.approx((stroke, share * stroke), rel=1e-9, abs=1e-12 * stroke)
    assert p.thresholds == pytest.approx(0.5 * span * np.arange(plays) / plays)
    assert (p.offset, p.widening) == (0.0, 0.5)
    if share > 0.01:
        slope = np.diff(np.log(p.weights[1:]))
        assert slope == pytest.approx(-0.5 / plays / spread)


def test_a_loop_does_not_widen_with_the_rate_unless_asked() -> None:
    assert shaped(Loop(1.0, 0.1), 10.0, 0.3, 8).widening == 0.0


def test_a_loop_too_wide_for_its_shape_is_refused() -> None:
    with pytest.raises(InputError, match=r"0\.3; accepted: below 0\.239 of the stroke"):
        shaped(Loop(10.0, 3.0), 100.0, 0.1, 24)
