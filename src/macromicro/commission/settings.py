"""The machine that a commissioning found, as settings of the machine `axis`.

The model is in volts and metres. As settings, one newton stands for one volt at the D/A: a linear
motor with a force constant of k N/A on a resistance of k ohm gives 1 N per volt, and its back-EMF
is a viscous friction of k N s/m. With k the fitted viscous slope, effort and motion are those of
the model, whatever part of the slope is back-EMF in truth.
"""

from __future__ import annotations

import math

from macromicro.commission.friction import FrictionMap
from macromicro.commission.model import UNITS, Model
from macromicro.commission.probing import Ends

GRAVITY = 9.80665  # m/s^2
_LEAST = 1e-3  # N/A, where no viscous slope was found
_QUICK = 1e-5  # s, least rise of the current


def settings(
    model: Model,
    ends: Ends,
    friction: FrictionMap,
    *,
    effort: float,
    pitch: float,
    dt: float,
) -> dict[str, str]:
    """Settings by their paths, as text with units; 0 mm is the low end of the travel.

    Parameters
    ----------
    model : Model
        Of the strokes.
    ends : Ends
        Travel.
    friction : FrictionMap
        Breakaway along it.
    effort : float
        Largest effort, V.
    pitch : float
        Travel per count, m.
    dt : float
        Control period, s.

    Returns
    -------
    dict[str, str]
        Path to a TOML value.
    """
    axis = model.axis
    k = max(axis.viscous, _LEAST)
    spare = max(0.02 * ends.travel, 10.0 * pitch)
    # An effort acts within its period; what the lag is longer, the current's rise takes.
    delay = min(max(axis.lag, 0.0), dt)
    rise = max(axis.lag - delay, _QUICK)
    level = axis.coulomb + axis.stribeck
    ripple = max(friction.largest - friction.mean, 0.0)
    values = {
        "amplifier.mode": '"voltage"',
        "amplifier.full_scale": f'"{effort!r} V"',
        "amplifier.supply": f'"{effort!r} V"',
        "amplifier.gain": "1.0",
        "amplifier.current": f'"{min(effort, axis.limit) / k!r} A"',
        "motor.force": f'"{k!r} N/A"',
        "motor.resistance": f'"{k!r} ohm"',
        "motor.inductance": f'"{k * rise!r} H"',
        "drive.kind": '"linear"',
        "load.mass": f'"{axis.mass!r} kg"',
        "load.incline": f'"{_incline(axis.offset, axis.mass)!r} rad"',
        "load.stop_low": f'"{-spare!r} m"',
        "load.stop_high": f'"{ends.travel + spare!r} m"',
        "friction.coulomb": f'"{axis.coulomb!r} N"',
        "friction.stribeck": f'"{max(friction.mean - axis.coulomb, 0.0)!r} N"',
        "friction.stribeck_speed": f'"{max(axis.stribeck_speed, 1e-4)!r} m/s"',
        "friction.viscous": '"0.0 N*s/m"',
        "friction.ripple": f'"{min(ripple, 0.5 * level)!r} N"',
        "encoder.at": '"load"',
        "encoder.pitch": f'"{pitch!r} m"',
        "timing.period": f'"{dt!r} s"',
        "timing.delay": f'"{delay!r} s"',
        "travel.low": '"0.0 m"',
        "travel.high": f'"{ends.travel!r} m"',
    }
    return values


def _incline(offset: float, mass: float) -> float:
    """The incline whose weight along the way is a constant force, as far as the mass has it."""
    return math.asin(min(max(offset / (mass * GRAVITY), -0.99), 0.99))


def as_toml(values: dict[str, str], model: Model, head: str) -> str:
    """A machine's file.

    Parameters
    ----------
    values : dict[str, str]
        From `settings`.
    model : Model
        For the intervals in the comments.
    head : str
        First lines, as a comment.

    Returns
    -------
    str
        TOML.
    """
    lines = [*(f"# {line}" for line in head.splitlines()), "#"]
    lines.append("# As found, in volts and metres, with 95 % intervals:")
    for name in model.names:
        value, half = getattr(model.axis, name), model.half_width(name)
        lines.append(f"#   {name} = {value:.4g} +- {half:.2g} {UNITS[name]}")
    lines += ["# One newton below stands for one volt at the D/A.", "", 'machine = "axis"']
    table = ""
    for path, value in values.items():
        section, _, key = path.rpartition(".")
        if section != table:
            lines += ["", f"[{section}]"]
            table = section
        lines.append(f"{key} = {value}")
    return "\n".join(lines) + "\n"
