"""(5.6) as transfer function, modes and ladder: three ways to say the same."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lti
from scipy.signal import step as lti_step

from macromicro.errors import InputError
from macromicro.models import heating
from macromicro.models.heating import COLD, Ladder, Modes, from_transfer

PRINTED = from_transfer(*heating.PRINTED)
positive = st.floats(0.05, 20.0)


def modes_of(p: Ladder) -> Modes:
    """The modes of a ladder: eigenvalues of its heat balance."""
    g = 1.0 / np.array([p.r1, p.r2, p.r3])
    root = np.sqrt([p.c1, p.c2, p.c3])
    matrix = np.array([[g[0], -g[0], 0.0], [-g[0], g[0] + g[1], -g[1]], [0.0, -g[1], g[1] + g[2]]])
    rates, vectors = np.linalg.eigh(matrix / np.outer(root, root))
    shares = vectors[0] ** 2 / p.c1 / rates
    order = np.argsort(-rates)
    return Modes(*(float(v) for v in rates[order]), *(float(v) for v in shares[order]))


def test_poles_of_the_printed_transfer_function() -> None:
    """Claim S7: poles -1.375, -0.1052, -0.01062 rad/s, DC gain 1.0098."""
    assert PRINTED[:3] == pytest.approx((1.375, 0.1052, 0.01062), rel=1e-3)
    assert sum(PRINTED[3:]) == pytest.approx(1.0098, abs=1e-4)


def test_printed_ladder() -> None:
    """Claim S7: C1 0.999, R1 0.7454, C2 44.93, R2 0.2126, C3 1768, R3 0.0517."""
    ladder = heating.ladder(PRINTED)
    assert ladder == pytest.approx((0.999, 0.7454, 44.93, 0.2126, 1768, 0.0517), rel=1e-3)


def test_step_response_is_that_of_the_transfer_function() -> None:
    t, y = lti_step(lti(*heating.PRINTED), T=np.linspace(0.0, 100.0, 500))
    np.testing.assert_allclose(heating.step_response(PRINTED, t), y, atol=1e-9)


def test_steps_in_time_are_exact() -> None:
    """A constant goal: however long the steps, the same temperature."""
    s = COLD
    for _ in range(50):
        s = heating.heated(PRINTED, s, 80.0, 0.2)
    assert sum(s) == pytest.approx(80.0 * float(heating.step_response(PRINTED, 10.0)), rel=1e-12)
    # (5.9): one time constant for everything
    fallen = heating.cooled(PRINTED, s, 0.0, 1.0, 2.0)
    assert sum(fallen) == pytest.approx(sum(s) * np.exp(-2.0))


@given(*[positive] * 6)
def test_ladder_and_modes_are_one(
    c1: float, r1: float, c2: float, r2: float, c3: float, r3: float
) -> None:
    made = Ladder(c1, r1, c2, r2, c3, r3)
    modes = modes_of(made)
    assert min(modes) > 0.0
    assert sum(modes[3:]) == pytest.approx(r1 + r2 + r3, rel=1e-9)
    t = np.geomspace(0.01, 1e4, 40)
    back = modes_of(heating.ladder(modes))
    np.testing.assert_allclose(
        heating.step_response(back, t), heating.step_response(modes, t), rtol=1e-4
    )


@given(st.tuples(*[st.floats(0.01, 10.0)] * 3), st.tuples(*[positive] * 3))
def test_transfer_function_and_modes_are_one(
    steps: tuple[float, float, float], shares: tuple[float, float, float]
) -> None:
    rates = tuple(float(v) for v in np.cumsum(steps)[::-1])
    modes = Modes(*rates, *shares)
    t = np.geomspace(0.01, 100.0, 30)
    back = from_transfer(*heating.transfer(modes))
    np.testing.assert_allclose(
        heating.step_response(back, t), heating.step_response(modes, t), rtol=1e-4
    )


def test_what_no_ladder_can_be() -> None:
    with pytest.raises(InputError, match="above 0"):
        heating.ladder(PRINTED._replace(share2=-0.1))
    for bad in ((1.0, 1.0, 1.0, 1.0), (1.0, 0.1, 1.0)):
        with pytest.raises(InputError, match="negative real poles"):
            from_transfer((1.0,), bad)


def test_each_part_cools_towards_its_share_of_the_goal() -> None:
    """(5.9): all three fall with the one time constant, each to its own end."""
    p = Modes(1.4, 0.1, 0.01, 0.7, 0.2, 0.11)
    s = heating.Heat(40.0, 30.0, 20.0)
    left = np.exp(-0.5 / 1.25)
    ends = np.array(p[3:]) * 10.0
    now = heating.cooled(p, s, 10.0, 1.25, 0.5)
    np.testing.assert_allclose(now, ends + (np.array(s) - ends) * left, rtol=1e-12)
