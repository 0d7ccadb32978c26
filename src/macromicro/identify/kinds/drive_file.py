"""The files of a drive that was identified: a machine, settings of the bench, or plain values."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from macromicro.errors import InputError
from macromicro.identify.kinds import model_file
from macromicro.identify.kinds.drive_words import told
from macromicro.identify.runs import Run
from macromicro.place import PLACES, Place

if TYPE_CHECKING:
    from macromicro.identify.axis_fit import DriveFit

_FINEST = 1e-9  # of the travel; smaller steps are rounding, not counts


def settings(
    fit: DriveFit,
    records: list[Run],
    force: str,
    x: str,
    units: dict[str, str],
    endless: bool = False,
) -> str:
    """Settings of the bench for an axis in counts and volts, of the machine `axis` for one in
    metres and `rotary` for one in radians, else the parameters as they are.

    Parameters
    ----------
    fit : DriveFit
        What was found.
    records : list[Run]
        In what.
    force : str
        Unit of the force.
    x : str
        Unit of the position.
    units : dict[str, str]
        By name of the parameter.
    endless : bool, optional
        Whether it turns on, without end stops.

    Returns
    -------
    str
        TOML.
    """
    errors = dict(zip(fit.refined.names, fit.refined.std, strict=True))
    if (force, x) == ("V", "counts"):
        return bench(fit, errors)
    for place in PLACES:
        if force in ("V", place.named("N")) and x == place.base:
            return machine(fit, records, units, errors, place, endless)
    head = "A motor-driven axis: parameters by output error, for other programs.\n"
    head += "Not for `macromicro run --config`: the bench is another axis."
    values = {
        n: (float(v), ", ".join(filter(None, (units[n], about(errors[n])))))
        for n, v in zip(fit.refined.names, fit.refined.values, strict=True)
    }
    return model_file.plain(head, {"axis": values})


def about(error: float, unit: str = "") -> str:
    """A standard error in words.

    Parameters
    ----------
    error : float
        NaN where none is known.
    unit : str, optional
        Its unit.

    Returns
    -------
    str
        "" where none is known.
    """
    return "" if math.isnan(error) else f"+- {error:.2g} {unit}".rstrip()


def machine(
    fit: DriveFit,
    records: list[Run],
    units: dict[str, str],
    errors: dict[str, float],
    place: Place,
    endless: bool = False,
) -> str:
    """The machine `axis` that follows from a drive in metres, or `rotary` from one in radians.

    Its travel, its largest effort and its period are those of the records, its count is the
    smallest step of the position in them.

    Parameters
    ----------
    fit : DriveFit
        In m, and in N or V; or in rad, and in N m or V.
    records : list[Run]
        What it was found in.
    units : dict[str, str]
        By name of the parameter.
    errors : dict[str, float]
        Standard error by name of the parameter.
    place : Place
        What its places are counted in.
    endless : bool, optional
        Whether it turns on, without end stops.

    Returns
    -------
    str
        TOML.
    """
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
        effort=max(float(max(r.u.max(), -r.u.min())) for r in records),
        pitch=float(f"{least:.4g}"),
        period=float(f"{dt:.6g}"),
        travel=travel,
        speed=most / dt,
    )
    axis = fit.axis._replace(lag=fit.delay * dt + fit.axis.lag)
    head = [
        "A motor-driven axis as a machine: macromicro run --config model.toml",
        f"Its 0 {place.unit} is the lowest position in the records, its largest effort the "
        "largest there.",
    ]
    if fit.gain == 1.0:
        head.append(
            f"No gain was known: 1 {place.named('N')} below stands for one unit of the effort."
        )
    head += ["", "As found, by output error, with standard errors:"]
    for name, (value, error, _) in told(fit.refined).items():
        head.append(" ".join(filter(None, (f"  {name} = {value:.5g}", about(error), units[name]))))
    values, name = axis_settings.values(axis, around), "axis"
    if place.turns:
        load = eccentric.of(axis)
        load = load._replace(hangs=load.hangs - first)
        values, name = axis_settings.turned(values, load), "rotary"
        values = axis_settings.endless(values) if endless else values
        if "offset" in errors:
            head.append("A constant torque is no part of this machine: it is left out.")
    return axis_settings.as_toml(values, "\n".join(head), name)


def bench(fit: DriveFit, errors: dict[str, float]) -> str:
    """What follows for the bench's carriage and friction, its motor taken as it is.

    One volt at the D/A board is worth g = K duty supply / (full scale r R) newtons at the belt;
    back-EMF, K^2 / (r^2 R), is part of the viscous slope that was measured.

    Parameters
    ----------
    fit : DriveFit
        In counts and volts.
    errors : dict[str, float]
        Standard error by name of the parameter.

    Returns
    -------
    str
        TOML.
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
                    for n, v in zip(fit.refined.names, fit.refined.values, strict=True)
                }
            },
        )
