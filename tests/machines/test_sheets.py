"""What follows from an axis' data sheets, against the motor's own equations."""

import math

import numpy as np
import pytest

from macromicro.machines import deriving, sheets
from macromicro.machines.axis import DEFAULT, derive_all
from macromicro.schema.par import entries

SCREW = DEFAULT.with_({"drive.kind": "screw", "drive.lead": "5 mm", "travel.high": "200 mm"})


def test_the_defaults_follow_their_rules_and_can_work():
    assert derive_all(DEFAULT) == DEFAULT
    assert DEFAULT.together() == []


def test_a_screw_turns_torque_and_inertia_into_force_and_mass():
    ratio = 2.0 * math.pi / 5e-3
    assert sheets.constant(SCREW) == pytest.approx(0.0302 * ratio)
    assert sheets.turning(SCREW) == pytest.approx(2.4e-6 * ratio**2)
    assert sheets.mass(SCREW) == pytest.approx(2.4e-6 * ratio**2 + 0.5)
    assert SCREW.encoder.pitch == pytest.approx(5e-3 / 4000.0)


def test_a_linear_motor_has_its_own_constant_and_no_rotor():
    linear = DEFAULT.with_("drive.kind", "linear")
    assert sheets.constant(linear) == 10.0 and sheets.turning(linear) == 0.0
    assert linear.encoder.pitch == 1e-6


def test_weight_is_that_of_what_moves_on_the_slope():
    up = DEFAULT.with_({"load.incline": "30 deg", "load.payload": "0.3 kg"})
    assert sheets.weight(up) == pytest.approx(0.8 * 9.80665 * 0.5)
    assert up.controller.ahead_gravity > 0.0 and DEFAULT.controller.ahead_gravity == 0.0
    assert sheets.breakaway_force(up) == pytest.approx(3.6 + sheets.weight(up))
    assert sheets.sliding_force(up) == pytest.approx(3.0 + sheets.weight(up))


@pytest.mark.parametrize(
    ("changes", "amperes"),
    [
        ({}, 4.0),
        ({"amplifier.current": "9 A"}, 9.0),
        ({"amplifier.current": "30 A"}, 20.0),  # 24 V / 1.2 ohm
        ({"amplifier.current": "30 A", "amplifier.gain": 1.2}, 10.0),
        ({"amplifier.mode": "current", "amplifier.transconductance": "0.2 A/V"}, 2.0),
        ({"amplifier.mode": "current"}, 4.0),
    ],
)
def test_the_least_of_amplifier_supply_and_d_a_bounds_the_current(changes, amperes):
    tree = DEFAULT.with_(changes) if changes else DEFAULT
    assert sheets.current(tree) == pytest.approx(amperes)
    force = amperes * sheets.constant(tree) * tree.drive.efficiency
    assert sheets.force(tree) == pytest.approx(force)


def test_an_effort_makes_a_force_at_rest():
    k = 0.0302 / 8e-3
    assert sheets.per_newton(DEFAULT) == pytest.approx(1.2 / (k * 2.4))
    by_current = DEFAULT.with_({"amplifier.mode": "current", "drive.efficiency": 0.5})
    assert sheets.per_newton(by_current) == pytest.approx(1.0 / (0.5 * k * 0.4))


def test_the_greatest_speed_leaves_the_reserve():
    v = sheets.fastest(DEFAULT)
    k = sheets.constant(DEFAULT)
    volts = 1.2 / k * (3.0 + 2.0 * v) + k * v
    assert volts == pytest.approx(0.7 * 24.0)
    assert DEFAULT.motion.velocity <= 0.9 * v
    thick = DEFAULT.with_("friction.viscous", "60 N*s/m")
    assert thick.motion.velocity == pytest.approx(
        0.3 * sheets.available_force(thick) / 60.0, rel=1e-3
    )
    assert DEFAULT.motion.acceleration == pytest.approx(
        0.6 * (0.7 * sheets.force(DEFAULT) - 3.0) / sheets.mass(DEFAULT), rel=1e-3
    )
    short = DEFAULT.with_({"travel.high": "2 mm", "travel.low": "-1 mm"})
    assert short.motion.velocity == pytest.approx(
        math.sqrt(0.003 * sheets.available_force(short) / sheets.mass(short)), rel=1e-3
    )
    slow = DEFAULT.with_("encoder.rate", "10000 counts/s")
    assert slow.motion.velocity == pytest.approx(8000.0 * DEFAULT.encoder.pitch, rel=1e-3)


def test_a_motor_too_weak_still_has_finite_limits():
    weak = derive_all(DEFAULT._replace(friction=DEFAULT.friction._replace(coulomb=500.0)))
    assert weak.motion.acceleration > 0.0 and weak.motion.velocity > 0.0


def test_delays_flexibility_and_counts_bound_the_bandwidth():
    assert sheets.lag(DEFAULT) == pytest.approx(1e-3 + 0.1e-3 + 0.24e-3 / 1.2)
    assert deriving.bandwidth(DEFAULT) == pytest.approx(0.33 / 1.3e-3)
    by_current = DEFAULT.with_("amplifier.mode", "current")
    assert sheets.lag(by_current) == pytest.approx(1.1e-3 + 1.0 / (2.0 * math.pi * 1000.0))
    soft = DEFAULT.with_("drive.frequency", "20 Hz")
    assert deriving.bandwidth(soft) == pytest.approx(0.3 * 2.0 * math.pi * 20.0)
    beyond = soft.with_({"encoder.at": "load", "drive.damping": 1.0})
    assert deriving.bandwidth(beyond) == pytest.approx(0.2 * 2.0 * math.pi * 20.0)
    assert soft.motion.jerk < 0.5 * 20.0 * soft.motion.acceleration
    assert soft.controller.loosen == 0.0 and DEFAULT.controller.loosen > 0.0
    p = soft.controller
    held = p.velocity * p.integral * p.position * soft.arrival.tolerance * 0.5
    assert held == pytest.approx(3.6 * sheets.per_newton(soft), rel=1e-3)
    coarse = DEFAULT.with_({"encoder.at": "load", "encoder.pitch": "0.2 mm"})
    w = deriving.bandwidth(coarse)
    step = 7.0 * w * w * sheets.per_newton(coarse) * sheets.mass(coarse) * 2e-4
    assert step == pytest.approx(0.15 * 10.0)


def test_gains_follow_the_bandwidth_and_the_plant():
    w, g = deriving.bandwidth(DEFAULT), DEFAULT.controller
    k = sheets.constant(DEFAULT)
    per = sheets.per_newton(DEFAULT)
    assert g.velocity == pytest.approx(per * sheets.mass(DEFAULT) * w, rel=1e-3)
    assert g.position == g.integral == pytest.approx(w / 4.0, rel=1e-3)
    assert g.observer == pytest.approx(7.0 * w, rel=1e-3)
    assert g.ahead_velocity == pytest.approx(k / 2.4 + 2.0 * per, rel=1e-3)
    assert g.ahead_acceleration == pytest.approx(per * sheets.mass(DEFAULT), rel=1e-3)
    assert g.ahead_friction == pytest.approx(3.0 * per, rel=1e-3)
    by_current = DEFAULT.with_("amplifier.mode", "current").controller
    assert by_current.ahead_velocity == pytest.approx(2.0 / (k * 0.4), rel=1e-3)
    assert DEFAULT.motion.jerk == pytest.approx(0.25 * DEFAULT.motion.acceleration * w, rel=1e-3)


def test_travel_lies_within_soft_limits_within_stops():
    load, guard, travel = DEFAULT.load, DEFAULT.guard, DEFAULT.travel
    assert load.stop_low < guard.low < travel.low <= 0.0
    assert travel.high < guard.high < load.stop_high
    assert travel.high == pytest.approx(0.305 - 0.02 * 0.31, rel=1e-3)
    deep = DEFAULT.with_("load.stop_low", "-100 mm")
    assert deep.travel.low == pytest.approx(-0.1 + 0.02 * 0.405, rel=1e-3)
    assert deep.guard.low == pytest.approx(0.5 * (deep.travel.low - 0.1), rel=1e-3)


def test_the_guard_follows_the_motion():
    assert DEFAULT.guard.speed == pytest.approx(1.5 * DEFAULT.motion.velocity, rel=1e-3)
    lag = DEFAULT.motion.velocity / DEFAULT.controller.position
    assert DEFAULT.guard.error == pytest.approx(lag, rel=1e-3)
    assert DEFAULT.guard.push == pytest.approx(2.0 * 3.6 * sheets.per_newton(DEFAULT), rel=1e-3)


def test_steps_of_the_physics_follow_period_and_mode():
    assert DEFAULT.timing.steps == 20
    assert DEFAULT.with_("timing.period", "0.2 ms").timing.steps == 4
    quick = DEFAULT.with_({"timing.period": "0.04 ms", "timing.delay": "0.02 ms"})
    assert quick.timing.steps == 1
    soft = DEFAULT.with_(
        {
            "drive.frequency": "90 Hz",
            "drive.inertia": "1e-7 kg*m^2",
            "motor.inertia": "3e-7 kg*m^2",
        }
    )
    ratio = 1.0 + 0.5 / sheets.turning(soft)
    stepped = 1e-3 / soft.timing.steps * 2.0 * math.pi * 90.0 * math.sqrt(ratio)
    assert stepped == pytest.approx(0.2, rel=0.05)


def test_the_linear_plant_in_closed_form():
    # Far below the winding and the delays: V = R i + K v, K i = m dv/dt + b v.
    f = np.array([0.02, 0.2, 2.0])
    s = 2j * math.pi * f
    k, m = sheets.constant(DEFAULT), sheets.mass(DEFAULT)
    slow = 2.4 / (1.2 / k * (m * s + 2.0) + k) / s
    assert sheets.plant(DEFAULT, f) == pytest.approx(slow, rel=0.02)
    by_current = DEFAULT.with_("amplifier.mode", "current")
    assert sheets.plant(by_current, f) == pytest.approx(0.4 * k / (m * s + 2.0) / s, rel=0.02)
    late = sheets.plant(DEFAULT, np.array([100.0]))[0]
    early = sheets.plant(DEFAULT.with_("timing.delay", "0 ms"), np.array([100.0]))[0]
    assert late / early == pytest.approx(np.exp(-2j * math.pi * 100.0 * 1e-4))
    hold = (
        early
        / sheets.plant(
            DEFAULT.with_({"timing.delay": "0 ms", "timing.period": "10 us"}), np.array([100.0])
        )[0]
    )
    assert np.angle(hold) == pytest.approx(-math.pi * 100.0 * (1e-3 - 1e-5), abs=1e-6)


def test_the_plant_of_two_masses_has_its_zero_and_its_pole():
    soft = DEFAULT.with_({"drive.frequency": "40 Hz", "drive.damping": 0.001})
    f = np.linspace(20.0, 99.0, 20000)
    motor = np.abs(sheets.plant(soft, f)) * f**2
    assert f[motor.argmin()] == pytest.approx(40.0, rel=0.01)  # seen by the motor's encoder
    free = 40.0 * math.sqrt(1.0 + 0.5 / sheets.turning(soft))
    beside = sheets.plant(soft.with_("encoder.at", "load"), np.array([40.0, free]))
    assert abs(beside[0]) > 10.0 * abs(sheets.plant(soft, np.array([40.0])))[0]
    stiff = sheets.plant(DEFAULT, np.array([2.0]))[0]
    assert sheets.plant(soft, np.array([2.0]))[0] == pytest.approx(stiff, rel=0.02)


def test_the_tolerance_follows_counts_noise_and_slack():
    def tolerance(**changes):
        return DEFAULT.with_({k.replace("_", ".", 1): v for k, v in changes.items()}).arrival

    pitch = DEFAULT.encoder.pitch
    assert DEFAULT.arrival.tolerance == pytest.approx(4.0 * pitch, rel=1e-3)
    assert tolerance(encoder_noise="50 um").tolerance == pytest.approx(200e-6)
    soft = {"drive_frequency": "95 Hz", "drive_backlash": "400 um", "friction_coulomb": "0.5 N"}
    assert tolerance(**soft).tolerance < 300e-6
    assert tolerance(**soft, encoder_at="load", encoder_pitch="5 um").tolerance == 400e-6


def test_the_tolerance_follows_what_friction_lets_go():
    """Stribeck's drop over the velocity gain, for the loop's lag, either side: by hand."""
    fine = DEFAULT.with_(
        {"encoder.at": "load", "encoder.pitch": "0.1 um", "friction.stribeck": "3 N"}
    )
    drop = 3.0 * sheets.per_newton(fine)
    way = sheets.lag(fine) * drop / fine.controller.velocity
    assert way > 8.0 * fine.encoder.pitch
    assert fine.arrival.tolerance == pytest.approx(0.5 * way, rel=1e-3)
    quick = fine.with_("controller.velocity", f"{2.0 * fine.controller.velocity} V*s/m")
    assert quick.arrival.tolerance == pytest.approx(0.25 * way, rel=1e-3)
    none = fine.with_("controller.velocity", "0 V*s/m")
    assert none.arrival.tolerance == pytest.approx(4.0 * fine.encoder.pitch, rel=1e-3)


def test_every_derived_setting_is_a_parameter():
    paths = {e.path for e in entries(DEFAULT)}
    listed = [path for path, _ in deriving.RULES]
    assert set(listed) <= paths and len(set(listed)) == len(listed)
