"""The macro-stage's laws: Section 4.3, with and without the dead-zone inverse."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control import macro
from macromicro.control.macro import LAWS, NAMES, MacroLaw
from macromicro.control.pd import PdInitial, PdTuned
from macromicro.control.pid import Pid
from tests.control.errors import by_error

REST = macro.rest(0.0)


def law(number: int, dead_zone: float = 3.0) -> MacroLaw:
    """A law with the thesis' gains."""
    return MacroLaw(number, dead_zone, 5.0, (Pid(), PdInitial(), PdTuned()))


@given(
    st.sampled_from([0, 1, 2]),
    st.floats(0.0, 5.0),
    st.lists(st.floats(-4000.0, 4000.0), min_size=1, max_size=20),
)
def test_effort_never_leaves_the_converter_s_range(
    number: int, dead_zone: float, errors: list[float]
) -> None:
    """Section 3.1: +-5 V."""
    s = REST
    for error in errors:
        s, effort = by_error(law(number, dead_zone), s, error, 1e-3)
        assert -5.0 <= effort <= 5.0
        assert s[number].error == error  # the law's own, and no other's
        assert all(m == r for m, r in zip(s, REST, strict=True) if m is not s[number])


def test_the_laws_are_the_thesis_in_its_order() -> None:
    """Section 4.3: the PID goes uncompensated, both PD controllers with the inverse."""
    assert NAMES == ("pid", "pd-initial", "pd-tuned")
    assert [law.compensated for law in LAWS] == [False, True, True]
    error, before = 40.0, 41.0
    s = macro.rest(before)
    _, one = by_error(law(1), s, error, 1e-3)
    assert one == pytest.approx(3.0 + 0.00245865 * error + 0.0000998447 * before)
    _, two = by_error(law(2), s, error, 1e-3)
    assert two == pytest.approx(3.0 + 0.0124593 * error - 0.0112178 * before)
    after, zero = by_error(law(0, 0.0), s, error, 1e-3)
    assert zero == pytest.approx(0.02 * error + 0.007e-3 * error - 2.5)
    assert macro.integral(after) == pytest.approx(0.007e-3 * error)


@given(st.sampled_from([1, 2]), st.floats(-100.0, 100.0))
def test_uncompensated_effort_is_the_compensated_less_the_dead_zone(
    number: int, error: float
) -> None:
    """Figure 4.9."""
    _, bare = by_error(law(number, 0.0), macro.rest(error), error, 1e-3)
    _, lifted = by_error(law(number, 3.0), macro.rest(error), error, 1e-3)
    lift = 3.0 if bare > 0.0 else -3.0 if bare < 0.0 else 0.0
    assert lifted == pytest.approx(bare + lift)


@pytest.mark.parametrize("width", [0.0, 0.2, 1.0, 3.0])
@pytest.mark.parametrize("effort", [0.7, -0.7, 0.0])
def test_an_effort_is_lifted_over_a_dead_zone_of_any_width(width: float, effort: float) -> None:
    lifted = effort + width * ((effort > 0.0) - (effort < 0.0))
    assert macro.sent(effort, width, 5.0) == pytest.approx(lifted)
    assert macro.sent(effort, width, 0.5) == pytest.approx(min(max(lifted, -0.5), 0.5))
