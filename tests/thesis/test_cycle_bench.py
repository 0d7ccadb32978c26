"""The cycle bench: Appendix D, figures A1-A4 over 20 cycles of 4 s."""

from __future__ import annotations

import numpy as np
import pytest
from tests.thesis.fixture_drives import cycled

from macromicro.thesis import cycle_bench
from macromicro.thesis.cycle_bench import CycleBench

SPEC = CycleBench()


@pytest.fixture(scope="module")
def times() -> np.ndarray:
    """Rows tau1, tau2, fall time [s] of each of 20 cycles."""
    count = cycled(20)[0]
    rows = []
    for k in range(20):
        up, down = count[4000 * k : 4000 * k + 2000], count[4000 * k + 2000 : 4000 * k + 4000]
        assert (up >= 149.0).any() and (down <= 0.0).any()
        there = int(np.argmax(up >= 149.0))
        zeros = np.flatnonzero(up[:there] <= 0.0)
        left = int(zeros[-1]) if len(zeros) else 0
        rows.append((there / 1e3, (there - left) / 1e3, int(np.argmax(down <= 0.0)) / 1e3))
    return np.array(rows).T


def test_rise_time_tau1(times: np.ndarray) -> None:
    """Appendix D (A1): step to 149 of 150 counts, about 0.23 s, falling and settling."""
    late = times[0, 5:]
    assert late.min() >= 0.18 and late.max() <= 0.30
    assert times[0, 0] > times[0, -1]


def test_rise_time_tau2(times: np.ndarray) -> None:
    """Appendix D (A2): first motion to 149 counts, about 0.18 s."""
    late = times[1, 5:]
    assert late.min() >= 0.14 and late.max() <= 0.24


def test_fall_time(times: np.ndarray) -> None:
    """Appendix D (A3): 150 counts to 0, 1.0-1.45 s, growing and settling."""
    assert times[2].min() >= 1.0 and times[2].max() <= 1.45
    assert times[2, -1] > times[2, 0]


def test_dead_time_stays_above_zero(times: np.ndarray) -> None:
    """Appendix D (A4): tau1 - tau2 > 0 in every cycle."""
    assert np.all(times[0] > times[1])


def test_fixture_is_appendix_d_s() -> None:
    """Appendix D: 17 um encoder, 5 V supply, 23 degC, no flexure."""
    p = cycle_bench.prepare(SPEC)
    assert p.encoder.pitch == 17e-6
    assert p.micro.driver.gain == pytest.approx((5.0 / 4.0) ** 2)
    assert p.micro.thermal.ambient == 23.0
    assert p.micro.load.rate == SPEC.bias.rate
    assert cycle_bench.measure(p, cycle_bench.initial(p), 0.0).encoder == 0.0
    assert cycle_bench.measure(p, cycle_bench.initial(p), 0.0).extend == 1.0
