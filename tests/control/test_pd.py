"""PD controllers (4.9) and (4.10): Sections 4.3.2 and 4.3.3."""

from __future__ import annotations

import cmath
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control import pd
from macromicro.control.pd import PdInitial, PdMemory, PdTuned
from macromicro.schema.par import Entry, entries

errors = st.floats(-3000.0, 3000.0)


@given(errors, errors)
def test_effort_is_the_sum_of_two_taps(now: float, before: float) -> None:
    """(4.9): D(z) = (now z + before) / z."""
    p = PdInitial()
    memory, effort = pd.step(p, PdMemory(before), now, 1e-3)
    assert effort == p.now * now + p.before * before
    assert memory == PdMemory(now) and pd.start(now) == PdMemory(now)


def loop_gain(now: float, before: float, w: float, dt: float = 1e-3) -> complex:
    """D(z) times the position model (4.4) at angular frequency `w` [rad/s]."""
    z = cmath.exp(1j * w * dt)
    return (now * z + before) / z * 0.16572 / (z * z - 1.95833 * z + 0.95833)


@pytest.mark.parametrize(
    ("p", "crossover", "margin"), [(PdInitial(), 9.91, 76.3), (PdTuned(), 4.91, 85.7)]
)
def test_crossover_and_phase_margin(
    p: PdInitial | PdTuned, crossover: float, margin: float
) -> None:
    """Sections 4.3.2, 4.3.3 (M11, M11b): only the minus in (4.10) puts it at 4.91 rad/s."""
    low, high = 1.0, 40.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if abs(loop_gain(p.now, p.before, middle)) > 1.0:
            low = middle
        else:
            high = middle
    assert low == pytest.approx(crossover, rel=0.005)
    phase = math.degrees(cmath.phase(loop_gain(p.now, p.before, low)))
    assert 180.0 + phase == pytest.approx(margin, abs=0.3)


def test_a_3000_count_step_under_4_10_asks_for_37_volts_then_3_72() -> None:
    """Section 4.3.3 (M12), erratum 7: it does saturate."""
    p = PdTuned()
    first, effort = pd.step(p, pd.start(0.0), 3000.0, 1e-3)
    assert effort == pytest.approx(37.4, abs=0.1)
    assert pd.step(p, first, 3000.0, 1e-3)[1] == pytest.approx(3.72, abs=0.01)


@pytest.mark.parametrize("entry", [*entries(PdInitial()), *entries(PdTuned())])
def test_a_tap_may_have_either_sign(entry: Entry) -> None:
    """The two of a derivative have opposite ones."""
    assert entry.par.lo == -entry.par.hi < 0.0
