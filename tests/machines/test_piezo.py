"""The machine `piezo`: what follows from its sheet, what it cannot do, and how it runs."""

import math
from itertools import pairwise

import numpy as np
import pytest

import macromicro
from macromicro.errors import InputError
from macromicro.hysteresis.prandtl_fit import fit
from macromicro.hysteresis.prandtl_loop import measured
from macromicro.kernel import compiled
from macromicro.machines import (
    composite,
    machine,
    performing,
    period,
    piezo_sheets,
    planning,
    runs,
    stage,
)
from macromicro.machines.piezo import DEFAULT, KIND
from macromicro.machines.results import moves
from macromicro.machines.rig import Twin
from macromicro.machines.stage import Bounds
from macromicro.motion import s_curve
from macromicro.programme import Programme
from macromicro.schema.par import entries

PIEZO = machine.named("piezo", "test")
OMEGA = 2.0 * math.pi * 511.75


def programme(*micrometres, hold=0.1):
    """Targets one after the other."""
    n = len(micrometres)
    counts = np.round(np.array(micrometres) * 1e-6 / DEFAULT.encoder.pitch)
    hold = np.full(n, hold)
    return Programme("t", np.full(n, math.nan), np.zeros(n, np.int64), counts, hold, math.nan, "t")


def run(tree, *micrometres, hold=0.1):
    """Recording and moves of a run."""
    plan = planning.plan(programme(*micrometres, hold=hold), tree)
    done = runs.record(PIEZO, tree, plan)
    assert done.outcome.finished and done.outcome.fault is None
    return done.recording, moves(done.recording, plan, tree.arrival)


CASES = [
    ({"travel.high": "111 um"}, "travel.high", "at most 110.8 um, which amplifier.high (120 V)"),
    ({"travel.low": "1 um"}, "travel.low", "at most 0 mm"),
    ({"travel.low": "-40 um"}, "travel.low", "which amplifier.low (-20 V) reach"),
    ({"travel.high": "100 um", "guard.high": "0.09 mm"}, "travel.high", "guard.high"),
    ({"travel.low": "-5 um", "guard.low": "-0.004 mm"}, "travel.low", "guard.low (-0.004 mm)"),
    ({"guard.high": "0.2 mm"}, "guard.high", "what the sensor shows"),
    ({"guard.low": "-0.1 mm"}, "guard.low", "what the sensor shows"),
    ({"motion.velocity": "0.06 m/s"}, "motion.velocity", "at most 57.14 mm/s"),
    ({"controller.gain": 9}, "controller.gain", "amplifier.gain (10)"),
    ({"encoder.noise": "5 nm", "arrival.tolerance": "10 nm"}, "arrival.tolerance", "15 nm or more"),
    ({"encoder.noise": "0 nm", "encoder.pitch": "20 nm", "arrival.tolerance": "10 nm"},
     "arrival.tolerance", "encoder.pitch (20 nm) or more"),
    ({"timing.period": "0.2 ms"}, "timing.period", "at most 0.1954 ms, a tenth of a period"),
    ({"timing.delay": "0.15 ms"}, "timing.delay", "timing.period (0.1 ms)"),
    ({"controller.integral": "1300 1/s"}, "controller.integral", "a bandwidth of 205 Hz"),
    ({"controller.proportional": 0.5}, "controller.proportional", "swing up"),
    ({"guard.silent": "0.01 ms"}, "guard.silent", "timing.period (0.1 ms)"),
    ({"guard.stuck": "0.01 ms"}, "guard.stuck", "timing.period"),
    ({"guard.window": "0.01 ms"}, "guard.window", "timing.period"),
    ({"stack.hysteresis": 0.3, "hidden.spread": 0.1}, "stack.hysteresis", "of spread 0.1"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "path", "words"), CASES)
def test_what_it_cannot_do_is_refused(changes, path, words):
    with pytest.raises(InputError) as error:
        DEFAULT.with_(changes)
    assert error.value.where.endswith(path)
    assert words in error.value.accepted


@pytest.mark.parametrize(
    "changes",
    [
        {"travel.high": "110.7 um"},
        {"motion.velocity": "0.057 m/s"},
        {"encoder.noise": "3.3 nm", "arrival.tolerance": "10 nm"},
        {"timing.period": "0.195 ms"},
        {"controller.integral": "1280 1/s"},
    ],
)
def test_what_it_just_can_is_accepted(changes):
    DEFAULT.with_(changes)


def test_gains_follow_from_the_sheet():
    law = DEFAULT.controller
    assert law.integral == pytest.approx(0.15 * OMEGA, rel=1e-3)
    assert law.drift == pytest.approx(0.1 * law.integral, rel=1e-3)
    assert law.notch.frequency == pytest.approx(511.75, rel=1e-3)
    # Half a period, the delay, the amplifier's lag, and 2 zeta / w with a zeta of 0.02.
    lag = 0.05e-3 + 0.02e-3 + 1.0 / (2.0 * math.pi * 3000.0) + 0.04 / OMEGA
    assert law.ahead_velocity == pytest.approx(lag, rel=1e-3)
    assert law.ahead_acceleration == pytest.approx(OMEGA**-2 + 0.5 * lag * lag, rel=1e-3)
    assert (law.low, law.high, law.gain) == (-2.0, 12.0, 10.0)
    loop = measured(np.array(law.loop_thresholds), np.array(law.loop_weights), 140.0)
    assert loop == pytest.approx((120e-6, 0.13 * 120e-6), rel=1e-4)
    assert DEFAULT.motion.velocity == pytest.approx(0.25 * 0.1 / 1.5e-6 * 120e-6 / 140.0, rel=1e-3)
    ramp = DEFAULT.motion.velocity / DEFAULT.motion.acceleration
    assert ramp == pytest.approx(6.0 * 2.0 * math.pi / OMEGA, rel=1e-3)
    rise = DEFAULT.motion.acceleration / DEFAULT.motion.jerk
    assert rise == pytest.approx(2.0 * 2.0 * math.pi / OMEGA, rel=1e-3)
    assert DEFAULT.arrival.tolerance == pytest.approx(10e-9)
    assert (DEFAULT.guard.effort, DEFAULT.guard.push) == (12.0, 12.0)
    assert DEFAULT.guard.error == pytest.approx(10e-6)
    assert (DEFAULT.guard.low, DEFAULT.guard.high) == pytest.approx((-5e-6, 105e-6))
    assert DEFAULT.timing.steps == 4
    heavier = DEFAULT.with_("guide.load", "120 g")
    assert heavier.controller.integral < 0.6 * law.integral
    assert heavier.controller.notch.frequency == pytest.approx(
        piezo_sheets.omega(heavier) / (2.0 * math.pi), rel=1e-3
    )


def test_nothing_that_no_sheet_prints_is_known():
    """Whatever is hidden, all that the controller and its guard have stays as it is."""
    other = DEFAULT.with_(
        {
            "hidden.stronger": 1.3, "hidden.detuned": 0.8, "hidden.damping": 0.3,
            "hidden.spread": 0.3, "hidden.widening": "0 s", "creep.share": 0.05,
            "warming.change": "9 K",
        }
    )  # fmt: skip
    for name in ("timing", "travel", "motion", "arrival", "controller", "guard"):
        assert getattr(other, name) == getattr(DEFAULT, name)


def test_moves_arrive_within_10_nm_and_the_printed_loop_halves_the_error():
    _, found = run(DEFAULT, 50.0, 90.0, 20.0, 0.0)
    for m in found:
        assert m.arrived_s is not None and m.arrived_s < m.profile_s + 0.12
        assert abs(m.rest_error) < 10e-6 and abs(m.true_error) < 10e-6
    line = {
        "controller.loop_thresholds": ["0 V", "10 V"],
        "controller.loop_weights": ["0.857143 um/V", "0 um/V"],
    }
    _, straight = run(DEFAULT.with_(line), 50.0, 90.0, 20.0, 0.0)
    rms = [math.sqrt(sum(m.rms_error**2 for m in way)) for way in (found, straight)]
    assert rms[0] < 0.75 * rms[1]


@pytest.mark.parametrize(
    "changes",
    [
        {"hidden.detuned": 0.9},
        {"hidden.detuned": 1.1},
        {"hidden.stronger": 1.2},
        {"hidden.damping": 0.01},
        {"warming.change": "5 K", "warming.time": "2 s"},
    ],
)
def test_a_stage_that_is_off_its_sheet_arrives_too(changes):
    recording, found = run(DEFAULT.with_(changes), 60.0, 10.0, hold=0.3)
    assert all(m.arrived_s is not None for m in found)
    late = recording["t"] > recording["t"][-1] - 0.05
    assert np.max(np.abs(recording["true_position"][late] - 0.01)) < 20e-6


@pytest.mark.slow
def test_an_identified_loop_is_nearer_than_the_printed_one():
    """The person's way: drive it, fit the loop to readings, write it into the settings."""
    corners = [0.0, 110.0, -15.0, 110.0, 20.0, 90.0, 0.0]
    volts = np.concatenate(
        [np.linspace(a, b, int(abs(b - a) / 0.04) + 1)[1:] for a, b in pairwise(corners)]
    )
    drive = stage.drive(KIND, KIND.prepare(DEFAULT), volts / 10.0, Bounds(-1.0, 1.0, 1.0), 1e-4)
    assert drive.ended == ""
    loop = fit(volts, drive.position, 16)
    assert loop.held_rms < 0.003 * np.ptp(drive.position)
    known = {
        "controller.loop_thresholds": [f"{r:.9g} V" for r in loop.operator.thresholds],
        "controller.loop_weights": [f"{1e6 * w:.9g} um/V" for w in loop.operator.weights],
    }
    # Slowly, so that the rate does not widen the loop.
    slow = {"motion.velocity": "0.5 mm/s", "controller.integral": "1 1/s"}
    errors = []
    for changes in ({}, known):
        recording, _ = run(DEFAULT.with_({**slow, **changes}), 60.0, 30.0, 80.0, hold=0.0)
        errors.append(float(np.std(recording["target"] - recording["position"])))
    assert errors[1] < 0.2 * errors[0]


def test_interpreted_and_compiled_give_the_same_bits_and_so_does_a_rig():
    plan = planning.plan(programme(0.4, hold=0.001), DEFAULT)
    stages, bench = composite.stages(PIEZO), composite.bench(PIEZO, DEFAULT)
    loops = performing.loops(PIEZO, DEFAULT, plan)
    noise = np.random.default_rng(1).standard_normal((150, KIND.noises))
    blocks = []
    for run in (period.period(stages), compiled(period.period(stages))):
        block = np.zeros((len(period.columns(stages)), len(noise)))
        begin = period.beginning(stages, bench, loops)
        run(bench, loops, begin, (noise,), block, DEFAULT.timing.period)
        blocks.append(block)
    assert np.allclose(*blocks, rtol=1e-12, atol=1e-18)
    own = runs.record(PIEZO, DEFAULT, plan).recording
    on = runs.record(PIEZO, DEFAULT, plan, on=Twin(KIND, DEFAULT)).recording
    for name in ("position", "effort", "correction"):
        assert np.allclose(own[name], on[name], rtol=1e-9, atol=1e-12), name


def test_all_settings_are_read_back_bit_for_bit(tmp_path):
    tree = DEFAULT.with_({"guide.load": "0.0334 kg", "encoder.noise": "0.7 nm"})
    path = tmp_path / "m.toml"
    path.write_text(machine.as_toml(PIEZO, tree), encoding="utf-8")
    assert machine.load(path)[1] == tree
    assert all(e.par.source for e in entries(tree))


def test_a_profile_of_15_periods_is_followed_by_its_polynomials(tmp_path):
    machine, programme = tmp_path / "piezo.toml", tmp_path / "p.toml"
    machine.write_text('machine = "piezo"\n')
    programme.write_text(
        '[[profiles]]\nto = "10 um"\nvelocity = "1 m/s"\nacceleration = "100 m/s^2"\n'
        'jerk = "9.4815e4 m/s^3"\nhold = "10 ms"\n'
    )
    run = macromicro.run(machine, programme)
    truth = s_curve(10e-6, 1.0, 100.0, 9.4815e4)
    assert truth.duration == pytest.approx(1.5e-3, rel=1e-3)
    exact = truth.at(run["t"])
    assert 1e-3 * run["target"] == pytest.approx(exact.position, abs=1e-18)
    assert 1e-3 * run["target_speed"] == pytest.approx(exact.velocity, abs=1e-14)
    assert run["target_acceleration"] == pytest.approx(exact.acceleration, abs=1e-10)
    assert np.ptp(run["target_acceleration"]) > 60.0 and run.attributes["finished"] == 1
