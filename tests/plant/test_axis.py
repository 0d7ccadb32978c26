"""The axis in motion: balance of forces, the two-mass mode, backlash, gravity, delay, encoder."""

import math

import numpy as np
import pytest

from macromicro.kernel import compiled
from macromicro.machines.axis import DEFAULT, derive_all, prepare
from macromicro.plant import axis
from macromicro.plant.friction import before_sliding

NOISE = np.zeros((1, 1))
DT = 1e-3
FREE = DEFAULT._replace(
    friction=DEFAULT.friction._replace(coulomb=0.0, stribeck=0.0, viscous=0.0),
    load=DEFAULT.load._replace(stop_low=-50.0, stop_high=50.0),
    timing=DEFAULT.timing._replace(delay=0.0),
)


def params(tree=FREE, **sets):
    """Runtime parameters with some values of some sets: ``drive={"frequency": 30.0}``."""
    tree = tree._replace(**{n: getattr(tree, n)._replace(**v) for n, v in sets.items()})
    return prepare(derive_all(tree))


def run(p, effort, periods, s=None):
    s = axis.at_rest(p) if s is None else s
    states = [s]
    for k in range(periods):
        u = effort(k * DT) if callable(effort) else effort
        s = axis.advance(p, s, u, NOISE, 0, DT)
        states.append(s)
    return states


@pytest.mark.parametrize("frequency", [0.0, 60.0])
def test_its_top_speed_is_where_back_emf_and_friction_take_the_voltage(frequency):
    drive = {"frequency": frequency, "damping": 0.2}
    p = params(friction={"coulomb": 3.0, "viscous": 4.0}, drive=drive)
    s = run(p, 1.0, 3000)[-1]
    k, r = p.power.emf, p.power.resistance
    assert s.v == pytest.approx((2.4 - r / k * 3.0) / (k + r / k * 4.0), rel=1e-3)
    assert s.i == pytest.approx((3.0 + 4.0 * s.v) / k, rel=1e-3)
    strain = (3.0 + 4.0 * s.v) / p.body.stiffness if frequency else 0.0
    assert s.xm - s.x == pytest.approx(strain, rel=1e-2) and s.vm == pytest.approx(s.v, rel=1e-3)


def test_force_accelerates_all_that_moves():
    p = params(amplifier={"mode": "current", "bandwidth": 1e5}, load={"mass": 1.5, "payload": 0.5})
    s = run(p, 1.0, 50)[-1]
    rotor = 2.4e-6 / 8e-3**2
    assert p.body.motor == pytest.approx(rotor)
    assert s.v == pytest.approx(0.4 * p.power.push / (2.0 + rotor) * 0.05, rel=2e-3)


@pytest.mark.parametrize("frequency", [0.0, 60.0])
def test_a_slope_pulls_down_and_friction_holds_it(frequency):
    drive = {"frequency": frequency, "damping": 0.2}
    p = params(load={"incline": math.radians(30.0), "mass": 2.0}, drive=drive)
    assert p.body.weight == pytest.approx(2.0 * 9.80665 * 0.5)
    s = run(p, 0.0, 20)[-1]
    assert s.v < 0.0 and s.i > 0.0
    held = params(load={"incline": math.radians(30.0)}, friction={"coulomb": 5.0}, drive=drive)
    assert abs(run(held, 0.0, 300)[-1].x) < 20e-6


@pytest.mark.parametrize("frequency", [0.0, 60.0])
def test_end_stops_end_the_way(frequency):
    p = params(
        load={"stop_low": -0.02, "stop_high": 0.03},
        drive={"frequency": frequency, "damping": 0.2},
        friction={"coulomb": 1.0},
    )
    push = 1.0 / p.power.resistance * 2.4 * p.power.push
    for effort, stop in ((1.0, 0.03), (-1.0, -0.02)):
        s = run(p, effort, 1500)[-1]
        assert abs(s.v) < 1e-3
        assert abs(s.x - stop) == pytest.approx(push / 1e5, rel=0.25)


def test_two_masses_swing_at_the_frequency_and_damping_of_their_spring():
    p = params(
        amplifier={"mode": "current"},
        drive={"frequency": 40.0, "damping": 0.01, "inertia": 60e-6},
    )
    load, motor = p.load.mass, p.body.motor
    assert p.body.stiffness == pytest.approx(load * (2.0 * math.pi * 40.0) ** 2)
    start = axis.at_rest(p)._replace(x=1e-3)
    states = run(p, 0.0, 400, start)
    apart = np.array([s.x - s.xm for s in states])
    free = 40.0 * math.sqrt(1.0 + load / motor)
    crossings = np.flatnonzero(np.diff(np.sign(apart)))
    periods = (len(crossings) - 1) / 2.0
    assert periods / ((crossings[-1] - crossings[0]) * DT) == pytest.approx(free, rel=0.02)
    # Damping of the free mode: the spring's own, stiffer and lighter by the same factor.
    zeta = 0.01 * math.sqrt(1.0 + load / motor)
    t = 0.3
    amplitude = np.abs(apart[int(t / DT) : int(t / DT) + 30]).max()
    assert amplitude == pytest.approx(1e-3 * math.exp(-2.0 * math.pi * free * zeta * t), rel=0.25)
    centre = [(load * s.x + motor * s.xm) / (load + motor) for s in states]
    assert max(centre) - min(centre) < 1e-9  # nothing pushes from outside


def test_a_stiff_drive_is_the_limit_of_a_flexible_one():
    # The mode itself is left aside by a smooth effort.
    effort = lambda t: math.sin(2.0 * math.pi * 5.0 * t) ** 2  # noqa: E731
    stiff = run(params(), effort, 200)[-1]
    soft = run(params(drive={"frequency": 400.0, "damping": 0.1}), effort, 200)[-1]
    assert soft.x == pytest.approx(stiff.x, rel=2e-3) and soft.v == pytest.approx(stiff.v, rel=1e-2)


def test_backlash_lets_the_motor_turn_before_the_load_moves():
    p = params(
        drive={"frequency": 60.0, "damping": 0.3, "backlash": 1e-3},
        friction={"coulomb": 2.0},
    )
    states = run(p, 0.3, 400)
    moved = next(s for s in states if s.x > 1e-4)
    assert moved.xm - moved.x >= 0.5e-3
    back = run(p, -0.3, 400, states[-1])
    assert next(s for s in back if s.v < -1e-3).xm - states[-1].x < 0.5e-3


def test_cogging_turns_the_motor_into_its_places():
    p = params(drive={"cogging": 2.0, "cogging_period": 0.01}, friction={"viscous": 30.0})
    s = run(p, 0.0, 3000, axis.at_rest(p)._replace(x=0.004))[-1]
    assert s.x == pytest.approx(0.005, abs=1e-4)


def test_an_effort_acts_after_its_delay():
    p = params(amplifier={"bits": 24})._replace(delay=0.4e-3)
    late = axis.advance(p, axis.at_rest(p), 1.0, NOISE, 0, DT)
    early = axis.advance(p._replace(delay=0.0), axis.at_rest(p), 1.0, NOISE, 0, 0.6e-3)
    assert late.effort == 1.0
    whole = p._replace(delay=0.0)
    assert late.v < axis.advance(whole, axis.at_rest(p), 1.0, NOISE, 0, DT).v
    assert late.v == pytest.approx(early.v, rel=0.1)
    held = axis.advance(p._replace(delay=DT), axis.at_rest(p), 1.0, NOISE, 0, DT)
    assert held.v == 0.0 and held.effort == 1.0
    assert axis.advance(p._replace(delay=DT), held, 0.0, NOISE, 0, DT).v > 0.0


def test_the_encoder_counts_at_its_place():
    p = params(drive={"error": 1e-4, "error_period": 0.02}, encoder={"at": "load"})
    p = p._replace(reading=p.reading._replace(encoder=p.reading.encoder._replace(pitch=1e-5)))
    s = axis.at_rest(p)._replace(x=0.005, xm=0.004)
    assert axis.place(p, s) == pytest.approx(0.0051)
    assert axis.truth(p, s._replace(v=0.2, i=0.3)) == pytest.approx((0.0051, 0.2, 0.3))
    assert axis.measured(p, s, NOISE, 0) == 510.0
    motor = p._replace(reading=p.reading._replace(at_load=0))
    assert axis.measured(motor, s, NOISE, 0) == 400.0
    assert axis.measured(motor, s._replace(xm=0.004006), NOISE, 0) == 401.0
    noisy = motor._replace(reading=motor.reading._replace(noise=1e-5))
    assert axis.measured(noisy, s, np.array([[2.0]]), 0) == 402.0


def test_at_rest_the_bristles_carry_the_weight_they_can():
    p = params(load={"incline": 0.1}, friction={"coulomb": 3.0, "stribeck": 0.0})
    z = axis.at_rest(p).rubbed
    stiffness, _ = before_sliding(p.friction, 1.0)
    assert z * stiffness == pytest.approx(-p.body.weight)
    steep = params(load={"incline": 1.5}, friction={"coulomb": 3.0, "stribeck": 0.0})
    assert axis.at_rest(steep).rubbed * stiffness == pytest.approx(-3.0)


@pytest.mark.parametrize("frequency", [0.0, 60.0])
def test_compiled_it_does_the_same(frequency):
    p = params(
        drive={"frequency": frequency, "cogging": 0.3, "backlash": 1e-5 if frequency else 0.0},
        friction={"coulomb": 1.0, "stribeck": 0.2, "ripple": 0.1, "viscous": 1.0},
    )
    s = axis.at_rest(p)
    for k in range(20):
        now = axis.advance(p, s, 0.1 * k, NOISE, 0, DT)
        assert tuple(compiled(axis.advance)(p, s, 0.1 * k, NOISE, 0, DT)) == tuple(now)
        s = now
