"""Phases of a response on the branch of a model's."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.drawing import phases


def test_they_lie_on_the_model_s_branch_whatever_their_own_is() -> None:
    lag = np.linspace(-0.5, -12.0, 60)
    model = np.exp(1j * lag)
    assert phases.degrees(model, model) == pytest.approx(np.degrees(lag))
    off = phases.degrees(2.0 * np.exp(1j * (lag + 0.2)), model)
    assert off - np.degrees(lag) == pytest.approx(np.degrees(0.2))
    assert -360.0 <= phases.degrees(-model, -model)[0] <= 0.0
