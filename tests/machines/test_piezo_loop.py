"""The linear loop of a piezo stage, beside its law and its simulated stage."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from macromicro.control import integral
from macromicro.control.notch import Notch
from macromicro.control.stage_law import Sample, Target
from macromicro.machines import loops, machine, piezo, piezo_loop

FILE = Path(__file__).parents[2] / "examples" / "machines" / "piezo-800um.toml"
# A stage without what the linear loop leaves out.
STRAIGHT = {
    "stack.hysteresis": 0.0, "creep.share": 0.0, "hidden.widening": "0 s", "hidden.stronger": 1.0,
    "warming.change": "0 K", "encoder.noise": "0 m", "encoder.pitch": "1e-15 m",
    "amplifier.current": "100 A", "amplifier.bits": 32, "timing.steps": 20,
}  # fmt: skip


@pytest.fixture(scope="module")
def tree() -> Any:
    made = machine.load(FILE)[1].with_(STRAIGHT)
    one = made.stack.stroke / made.stack.span
    return made._replace(
        controller=made.controller._replace(
            loop_thresholds=(0.0,), loop_weights=(one,), gain=made.amplifier.gain
        )
    )


def turned(values: list[float], f: float, dt: float) -> complex:
    """The part of a frequency in the second half of what was read."""
    y, t = np.array(values), np.arange(len(values)) * dt
    half = slice(len(y) // 2, None)
    basis = np.exp(2j * math.pi * f * np.stack([t[half], -t[half], 0.0 * t[half]]))
    return complex(np.linalg.lstsq(basis.T, y[half], rcond=None)[0][0])


def test_the_law_is_its_steps(tree: Any) -> None:
    p, dt = tree.controller._replace(proportional=0.2), tree.timing.period
    assert p.drift > 0.0 and p.notch.frequency > 0.0
    for f in (20.0, 90.0, 300.0):
        n = round(round(f * 2000 * dt) / (f * dt))
        memory, shown = integral.start(p, Sample(0.0, 0.0)), []
        for k in range(2 * n):
            seen = Sample(k * dt, 1e-6 * math.sin(2.0 * math.pi * f * k * dt))
            memory, _ = integral.step(p, memory, Target(0.0, 0.0, 0.0, math.inf), seen, dt)
            shown.append(-memory.correction)
        # A sine that begins leaves the second integral on a ramp beside it.
        shown = np.array(shown) - np.polyval(np.polyfit(np.arange(2 * n), shown, 1), range(2 * n))
        found = turned(list(shown), f, dt) / (-0.5j * 1e-6)
        assert found == pytest.approx(complex(piezo_loop.law(p, np.array([f]), dt)[0]), rel=0.02)


@pytest.mark.parametrize(
    "of_resonance",
    [
        0.2,
        pytest.param(0.8, marks=pytest.mark.slow),
        1.3,
        pytest.param(2.0, marks=pytest.mark.slow),
    ],
)
def test_the_plant_is_that_of_the_simulated_stage(tree: Any, of_resonance: float) -> None:
    dt, f = tree.timing.period, of_resonance * tree.guide.resonance
    made = tree.with_({"hidden.damping": 0.3, "timing.delay": f"{0.4 * dt!r} s"})
    p = piezo.KIND.prepare(made)
    state, quiet, shown = piezo.KIND.initial(p), np.zeros((1, 1)), []
    for k in range(1500):
        shown.append(piezo.measure(p, state, k * dt, quiet, 0).position)
        state = piezo.advance(p, state, math.sin(2.0 * math.pi * f * k * dt), quiet, 0, dt)
    gain = made.amplifier.gain * made.stack.stroke / made.stack.span
    found = turned(shown, f, dt) / (-0.5j * gain)
    assert found == pytest.approx(complex(piezo_loop.plant(made, np.array([f]))[0]), rel=0.05)


@pytest.mark.parametrize(("part", "grows"), [(0.85, False), (1.15, True)])
def test_the_gain_margin_is_where_the_simulated_loop_rings(
    tree: Any, part: float, grows: bool
) -> None:
    tree, dt = tree.with_("hidden.damping", 0.05), tree.timing.period
    frequency = loops.grid(dt, 1e-3)
    slow = 0.05 * 2.0 * math.pi * tree.guide.resonance  # at twice that an integral rings
    p = tree.controller._replace(integral=slow, drift=0.0, proportional=0.0, notch=Notch(0.0))
    whole = piezo_loop.law(p, frequency, dt) * piezo_loop.plant(tree, frequency)
    most = part * loops.margins(frequency, whole).gain
    assert 1.0 < most < 3.0
    assert (loops.modulus(most * whole, poles=1) < 0.0) == grows
    p = p._replace(integral=most * p.integral)
    plant = piezo.KIND.prepare(tree)
    state, quiet, off = piezo.KIND.initial(plant), np.zeros((1, 1)), []
    memory = integral.start(p, Sample(0.0, 0.0))
    for k in range(2500):
        seen = piezo.measure(plant, state, k * dt, quiet, 0)
        off.append(seen.position - 1e-7)
        memory, effort = integral.step(p, memory, Target(1e-7, 0.0, 0.0, math.inf), seen, dt)
        state = piezo.advance(plant, state, effort, quiet, 0, dt)
    first, last = (np.abs(off[a : a + 500]).max() for a in (800, 2000))
    assert (last > first) == grows
