"""The linear loop: the cascade over the frequency against the law itself, stability by Nyquist."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from macromicro.control import cascade, notch
from macromicro.control.cascade import Cascade
from macromicro.control.notch import Delays, Notch
from macromicro.control.stage_law import Sample, Target
from macromicro.machines import deriving, loops, sheets
from macromicro.machines.axis import DEFAULT


@pytest.mark.parametrize(("frequency", "dt"), [(5.0, 1e-3), (40.0, 1e-3), (150.0, 2.5e-4)])
def test_the_cascade_is_that_of_the_law(frequency, dt):
    p = Cascade(position=30.0, velocity=4.0, integral=50.0, observer=900.0, limit=1e9)
    cycles = math.ceil(2.0 * frequency)
    n = round(cycles / (frequency * dt))
    w = 2.0 * math.pi * cycles / (n * dt)  # whole cycles in n periods
    memory = cascade.start(p, Sample(0.0, 0.0))
    efforts = []
    for k in range(4 * n):
        place = math.sin(w * k * dt)
        memory, effort = cascade.step(p, memory, Target(0.0, 0.0, 0.0), Sample(k * dt, place), dt)
        efforts.append(effort)
    last = np.array(efforts[-n:])
    t = np.arange(3 * n, 4 * n) * dt
    line = np.polynomial.Polynomial.fit(t, last, 1)
    phasor = 2.0 * np.mean((last - line(t)) * np.exp(-1j * w * t)) * 1j
    truth = loops.law(p, np.array([w / (2.0 * math.pi)]), dt)[0]
    assert -phasor == pytest.approx(truth, rel=2e-2)


def test_nyquist_by_hand():
    # k (1 + s) / s^2 (1 + s / 20)^2: stable for small k only.
    f = np.geomspace(1e-4, 1e3, 4000)
    s = 2j * math.pi * f
    body = (1.0 + s) / (s * s * (1.0 + s / 20.0) ** 2)
    poles = [np.roots([1 / 400, 0.1, 1.0, k, k]) for k in (2.0, 60.0)]
    assert [bool(np.all(p.real < 0.0)) for p in poles] == [True, False]
    assert loops.modulus(2.0 * body) == pytest.approx(np.abs(1.0 + 2.0 * body).min())
    assert loops.modulus(2.0 * body) > 0.3
    assert loops.modulus(60.0 * body) < 0.0


def test_a_bandwidth_is_lowered_until_the_mode_leaves_the_loop_alone():
    soft = DEFAULT.with_(
        {
            "drive.frequency": "30 Hz",
            "drive.damping": 0.01,
            "motor.inertia": "1e-4 kg*m^2",
            "encoder.at": "load",
            "encoder.pitch": "5 um",
        }
    )
    w = deriving.bandwidth(soft)
    dt = soft.timing.period
    frequency = loops.grid(dt, 1e-6 * w)
    loop = sheets.plant(soft, frequency) * loops.law(soft.controller, frequency, dt)
    assert loops.modulus(loop) == pytest.approx(0.5, abs=0.15) and loops.modulus(loop) > 0.49
    higher = soft.controller._replace(velocity=soft.controller.velocity * 1.5)
    quick = sheets.plant(soft, frequency) * loops.law(higher, frequency, dt)
    assert loops.modulus(quick) < 0.5
    assert w < deriving.BEYOND * 2.0 * math.pi * 30.0


def test_the_cascade_of_a_bandwidth():
    made = loops.gains(100.0, 0.02, 0.25, 7.0)
    assert made[:4] == (25.0, 2.0, 25.0, 700.0)


def test_margins_of_a_loop_known_in_closed_form():
    # 20 / (s (1 + s/10) (1 + s/100)): crossover where |L| = 1, gain margin 110 / 20.
    f = np.geomspace(0.05, 100.0, 4000)
    s = 2j * math.pi * f
    found = loops.margins(f, 20.0 / (s * (1.0 + s / 10.0) * (1.0 + s / 100.0)))
    assert found.gain == pytest.approx(5.5, rel=1e-3)
    w = 2.0 * math.pi * found.crossover
    assert 20.0 / (w * abs((1 + 1j * w / 10) * (1 + 1j * w / 100))) == pytest.approx(1.0, rel=1e-4)
    assert found.phase == pytest.approx(
        90.0 - math.degrees(math.atan(w / 10.0) + math.atan(w / 100.0)), abs=0.01
    )
    assert found.modulus < 2.0 * math.sin(math.radians(found.phase) / 2.0) + 1e-6
    none = loops.margins(f, 1e-3 / (1.0 + s))
    assert math.isnan(none.crossover) and math.isnan(none.phase) and math.isnan(none.gain)
    double = loops.margins(f, 100.0 * (1.0 + s / 5.0) / s**2)  # from -180 deg on
    assert 0.0 < double.phase < 90.0


def test_margins_are_those_of_the_closed_loop_s_poles():
    # k / (s (1 + s/10) (1 + s/100)): at its limit with k = 110.
    f = np.geomspace(0.05, 100.0, 4000)
    s = 2j * math.pi * f
    body = 1.0 / (s * (1.0 + s / 10.0) * (1.0 + s / 100.0))
    for k in (20.0, 100.0, 120.0, 2000.0):
        found = loops.margins(f, k * body)
        poles = np.roots([1e-3, 0.11, 1.0, k])
        assert found.stable == bool((poles.real < 0.0).all())
        if found.stable:
            assert found.gain == pytest.approx(110.0 / k, rel=1e-3)
        assert (found.phase > 0.0) == found.stable and -180.0 < found.phase <= 180.0


@pytest.mark.parametrize("turned", [0.02, -0.02])
def test_noise_at_the_lowest_frequency_does_not_turn_the_margins_by_a_whole_turn(turned):
    # 20 / ((1 + s)(1 + s/10)(1 + s/100)), whose first point is a little above or below the axis.
    f = np.geomspace(1e-3, 100.0, 4000)
    s = 2j * math.pi * f
    loop = 20.0 / ((1.0 + s) * (1.0 + s / 10.0) * (1.0 + s / 100.0))
    clean = loops.margins(f, loop)
    loop[0] *= np.exp(1j * turned)
    assert loops.margins(f, loop) == pytest.approx(clean)
    assert clean.stable and clean.phase == pytest.approx(36.4, abs=0.1)
    assert clean.gain == pytest.approx(122.1 / 20.0, rel=1e-2)


def test_a_conditionally_stable_loop_is_stable_and_its_gain_may_grow():
    # 40 (1 + s)^2 / s^3 (1 + s/50): below a gain of its own unstable, stable at this one.
    f = np.geomspace(1e-3, 100.0, 4000)
    s = 2j * math.pi * f
    body = (1.0 + s) ** 2 / (s**3 * (1.0 + s / 50.0))
    for k in (0.2, 5.0):
        poles = np.roots([0.02, 1.0, k, 2.0 * k, k])
        assert loops.margins(f, k * body).stable == bool((poles.real < 0.0).all())


def test_a_notch_passes_what_its_filter_does() -> None:
    p, dt = Notch(40.0, 0.2, 0.4), 1e-3
    n, f = 4000, np.array([15.0, 40.0, 130.0])
    t = np.arange(n) * dt
    for one, passed in zip(f.tolist(), loops.notch_response(p, f, dt), strict=True):
        delays, out = Delays(0.0, 0.0), []
        for u in np.sin(2.0 * math.pi * one * t).tolist():
            delays, y = notch.step(p, delays, u, dt)
            out.append(y)
        turned = 2.0 * np.mean(np.array(out[2000:]) * np.exp(-2j * math.pi * one * t[2000:]))
        assert turned * 1j == pytest.approx(passed, abs=1e-3)
    assert abs(loops.notch_response(p, f, dt)[1]) == pytest.approx(0.2)
    assert (loops.notch_response(Notch(600.0), f, dt) == 1.0).all()


def test_under_a_notch_the_loop_is_quicker_and_robust_against_the_mode_beside_it():
    soft = DEFAULT.with_(
        {"drive.frequency": "30 Hz", "motor.inertia": "1e-5 kg*m^2", "encoder.at": "load"}
    )
    rotor, load = sheets.turning(soft), soft.load.mass
    middle = 30.0 * math.sqrt((rotor + load) / rotor)
    quick = soft.with_({"controller.notch.frequency": f"{middle} Hz"})
    w = deriving.bandwidth(quick)
    assert 1.2 * deriving.bandwidth(soft) < w <= deriving.NOTCHED * 2.0 * math.pi * 30.0
    frequency = loops.grid(quick.timing.period, 1e-6 * w)
    law = loops.law(quick.controller, frequency, quick.timing.period)
    for beside in (0.95, 1.0, 1.05):
        there = quick._replace(drive=quick.drive._replace(frequency=30.0 * beside))
        assert loops.modulus(sheets.plant(there, frequency) * law) > 0.49
    assert quick.motion.jerk <= 0.5 * 30.0 * quick.motion.acceleration * 1.01


def test_a_held_effort_is_the_mean_of_its_steps() -> None:
    """Half a period and the delay late at low frequencies; nothing passes at the loop's own."""
    timing = SimpleNamespace(period=1e-3, delay=0.4e-3)
    low = loops.hold_and_delay(np.array([2j * np.pi * 5.0]), timing)[0]
    assert abs(low) == pytest.approx(1.0, abs=1e-4)
    assert -np.angle(low) / (2.0 * np.pi * 5.0) == pytest.approx(0.9e-3, rel=1e-6)
    at = np.array([2j * np.pi * f for f in (500.0, 1000.0)])
    assert np.abs(loops.hold_and_delay(at, timing)) == pytest.approx([2.0 / np.pi, 0.0], abs=1e-9)


def scanned(x, gain, phase):
    """Crossover, phase margin and gain margin by a look at one frequency after the other."""
    crossover = margin = grow = math.nan
    for k in range(len(x) - 1):
        if math.isnan(crossover) and gain[k] >= 0.0 > gain[k + 1]:
            share = gain[k] / (gain[k] - gain[k + 1])
            crossover = math.exp(x[k] + share * (x[k + 1] - x[k]))
            margin = 180.0 + math.degrees(phase[k] + share * (phase[k + 1] - phase[k]))
        if math.isnan(grow) and phase[k] > -math.pi >= phase[k + 1] and gain[k + 1] < 0.0:
            share = (phase[k] + math.pi) / (phase[k] - phase[k + 1])
            grow = math.exp(-(gain[k] + share * (gain[k + 1] - gain[k])))
    return crossover, margin, grow


def test_margins_are_those_of_the_first_frequencies_that_have_them():
    """Bit for bit, of loops that cross several times."""
    f = loops.grid(1e-3, 0.01)
    s = 2j * math.pi * f
    random = np.random.Generator(np.random.PCG64(3))
    for _ in range(20):
        gain, slow, w = np.exp(random.uniform(0.0, 6.0, 3)) * (1.0, 1.0, 5.0)
        peak = w**2 / (s**2 + 0.02 * w * s + w**2)
        loop = gain * (1.0 + s / slow) / s**2 * (1.0 + 3.0 * peak) * np.exp(-2e-3 * s)
        phase = np.unwrap(np.angle(loop))
        phase -= 2.0 * math.pi * math.ceil(phase[0] / (2.0 * math.pi))
        expected = scanned(np.log(f), np.log(np.abs(loop)), phase)
        np.testing.assert_array_equal(loops.margins(f, loop)[:3], expected)
