"""An identified axis as settings of the machine `axis`, which `run`, `tune` and `robust` take.

What was identified is a force per volt, a mass, frictions and a lag; motor and amplifier are not
known one by one. A linear motor with a force constant of k N/A on a resistance of k / g ohm gives g
newtons per volt, and its back-EMF is a viscous friction of k g N s/m. With k g the identified
viscous slope, effort and motion are those of the model, whatever part of it is back-EMF in truth;
where a limited force has shown that part, the rest is friction.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.identify.axis import Axis
from macromicro.identify.eccentric import Eccentric
from macromicro.place import ANGLE

GRAVITY = 9.80665  # m/s^2
BALANCED = Eccentric(0.0, 0.0)
_LEAST = 1e-3  # N/A, where no viscous slope was found
_QUICK = 1e-5  # s, least rise of the current
_SPARE = 0.02  # of the travel, between its ends and the stops
_NEAR = 1e-5  # of the travel: what counts as arrived, where counts are finer
_COUNTED = 10.0  # the counter is so many times faster than the fastest that was seen


class Around(NamedTuple):
    """What is known of an axis beside its model.

    Attributes
    ----------
    gain : float
        Force per effort, N/V; 1 where one newton stands for one volt.
    effort : float
        Largest effort, V.
    pitch : float
        Way per count, m.
    period : float
        Control period, s.
    travel : float
        From its low end, which becomes 0, to its high end, m.
    speed : float
        Greatest speed that was seen, m/s.
    ripple : float
        Greatest change of the friction along the travel, N.
    """

    gain: float
    effort: float
    pitch: float
    period: float
    travel: float
    speed: float
    ripple: float = 0.0


class Drive(NamedTuple):
    """What is known of a drive that gives.

    Attributes
    ----------
    rotor : float
        The motor's part of all that moves.
    frequency : float
        Of the load on it, the motor held, Hz.
    damping : float
        Ratio, of that.
    at : str
        Where the encoder is: "motor" or "load".
    notch : float
        Middle of the effort's notch, Hz; 0: none.
    """

    rotor: float
    frequency: float
    damping: float
    at: str
    notch: float = 0.0


def values(axis: Axis, around: Around) -> dict[str, str]:
    """Settings of the machine by their paths.

    Parameters
    ----------
    axis : Axis
        Parameters in N, m and s; its lag is all by which efforts act late.
    around : Around
        What is known beside.

    Returns
    -------
    dict[str, str]
        Path to a TOML value with its unit.
    """
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
        "load.incline": (_incline(axis.offset, axis.mass), "rad"),
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
    """The same with a drive between motor and load: a belt on a pulley of 1 m, whose turn is the
    way.

    What arrives within the drive's vibration follows from its rule, so no tolerance is named.

    Parameters
    ----------
    settings : dict[str, str]
        From `values`.
    drive : Drive
        What was found of it.

    Returns
    -------
    dict[str, str]
        Path to a TOML value.
    """

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


def turned(settings: dict[str, str], load: Eccentric = BALANCED) -> dict[str, str]:
    """The same of the machine `rotary`: a motor of constant k N m/A without a gear, whose inertia
    is part of the load's.

    Parameters
    ----------
    settings : dict[str, str]
        From `values`, in which 1 m stands for 1 rad.
    load : Eccentric, optional
        What gravity pulls at; its angle from the machine's 0.

    Returns
    -------
    dict[str, str]
        Path to a TOML value with its unit.
    """
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
    """The same of one that turns on: no stop ends its way.

    Parameters
    ----------
    settings : dict[str, str]
        From `turned`.

    Returns
    -------
    dict[str, str]
        Path to a TOML value; its targets stay where they were.
    """
    made = {path: value for path, value in settings.items() if not path.startswith("load.stop_")}
    return {**made, "load.ends": '"none"'}


def _incline(offset: float, mass: float) -> float:
    """The incline whose weight along the way is a constant force, as far as the mass has it."""
    return math.asin(min(max(offset / (mass * GRAVITY), -0.99), 0.99))


def as_toml(settings: dict[str, str], head: str, machine: str = "axis") -> str:
    """A machine's file.

    Parameters
    ----------
    settings : dict[str, str]
        From `values`.
    head : str
        First lines, as a comment.
    machine : str, optional
        Its kind.

    Returns
    -------
    str
        TOML.
    """
    tables: dict[str, list[str]] = {}
    for path, value in settings.items():
        table, _, name = path.rpartition(".")
        tables.setdefault(table, []).append(f"{name} = {value}")
    lines = [*(f"# {line}".rstrip() for line in head.splitlines()), "", f'machine = "{machine}"']
    for table, own in tables.items():
        lines += ["", f"[{table}]", *own]
    return "\n".join(lines) + "\n"
