"""Margins of a piezo stage: on what was found, and on what it may be as well."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from macromicro.commission import piezo
from macromicro.commission._piezo_fit import Loops, Swing
from macromicro.commission.piezo import Model
from macromicro.machines import loops, machine, piezo_loop, piezo_sheets

FILE = Path(__file__).parents[2] / "examples" / "machines" / "piezo-800um.toml"


@pytest.fixture(scope="module")
def tree() -> Any:
    return machine.load(FILE)[1]


def model(tree: Any, stroke: float = 0.0, swing: tuple[float, ...] = (0.0,) * 4) -> Model:
    """What may have been found; standard deviations are parts of the values."""
    size = tree.stack.stroke
    loop = Loops((0.0,), (1e-6,), 0.01, size, 0.1, (0.0, stroke * size, 0.0), (), 0.0)
    hertz, damping = piezo_sheets.loaded_resonance(tree.guide), tree.hidden.damping
    values = (hertz, damping, 1e-4, 100.0)
    wide = tuple(np.multiply(swing, values).tolist())
    return Model(loop, Swing(*values, False, wide, ()))


def test_they_are_those_of_the_loop_where_nothing_is_uncertain(tree: Any) -> None:
    found = piezo.robust_loop(tree, model(tree))
    p, dt = tree.controller, tree.timing.period
    f = loops.grid(dt, 1e-3 * p.drift)
    expected = loops.margins(f, piezo_loop.law(p, f, dt) * piezo_loop.plant(tree, f))
    assert found.found == expected and found.least == pytest.approx(expected, rel=1e-9)
    assert (found.stable, found.drawn) == (200, 200)
    assert piezo.robustness(tree, model(tree)).doubts == ()


def test_the_gain_margin_goes_with_the_stroke(tree: Any) -> None:
    found = piezo.robust_loop(tree, model(tree, stroke=0.02))
    # By the largest of 200 normal draws, and the crossover by the smallest.
    for part in (1.0 - found.least.gain / found.found.gain,
                 1.0 - found.least.crossover / found.found.crossover):  # fmt: skip
        assert 0.02 * 2.0 < part < 0.02 * 4.5


@pytest.mark.parametrize("which", [0, 1, 2])
def test_resonance_damping_and_lag_count(tree: Any, which: int) -> None:
    swing = [0.0] * 4
    swing[which] = 0.1
    found = piezo.robust_loop(tree, model(tree, swing=tuple(swing)))
    assert found.least.gain < 0.999 * found.found.gain
    assert found.stable == 200


def test_gains_that_may_not_hold_are_doubtful(tree: Any) -> None:
    gain = piezo.robust_loop(tree, model(tree)).found.gain
    p = tree.controller
    wild = tree._replace(controller=p._replace(integral=0.99 * gain * p.integral))
    assert "the loop may ring" in piezo.robustness(wild, model(tree)).doubts[0]
    (said,) = piezo.robustness(wild, model(tree, stroke=0.05)).doubts
    assert "of 200 models" in said and "a sensor with less noise" in said


def test_without_a_second_integral_there_is_one_pole(tree: Any) -> None:
    slower = tree._replace(controller=tree.controller._replace(drift=0.0))
    found = piezo.robust_loop(slower, model(slower))
    assert found.stable == 200 and found.found.phase > 60.0
