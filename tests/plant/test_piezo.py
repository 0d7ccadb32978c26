"""The piezo stage: its loop, its resonance, and the order in which they act."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis import prandtl
from macromicro.hysteresis.prandtl_loop import measured
from macromicro.kernel import compiled, kernel
from macromicro.machines.parts import Timing
from macromicro.machines.piezo import Piezo
from macromicro.plant import piezo
from macromicro.plant.creep import Creep
from macromicro.plant.high_voltage import HighVoltage
from macromicro.plant.piezo import (
    Guide,
    Hidden,
    PiezoPlant,
    PiezoState,
    Stack,
    Warming,
)

DT = 1e-4
AS_PRINTED = Hidden(stronger=1.0, detuned=1.0)
AMPLIFIER = HighVoltage(current=0.06, capacitance=3e-6)
SPEC = Piezo(amplifier=AMPLIFIER, hidden=AS_PRINTED, timing=Timing(1e-4, 0.0, 4))
P = piezo.prepare(SPEC)
FAST = SPEC._replace(amplifier=HighVoltage(bandwidth=1e7, current=1e4), creep=Creep(decades=0))


@kernel
def drive(p: PiezoPlant, s: PiezoState, volts: Array, dt: float, out: Array) -> PiezoState:
    """Along commanded voltages: true position and voltage after each period, and a reading."""
    for k in range(volts.shape[0]):
        s = piezo.advance(p, s, 0.1 * volts[k], dt)
        out[0, k] = piezo.position(s)
        out[1, k] = s.volts
        out[2, k] = piezo.measured(p, s, 0.5)
    return s


def driven(p: PiezoPlant, volts: Array, dt: float = DT) -> Array:
    """Rows of `drive`, interpreted."""
    out = np.empty((3, len(volts)))
    drive(p, piezo.initial(p), volts, dt, out)
    return out


def test_the_loop_has_the_stroke_and_the_width_that_are_given() -> None:
    hidden = Hidden(1.0, 1.0, 0.02, 0.3, 20, 0.002)
    p = piezo.loop(Stack(100e-6, 120.0, 0.1), hidden)
    assert measured(p.thresholds, p.weights, 120.0) == pytest.approx((100e-6, 10e-6))
    assert p.weights[11] / p.weights[1] == pytest.approx(math.exp(-10 * 3.0 / (0.3 * 120.0)))
    assert (p.thresholds.size, p.widening) == (20, 0.002)
    more = piezo.loop(Stack(100e-6, 120.0, 0.1), hidden._replace(stronger=1.2))
    assert more.weights == pytest.approx(1.2 * p.weights)
    with pytest.raises(InputError, match=r"below 0\.239 of the stroke"):
        piezo.loop(Stack(hysteresis=0.25), Hidden(spread=0.1))


def test_a_load_lowers_the_resonance_as_printed() -> None:
    """PI P-621.1CD: 800 Hz, 520 Hz with 20 g, 240 Hz with 120 g; within 8 %."""
    assert piezo.loaded_resonance(Guide(load=0.0)) == 800.0
    assert piezo.loaded_resonance(Guide(load=0.02)) == pytest.approx(520.0, rel=0.02)
    assert piezo.loaded_resonance(Guide(load=0.12)) == pytest.approx(240.0, rel=0.08)
    assert P.omega == pytest.approx(2.0 * math.pi * piezo.loaded_resonance(Guide()))
    off = piezo.prepare(SPEC._replace(hidden=Hidden(detuned=0.9)))
    assert off.omega == pytest.approx(0.9 * P.omega)


@given(
    st.floats(10.0, 1e4), st.floats(0.001, 0.9), st.floats(-1.0, 1.0), st.floats(-100.0, 100.0),
    st.floats(-1.0, 1.0), st.floats(1e-5, 1e-2),
)  # fmt: skip
@settings(max_examples=50, deadline=None)
def test_the_oscillator_is_exact_for_any_step(
    w: float, zeta: float, x: float, v: float, rest: float, dt: float
) -> None:
    once = piezo.swung(w, zeta, x, v, rest, dt)
    half = piezo.swung(w, zeta, *piezo.swung(w, zeta, x, v, rest, 0.5 * dt), rest, 0.5 * dt)
    assert half == pytest.approx(once, rel=1e-7, abs=1e-9 * (1.0 + w))

    def energy(x: float, v: float) -> float:
        return v * v + w * w * (x - rest) * (x - rest)

    assert energy(*once) <= energy(x, v) * (1.0 + 1e-9) + 1e-12


def test_the_oscillator_obeys_its_equation() -> None:
    """x'' = w^2 (rest - x) - 2 zeta w x', by differences over a short step."""
    w, zeta, x, v, rest, h = 300.0, 0.1, 0.4, -20.0, 1.5, 1e-7
    after = piezo.swung(w, zeta, x, v, rest, h)
    assert (after[0] - x) / h == pytest.approx(v, rel=1e-3)
    wanted = w * w * (rest - x) - 2.0 * zeta * w * v
    assert (after[1] - v) / h == pytest.approx(wanted, rel=1e-3)


def test_a_step_overshoots_with_the_resonance_and_its_damping() -> None:
    """Peak after half a period of the damped swing, of exp(-pi zeta / sqrt(1 - zeta^2))."""
    p = piezo.prepare(
        FAST._replace(stack=Stack(hysteresis=0.0), hidden=AS_PRINTED._replace(damping=0.1))
    )
    x = driven(p, np.full(200, 10.0), 2e-5)[0]
    rest = 10.0 * 120e-6 / 140.0
    top = int(np.argmax(x))
    half = math.pi / (p.omega * math.sqrt(1.0 - 0.01))
    assert (top + 1) * 2e-5 == pytest.approx(half, abs=4e-5)
    assert x[top] / rest - 1.0 == pytest.approx(math.exp(-0.1 * p.omega * half), abs=0.02)


def test_slow_cycles_show_the_stack_loop_and_creep() -> None:
    """The position is the operator's output with creep after it, once the mechanics rest."""
    still = SPEC._replace(
        hidden=AS_PRINTED._replace(widening=0.0, damping=0.9), guide=Guide(load=0.0)
    )
    p = piezo.prepare(still)
    out = driven(p, np.repeat([40.0, 90.0, 20.0], 700), 1e-3)
    held = prandtl.run(p.hysteresis, [40.0, 90.0, 20.0])
    # Creep after 0.7 s, of the steps before: at most 4 lags of 1.5 % each.
    for k, x in enumerate(held):
        assert abs(out[0, 700 * k + 699] / x - 1.0) < 0.05
    assert out[0, 699] > held[0] * 1.008
    plain = driven(piezo.prepare(still._replace(creep=Creep(decades=0))), np.full(700, 40.0), 1e-3)
    assert plain[0, -1] == pytest.approx(held[0], rel=1e-5)


def test_a_fast_cycle_is_wider_than_a_slow_one() -> None:
    """Bench assumption: thresholds grow with the rate of the voltage at the stack."""
    p = piezo.prepare(FAST._replace(hidden=AS_PRINTED._replace(widening=1.5e-3)))
    widths = []
    for periods in (1000, 50):
        up = np.linspace(0.0, 100.0, periods + 1)[1:]
        path = np.tile(np.r_[up, up[::-1][1:], 0.0], 2)
        x = driven(p, path, 5e-4)[0][-2 * periods :]
        widths.append(x[periods + periods // 2 - 1] - x[periods // 2 - 1])
    assert widths[1] > 1.1 * widths[0]


def test_volts_pass_the_converter_and_the_current_limit() -> None:
    out = driven(P, np.full(100, 500.0))
    assert out[1, 9] == pytest.approx(20.0, rel=1e-6)
    assert out[1, -1] == pytest.approx(120.0, rel=1e-6)


def test_an_effort_acts_after_the_delay() -> None:
    """A quarter of the period late: the first three of four steps are as without it."""
    late = piezo.prepare(SPEC._replace(timing=Timing(1e-4, 0.25e-4, 4)))
    volts = np.array([10.0, 10.0])
    plain, shifted = driven(P, volts)[1], driven(late, volts)[1]
    assert 0.0 < shifted[0] < plain[0]
    three = piezo.advance(P._replace(steps=3), piezo.initial(P), 1.0, 0.75e-4)
    assert shifted[0] == pytest.approx(three.volts, rel=1e-3)
    assert shifted[1] > shifted[0]


def test_a_warming_stage_drifts() -> None:
    """40 nm/K, 5 K: 200 nm in the end, 63 % of it after one time constant."""
    p = piezo.prepare(SPEC._replace(warming=Warming(40e-9, 5.0, 60.0)))
    out = driven(p, np.zeros(600), 0.1)
    assert out[0, -1] == pytest.approx(200e-9 * (1.0 - math.exp(-1.0)), rel=1e-3)
    assert out[2, -1] == pytest.approx(out[0, -1] + 0.5 * 0.4e-9, abs=0.1e-9)
    # Half of the time constant has passed at the 300th row.
    assert out[0, 299] == pytest.approx(200e-9 * (1.0 - math.exp(-0.5)), rel=1e-3)
    # Half a code of the converter is left: 0.07 mV.
    assert np.all(np.abs(driven(P, np.zeros(10), 0.1)[0]) < 0.1e-9)


def test_twice_the_steps_change_little() -> None:
    rng = np.random.default_rng(3)
    volts = np.repeat(rng.uniform(0.0, 100.0, 6), 100)
    a, b = (
        driven(piezo.prepare(SPEC._replace(timing=Timing(1e-4, 0.0, n))), volts)[0] for n in (8, 16)
    )
    assert np.max(np.abs(a - b)) < 0.01 * np.ptp(a)


def test_compiled_equals_interpreted() -> None:
    volts = 50.0 + 50.0 * np.sin(np.linspace(0.0, 12.0, 300))
    out = np.empty((3, 300))
    compiled(drive)(P, piezo.initial(P), volts, DT, out)
    assert np.allclose(out, driven(P, volts), rtol=1e-12, atol=1e-18)
