"""Rules between settings: (wrong?, path, value, accepted), with other paths in braces."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from statistics import NormalDist
from typing import Any

from macromicro.nominal import PERIOD
from macromicro.plant import hall
from macromicro.units import shown

Problem = tuple[str, Any, str]
Rule = tuple[bool, str, Any, str]

FALSE_ALARM = 1e-6  # chance that a sound sensor repeats one code for the whole of guard.frozen
REACH = 2.0  # a tolerance beyond this many strokes of the micro-stage leaves it nothing to mend
LEANS = 0.9  # of guard.leant that homing and jogs may use up: periods may be late
CALIBRATED = 3.0  # standard errors by which the live machine's pitch may be another


def machine(tree: Any) -> list[Problem]:
    every = (*_drive(tree), *_ways(tree), *_actuator(tree), *_hall(tree), *_watch(tree))
    return [(path, value, words) for wrong, path, value, words in every if wrong]


def live(tree: Any) -> list[Problem]:
    """Conflicts of the live machine's settings, beside those of `machine`."""
    every = (*_leaning(tree), *_live(tree))
    return [(path, value, words) for wrong, path, value, words in every if wrong]


def _leaning(tree: Any) -> Iterator[Rule]:
    """Homing and jogs give up before the guard takes the carriage for stuck."""
    homing, jogging, guard = tree.live.homing, tree.live.jogging, tree.guard
    most = LEANS * guard.leant
    limit = "{guard.leant} is the guard's limit, of which 90 % may be used"
    yield (
        homing.leans > most,
        "live.homing.stand",
        homing.stand,
        f"at most {0.5 * most:.4g} s, for homing leans on the stop twice as long, and {limit}",
    )
    yield (
        jogging.patience > most,
        "live.jogging.patience",
        jogging.patience,
        f"at most {most:.4g} s, for {limit}",
    )
    yield jogging.lean > guard.lean, "live.jogging.lean", jogging.lean, "at most {guard.lean}"


def breakaway(tree: Any) -> float:
    """Greatest effort that the carriage needs to start."""
    motor, amplifier, friction = tree.bench.motor, tree.bench.amplifier, tree.bench.friction
    pull = motor.constant / (motor.resistance * motor.pulley)  # N per V at the motor
    pull *= amplifier.supply * amplifier.motor_duty / amplifier.full_scale
    return float((friction.coulomb + friction.stribeck + friction.ripple) / pull)


def _drive(tree: Any) -> Iterator[Rule]:
    """Efforts of laws and guard against drive and friction."""
    control, guard, needed = tree.controller, tree.guard, breakaway(tree)
    range_ = "at most {bench.amplifier.full_scale}, all that the D/A gives"
    full = tree.bench.amplifier.full_scale
    yield guard.motor > full, "guard.motor", guard.motor, range_
    yield guard.ctrl > full, "guard.ctrl", guard.ctrl, range_
    for limit, bound in (("motor", "motor"), ("ctrl", "ctrl")):
        value = getattr(control, f"{limit}_limit")
        yield (
            value > getattr(guard, bound),
            f"controller.{limit}_limit",
            value,
            f"at most {{guard.{bound}}}, or the guard stops the first effort beyond it",
        )
    yield (
        needed >= control.motor_limit,
        "bench.friction.coulomb",
        tree.bench.friction.coulomb,
        f"friction that the motor can break at {{controller.motor_limit}}: this carriage needs "
        f"{needed:.3g} V; less friction, or a higher {{bench.amplifier.supply}}",
    )
    yield guard.lean > guard.push, "guard.lean", guard.lean, "at most {guard.push}"


def _ways(tree: Any) -> Iterator[Rule]:
    """Travel of both stages."""
    encoder, travel, wire = tree.sensors.encoder, tree.travel, tree.bench.wire
    high, pitch = tree.bench.carriage.stop_high, encoder.pitch
    yield travel.macro > high, "travel.macro", travel.macro, "at most {bench.carriage.stop_high}"
    yield travel.micro > wire.stop, "travel.micro", travel.micro, "at most {bench.wire.stop}"
    longest = max(high, -tree.bench.carriage.stop_low)
    yield (
        longest / pitch >= 2.0 ** (encoder.bits - 1.0),
        "sensors.encoder.bits",
        encoder.bits,
        f"a counter that holds the {longest / pitch:.0f} counts to the end stop without wrapping",
    )
    tolerance = tree.controller.sequence.tolerance
    yield (
        tolerance * pitch > REACH * wire.stroke,
        "controller.sequence.tolerance",
        tolerance,
        f"at most {REACH * wire.stroke / pitch:.0f} counts, twice {{bench.wire.stroke}}",
    )
    yield (
        tolerance > tree.guard.macro_tolerance,
        "controller.sequence.tolerance",
        tolerance,
        "at most {guard.macro_tolerance}",
    )
    steady = 1.0 / (tree.bench.motor.constant / tree.bench.motor.pulley)
    amplifier = tree.bench.amplifier
    fastest = amplifier.supply * amplifier.motor_duty * steady / pitch
    yield (
        tree.guard.fastest <= fastest,
        "guard.fastest",
        tree.guard.fastest,
        f"above {fastest:.0f} counts/s, which the motor reaches without load",
    )


def _actuator(tree: Any) -> Iterator[Rule]:
    """Wires that contract when heated, and extend again in this room."""
    phase, wire, thermal = tree.bench.phase, tree.bench.wire, tree.bench.thermal
    shift = wire.shift * (tree.bench.bias.preload - wire.reference_load)
    cold = phase.cool_offset + phase.cool_slope * phase.heat_start - phase.cool_spread + shift
    hot = phase.heat_end + shift
    yield (
        thermal.ambient >= cold,
        "bench.thermal.ambient",
        thermal.ambient,
        f"below {cold:.3g} degC, at which even the wires' first parts do not extend again "
        "(bench.phase.cool_offset, cool_slope and cool_spread, under the bias spring's load): a "
        "cooler room, or wires that transform at higher temperatures",
    )
    driver = tree.bench.driver
    heat = driver.map_heat[-1] * (driver.supply / 4.0) ** 2
    path = thermal.wire_resistance + thermal.plate_resistance + thermal.body_resistance
    yield (
        thermal.ambient + heat * path <= hot,
        "bench.driver.supply",
        driver.supply,
        f"enough to heat the wires to {hot:.3g} degC, where they have contracted: a higher supply, "
        "a warmer room, or wires that transform at lower temperatures",
    )
    least = max(tree.guard.ambient, phase.heat_start + shift)
    yield (
        tree.guard.hottest <= least,
        "guard.hottest",
        tree.guard.hottest,
        f"above {least:.3g} degC, or the guard stops every contraction (bench.phase.heat_start)",
    )


def _hall(tree: Any) -> Iterator[Rule]:
    """A Hall sensor with sufficient resolution, and noise that the guard expects."""
    sensor, converter, guard = tree.sensors.hall, tree.sensors.converter, tree.guard
    ways = [hall.volts(sensor, tree.bench.wire.stop * k / 50.0, 0.0) for k in range(51)]
    rising = all(b > a for a, b in pairwise(ways))
    falling = all(b < a for a, b in pairwise(ways))
    yield (
        not (rising or falling),
        "sensors.hall.spacing",
        sensor.spacing,
        "magnets and gain with which the output changes all the way to {bench.wire.stop}, without "
        "turning or meeting 0 or {sensors.hall.supply}",
    )
    ends = (max(min(ways), 0.0), max(ways))
    yield (
        ends[0] < guard.rail or ends[1] > guard.hall_supply - guard.rail,
        "sensors.hall.gain",
        sensor.gain,
        f"an output within {{guard.rail}} of neither 0 nor {{guard.hall_supply}}; over the stroke "
        f"it goes from {ends[0]:.3g} to {ends[1]:.3g} V",
    )
    yield (
        ends[1] >= converter.full_scale,
        "sensors.converter.full_scale",
        converter.full_scale,
        f"above {ends[1]:.3g} V, the Hall sensor's greatest output over the stroke",
    )
    code = converter.full_scale / 2.0**converter.bits
    samples = max(round(guard.frozen / PERIOD), 1)
    same = FALSE_ALARM ** (1.0 / samples)  # of one sample, for the whole time to be so
    least = 0.5 * code / NormalDist().inv_cdf(0.5 * (1.0 + same))
    yield (
        sensor.noise < least,
        "sensors.hall.noise",
        sensor.noise,
        f"at least {_volts(least)}: with less noise a healthy sensor shows one code for "
        "{guard.frozen}, and the guard takes it for frozen; more {sensors.converter.bits} or a "
        "longer guard.frozen allow less noise",
    )
    yield (
        sensor.noise >= guard.noise,
        "sensors.hall.noise",
        sensor.noise,
        "below {guard.noise}, at which the guard declares the sensor faulty",
    )


def _watch(tree: Any) -> Iterator[Rule]:
    """Times of the guard, which works once a control period."""
    guard = tree.guard
    for name in ("silent", "frozen", "rail_time", "stuck", "noise_time", "clock"):
        value = getattr(guard, name)
        yield (
            value < PERIOD,
            f"guard.{name}",
            value,
            f"at least {PERIOD * 1e3:g} ms, one control period",
        )


def _live(tree: Any) -> Iterator[Rule]:
    mine, guard, pitch = tree.live, tree.guard, tree.sensors.encoder.pitch
    off = abs(mine.pitch / pitch - 1.0)
    yield (
        off > CALIBRATED * mine.edges.scale,
        "live.pitch",
        mine.pitch,
        "{sensors.encoder.pitch}, to within three times {live.edges.scale}; set that alone",
    )
    homing, needed = mine.homing, breakaway(tree)
    yield homing.volts >= guard.push, "live.homing.volts", homing.volts, "below {guard.push}"
    yield (
        homing.volts <= needed,
        "live.homing.volts",
        homing.volts,
        f"above {needed:.3g} V, which the carriage needs to start, and below {{guard.push}}; "
        "without a value it is 0.2 V below that",
    )
    yield (
        mine.limits.micro_high > tree.travel.micro,
        "live.limits.micro_high",
        mine.limits.micro_high,
        "at most {travel.micro}",
    )
    stops, q = tree.bench.carriage, mine.limits
    yield (
        q.macro_high * pitch > stops.stop_high,
        "live.limits.macro_high",
        q.macro_high,
        f"at most {stops.stop_high / pitch:.0f} counts, {{bench.carriage.stop_high}}",
    )
    yield (
        q.macro_low * pitch < stops.stop_low,
        "live.limits.macro_low",
        q.macro_low,
        f"at least {stops.stop_low / pitch:.0f} counts, {{bench.carriage.stop_low}}",
    )
    for name in ("macro", "slow"):
        speed = getattr(mine.jogging, name)
        yield (
            speed / pitch >= min(guard.fastest, mine.brake.fastest),
            f"live.jogging.{name}",
            speed,
            "below {live.brake.fastest} and {guard.fastest}",
        )


def _volts(value: float) -> str:
    return shown(value, "V", "mV", 3)
