"""Files of an identified drive: a machine, settings of the bench, or plain values."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from macromicro.errors import InputError
from macromicro.identify.kinds import model_file
from macromicro.identify.kinds.drive_words import METHODS, told
from macromicro.identify.runs import Run
from macromicro.place import PLACES, Place

if TYPE_CHECKING:
    from macromicro.identify.axis_fit import DriveFit

ABOUT = LIMITS, ASSUMED = "limits of the machine", "assumed"
_FINEST = 1e-9  # of the travel; smaller steps are rounding, not counts


def settings(
    fit: DriveFit,
    records: list[Run],
    force: str,
    x: str,
    units: dict[str, str],
    endless: bool = False,
) -> str:
    errors = dict(zip(fit.surest.names, fit.surest.std, strict=True))
    if (force, x) == ("V", "counts"):
        return bench(fit, errors)
    for place in PLACES:
        if force in ("V", place.named("N")) and x == place.base:
            return machine(fit, records, units, errors, place, endless)
    head = "A motor-driven axis: parameters for other programs.\n"
    head += "Not for `macromicro run --config`: the bench is another axis."
    values = {
        n: (value, ", ".join(filter(None, (units[n], about(error)))))
        for n, (value, error, _) in told(fit.surest).items()
    }
    return model_file.plain(head, {"axis": values})


def about(error: float, unit: str = "") -> str:
    return "" if math.isnan(error) else f"+- {error:.2g} {unit}".rstrip()


def machine(
    fit: DriveFit,
    records: list[Run],
    units: dict[str, str],
    errors: dict[str, float],
    place: Place,
    endless: bool = False,
) -> str:
    """The machine `axis` (m) or `rotary` (rad) of a drive, its limits from the records."""
    from macromicro.identify import axis_settings, eccentric
    from macromicro.identify.axis_settings import Around

    first = min(float(r.x.min()) for r in records)
    travel = max(float(r.x.max()) for r in records) - first
    dt, least, most = records[0].dt, np.inf, 0.0
    for r in records:
        steps = np.diff(r.x)
        np.abs(steps, out=steps)
        most = max(most, float(steps.max()))
        least = min(least, float(steps.min(where=steps > _FINEST * travel, initial=np.inf)))
    around = Around(
        gain=fit.gain,
        effort=min(max(float(np.abs(r.u).max()) for r in records), fit.limit or np.inf),
        pitch=float(f"{least:.4g}"),
        period=float(f"{dt:.6g}"),
        travel=travel,
        speed=most / dt,
    )
    axis = fit.axis._replace(lag=fit.delay * dt + fit.axis.lag)
    head = [
        "A motor-driven axis as a machine: macromicro run --config model.toml",
        (
            f"Its 0 {place.unit} is the lowest position in the records, its effort limit "
            + ("--limit." if fit.limit else "the largest effort there.")
        ),
    ]
    if fit.gain == 1.0:
        head.append(
            f"No gain was known: 1 {place.named('N')} below stands for one unit of the effort."
        )
    by = METHODS[fit.surest is not fit.inverse]
    head += ["", f"Identified by {by}, with standard errors:"]
    for name, (value, error, _) in told(fit.surest).items():
        head.append(" ".join(filter(None, (f"  {name} = {value:.5g}", about(error), units[name]))))
    values, name = axis_settings.values(axis, around), "axis"
    if place.turns:
        load = eccentric.of(axis)
        load = load._replace(hangs=load.hangs - first)
        values, name = axis_settings.turned(values, load), "rotary"
        values = axis_settings.endless(values) if endless else values
        if "offset" in errors:
            head.append("This machine has no constant torque: it is left out.")
    return axis_settings.as_toml(values, "\n".join(head), name, axis_settings.SOURCES)


def limits(toml: str, records: list[Run], units: tuple[str, str]) -> list[tuple[str, str]]:
    """Warnings of a machine's limits, which no record shows."""
    if "\nmachine = " not in toml:
        return []
    effort = max(float(np.abs(r.u).max()) for r in records)
    low, high = (f(float(f(r.x)) for r in records) for f in (min, max))
    said = f"travel {high - low:.4g} {units[1]}, effort {effort:.4g} {units[0]}"
    return [
        (LIMITS, f"the records' range, {said}; --machine FILE: a sheet's"),
        (ASSUMED, "motor force, resistance, inductance and current: only their effect shows"),
    ]


def bench(fit: DriveFit, errors: dict[str, float]) -> str:
    """The bench's carriage and friction from a drive, with the motor's known values.

    One volt at the D/A board gives g = K duty supply / (full scale r R) newtons at the belt; the
    back-EMF K^2 / (r^2 R) is part of the measured viscous friction.
    """
    from macromicro.settings import Settings

    nominal = Settings()
    motor, amplifier = nominal.bench.motor, nominal.bench.amplifier
    pull = motor.constant / motor.pulley
    volts = amplifier.supply * amplifier.motor_duty / amplifier.full_scale
    g = pull * volts / motor.resistance
    per_count = g / nominal.sensors.encoder.pitch
    axis = fit.axis
    viscous = axis.viscous * per_count - pull**2 / motor.resistance
    head = (
        "Settings of the virtual bench that follow from a drive in counts and volts, with its\n"
        f"motor and amplifier as they are ({g:.4g} N at the belt for a volt at the D/A board).\n"
        "Use: macromicro run --config model.toml"
    )
    values = {
        "bench.carriage.mass": (
            axis.mass * per_count,
            about(errors["mass"] * per_count * 1e3, "g"),
        ),
    }
    if axis.coulomb > 0.0:
        values["bench.friction.coulomb"] = (axis.coulomb * g, about(errors["coulomb"] * g, "N"))
    if viscous > 0.0:
        spread = about(errors["viscous"] * per_count, "N*s/m")
        note = ", ".join(filter(None, (spread, "back-EMF taken off")))
        values["bench.friction.viscous"] = (viscous, note)
    else:
        head += f"\nViscous friction would be {viscous:.3g} N*s/m without back-EMF: left out."
    if "stribeck" in errors and axis.stribeck > 2.0 * errors["stribeck"]:
        pitch = nominal.sensors.encoder.pitch
        values["bench.friction.stribeck"] = (
            axis.stribeck * g,
            about(errors["stribeck"] * g, "N"),
        )
        values["bench.friction.stribeck_speed"] = (axis.stribeck_speed * pitch, "with it")
    try:
        return model_file.settings(head, values)
    except InputError as error:
        return model_file.plain(
            f"The bench refuses these: {error}",
            {
                "axis": {
                    n: (float(v), "counts and volts")
                    for n, v in zip(fit.surest.names, fit.surest.values, strict=True)
                }
            },
        )
