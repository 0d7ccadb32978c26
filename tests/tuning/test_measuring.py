"""What a run on the bench is measured by."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.control.settings import Control
from macromicro.settings import Settings
from macromicro.tuning import _measuring


def test_macro_metrics_are_those_of_the_recording() -> None:
    shown = _measuring.macro(Settings())
    x, motor = (shown.recording[name] for name in ("macro_position", "motor"))
    error = 2800.0 - x
    assert shown.metrics["iae"] == pytest.approx(np.abs(error).sum() * 1e-3)
    assert shown.metrics["final_error"] == error[-1]
    row = round(shown.metrics["settling_time"] * 1e3)
    assert np.all(np.abs(error[row:]) <= 56.0)
    assert abs(error[row - 1]) > 56.0
    taps = Control().pd_tuned
    asked = taps.now * error[1:] + taps.before * error[:-1]
    asked = np.abs(asked) + 3.0 * (asked != 0.0)
    assert shown.metrics["peak_effort"] == pytest.approx(asked.max())
    assert shown.metrics["saturated"] == np.count_nonzero(asked > 5.0)
    assert np.count_nonzero(np.abs(motor[1:]) >= 5.0) == shown.metrics["saturated"]


def test_reversals_of_a_law_that_hunts() -> None:
    """The uncompensated PID of Section 4.3.1 swings about its target, the tuned PD does not."""
    hunting = _measuring.macro(Settings(controller=Control(macro_law="pid"))).metrics
    assert hunting["reversals"] > 2.0
    assert math.isnan(hunting["settling_time"])
    assert _measuring.macro(Settings()).metrics["reversals"] == 0.0


def test_micro_metrics() -> None:
    """Settling as S13a and S13b have it."""
    shown = _measuring.micro(Settings())
    assert 0.3 <= shown.metrics["settle_up"] <= 0.7
    assert 0.7 <= shown.metrics["settle_down"] <= 1.3
    assert 0.0 < shown.metrics["saturated"] < 1.0
    assert shown.metrics["overshoot"] < 10.0


def test_a_run_that_the_guard_ends_has_no_metrics() -> None:
    settings = Settings()
    tight = settings._replace(guard=settings.guard._replace(hottest=60.0))
    shown = _measuring.micro(tight)
    assert not shown.recording.attributes["finished"]
    assert all(math.isnan(value) for value in shown.metrics.values())
