"""An identified axis as settings of the machine `axis`, for `run`, `tune` and `robust`."""

# Motor and amplifier are not identified one by one. A linear motor of k N/A on k / g ohm gives g
# N/V with a back-EMF friction of k g N s/m. With k g the identified viscous slope, effort and
# motion equal the model's for any share of back-EMF; if a force limit shows that share, the rest is
# friction.

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from macromicro.identify import model_file
from macromicro.identify.eccentric import Eccentric
from macromicro.models.mass import Axis
from macromicro.place import ANGLE

GRAVITY = 9.80665  # m/s^2
BALANCED = Eccentric(0.0, 0.0)
_LEAST = 1e-3  # N/A, where no viscous slope was found
_QUICK = 1e-5  # s, least rise of the current
_SPARE = 0.02  # of the travel, between its ends and the stops
_NEAR = 1e-5  # of the travel: what counts as arrived, where counts are finer
_RANGE, _TAKEN = "range of the records, not the machine's limit", "assumed, not identified"
SOURCES = {
    **dict.fromkeys(
        ("amplifier.full_scale", "amplifier.supply", "load.stop_low", "load.stop_high",
         "travel.low", "travel.high"),
        _RANGE,
    ),
    **dict.fromkeys(
        ("amplifier.mode", "amplifier.gain", "amplifier.current", "drive.kind", "drive.ratio",
         "drive.inertia", "encoder.at", "encoder.rate", "motor.force", "motor.constant",
         "motor.resistance", "motor.inductance", "motor.inertia", "friction.ripple",
         "arrival.tolerance"),
        _TAKEN,
    ),
    **dict.fromkeys(
        ("load.mass", "load.inertia", "load.incline", "load.unbalance", "load.hangs",
         "friction.coulomb", "friction.viscous"),
        "identified",
    ),
    "friction.stribeck": "identified, or 0 where the structure has none",
    "friction.stribeck_speed": "identified with it",
    "encoder.pitch": "smallest step in the records",
    "timing.period": "of the records",
    "timing.delay": "identified with --delay fit, else as given",
}  # fmt: skip
_COUNTED = 10.0  # the counter is so many times faster than the fastest that was seen


class Around(NamedTuple):
    gain: float  # force per effort, N/V; 1 where one newton stands for one volt
    effort: float  # largest effort, V
    pitch: float  # way per count, m
    period: float  # control period, s
    travel: float  # from its low end, which becomes 0, to its high end, m
    speed: float  # greatest speed that was seen, m/s
    ripple: float = 0.0  # greatest change of the friction along the travel, N


class Drive(NamedTuple):
    """What is known of a compliant drive train."""

    rotor: float  # the motor's part of all that moves
    frequency: float  # of the load on it, the motor held, Hz
    damping: float  # ratio, of that
    at: str  # where the encoder is: "motor" or "load"
    notch: float = 0.0  # middle of the effort's notch, Hz; 0: none


def values(axis: Axis, around: Around) -> dict[str, str]:
    gain, effort = around.gain, around.effort
    k = max(axis.back * axis.viscous / gain, _LEAST)
    spare = max(_SPARE * around.travel, 10.0 * around.pitch)
    # An effort acts within its period; what the lag is longer, the current's rise takes.
    delay = min(max(axis.lag, 0.0), around.period)
    rise = max(axis.lag - delay, _QUICK)
    ripple = min(around.ripple, 0.5 * (axis.coulomb + axis.stribeck))
    figures = {
        "amplifier.full_scale": (effort, "V"),
        "amplifier.supply": (effort, "V"),
        "amplifier.current": (min(effort * gain, axis.limit) / k, "A"),
        "motor.force": (k, "N/A"),
        "motor.resistance": (k / gain, "ohm"),
        "motor.inductance": (k / gain * rise, "H"),
        "load.mass": (axis.mass, "kg"),
        "load.incline": (incline(axis.offset, axis.mass), "rad"),
        "load.stop_low": (-spare, "m"),
        "load.stop_high": (around.travel + spare, "m"),
        "friction.coulomb": (axis.coulomb, "N"),
        "friction.stribeck": (axis.stribeck, "N"),
        "friction.stribeck_speed": (max(axis.stribeck_speed, 1e-4), "m/s"),
        "friction.viscous": (max(axis.viscous - k * gain, 0.0), "N*s/m"),
        "friction.ripple": (ripple, "N"),
        "encoder.pitch": (around.pitch, "m"),
        "encoder.rate": (_COUNTED * around.speed / around.pitch, "counts/s"),
        "timing.period": (around.period, "s"),
        "timing.delay": (delay, "s"),
        "arrival.tolerance": (max(4.0 * around.pitch, _NEAR * around.travel), "m"),
        "travel.low": (0.0, "m"),
        "travel.high": (around.travel, "m"),
    }
    words = {
        "amplifier.mode": '"voltage"',
        "amplifier.gain": "1.0",
        "drive.kind": '"linear"',
        "encoder.at": '"load"',
    }
    return {**words, **{path: f'"{float(v)!r} {unit}"' for path, (v, unit) in figures.items()}}


def limber(settings: dict[str, str], drive: Drive) -> dict[str, str]:
    """Settings with a compliant drive train: a belt on a pulley of 1 m."""

    def number(path: str) -> float:
        return float(settings[path].strip('"').split()[0])

    mass, k = number("load.mass"), number("motor.force")
    load = mass * (1.0 - drive.rotor)
    pull = math.sin(number("load.incline")) * mass / load
    left = ("motor.force", "arrival.tolerance")
    found = {path: value for path, value in settings.items() if path not in left}
    found |= {
        "drive.kind": '"belt"',
        "drive.radius": '"1.0 m"',
        "drive.inertia": '"0.0 kg*m^2"',
        "drive.frequency": f'"{drive.frequency!r} Hz"',
        "drive.damping": repr(drive.damping),
        "motor.constant": f'"{k!r} N*m/A"',
        "motor.inertia": f'"{mass * drive.rotor!r} kg*m^2"',
        "load.mass": f'"{load!r} kg"',
        "load.incline": f'"{math.asin(min(max(pull, -0.99), 0.99))!r} rad"',
        "encoder.at": f'"{drive.at}"',
    }
    if drive.notch > 0.0:
        found["controller.notch.frequency"] = f'"{drive.notch!r} Hz"'
    return found


def as_rotary(settings: dict[str, str], load: Eccentric = BALANCED) -> dict[str, str]:
    """Settings of the machine `rotary`: a motor of k N m/A without gear or inertia."""
    named = {"motor.force": "motor.constant", "load.mass": "load.inertia"}
    found = {"motor.inertia": '"0 kg*m^2"', "drive.ratio": "1.0", "drive.inertia": '"0 kg*m^2"'}
    for path, value in settings.items():
        if path in ("drive.kind", "drive.radius", "load.incline"):
            continue
        if path in (*found, "motor.constant"):  # of the motor's turn, here as there
            found[path] = value
            continue
        number, _, unit = value.strip('"').partition(" ")
        same = not unit or value == number
        found[named.get(path, path)] = value if same else f'"{number} {ANGLE.named(unit)}"'
    if load.unbalance > 0.0:
        found["load.unbalance"] = f'"{load.unbalance!r} N*m"'
        found["load.hangs"] = f'"{math.remainder(load.hangs, 2.0 * math.pi)!r} rad"'
    return found


def endless(settings: dict[str, str]) -> dict[str, str]:
    made = {path: value for path, value in settings.items() if not path.startswith("load.stop_")}
    return {**made, "load.ends": '"none"'}


def incline(offset: float, mass: float) -> float:
    """Report the incline at which the weight explains a constant force."""
    return math.asin(min(max(offset / (mass * GRAVITY), -0.99), 0.99))


def as_toml(
    settings: dict[str, str],
    head: str,
    machine: str = "axis",
    notes: Mapping[str, str] = MappingProxyType({}),
) -> str:
    tables: dict[str, list[str]] = {}
    for path, value in settings.items():
        table, _, name = path.rpartition(".")
        tables.setdefault(table, []).append(model_file.line(name, value, notes.get(path, "")))
    first = "\n".join([f'machine = "{machine}"', *tables.pop("", []), ""])
    return model_file.as_toml(head, first, tables)
