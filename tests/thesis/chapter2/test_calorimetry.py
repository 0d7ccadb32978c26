"""The virtual calorimeter (Appendix A)."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.plant.bench import Bench
from macromicro.thesis.chapter2 import _actuator_runs
from macromicro.thesis.chapter2._actuator_runs import RATE, peak, scan, specimen


def test_peaks_hold_the_latent_heat() -> None:
    """12-24 kJ/kg in the literature; taken in on heating, given back on cooling."""
    bench = Bench()
    for latent in (bench.wire.latent, 0.6 * bench.wire.latent):
        up, down = scan(specimen(bench._replace(wire=bench.wire._replace(latent=latent))))
        assert peak(up).heat * up.mass == pytest.approx(latent, rel=1e-3)
        assert peak(down).heat * down.mass == pytest.approx(-latent, rel=1e-3)


def test_baseline_is_the_heat_capacity() -> None:
    bench = Bench()
    up, down = scan(specimen(bench))
    for trace, sign in ((up, 1.0), (down, -1.0)):
        level = trace.flow[np.abs(trace.sample - 115.0) < 1.0].mean()
        assert level == pytest.approx(sign * bench.thermal.wire_capacity * RATE, rel=1e-3)
    assert up.mass == pytest.approx(9.3e-6, rel=0.01)


def test_readings_are_in_order() -> None:
    """Heating ends above, cooling below; the hysteresis lies between the tops."""
    up, down = (peak(trace) for trace in scan(specimen(Bench())))
    assert up.onset < up.top < up.end
    assert down.onset > down.top > down.end
    assert up.top > down.top + 10.0
    assert down.end > _actuator_runs.LOW and up.end < _actuator_runs.HIGH
