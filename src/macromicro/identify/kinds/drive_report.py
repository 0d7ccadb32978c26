"""An identified drive in words and files: parameters with units, a machine, plain values."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from macromicro.errors import InputError
from macromicro.identify import model_file
from macromicro.identify.runs import Run
from macromicro.place import PLACES, Place

if TYPE_CHECKING:
    from macromicro.identify.axis_fit import DriveFit
from collections.abc import Mapping
from typing import TYPE_CHECKING

from macromicro.arrays import Array
from macromicro.identify.result import Line, rounded
from macromicro.place import ANGLE, LENGTH

if TYPE_CHECKING:
    from macromicro.identify._disturbances import Ripple
    from macromicro.identify.axis_fit import DriveFit
    from macromicro.identify.axis_inverse import Estimate
    from macromicro.identify.presliding_fit import PreslidingFit
    from macromicro.identify.sprung_fit import SprungFit

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
        for n, (value, error, _) in parameter_values(fit.surest).items()
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
    for name, (value, error, _) in parameter_values(fit.surest).items():
        head.append(" ".join(filter(None, (f"  {name} = {value:.5g}", about(error), units[name]))))
    values, name = axis_settings.values(axis, around), "axis"
    if place.turns:
        load = eccentric.of(axis)
        load = load._replace(hangs=load.hangs - first)
        values, name = axis_settings.as_rotary(values, load), "rotary"
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
        "bench.carriage.mass": (axis.mass * per_count, about(errors["mass"] * per_count * 1e3, "g"))
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
        values["bench.friction.stribeck"] = (axis.stribeck * g, about(errors["stribeck"] * g, "N"))
        values["bench.friction.stribeck_speed"] = (axis.stribeck_speed * pitch, "with it")
    try:
        return model_file.settings(head, values)
    except InputError as error:
        found = zip(fit.surest.names, fit.surest.values.tolist(), strict=True)
        refused = {name: (value, "counts and volts") for name, value in found}
        return model_file.plain(f"The bench refuses these: {error}", {"axis": refused})


Values = dict[str, tuple[float, float, float]]  # value, standard error, 95 % factor

MEANINGS = {
    "frequency": "undamped, of mass and spring",
    "damping": "relative to critical damping",
    "mass": "inertia",
    "viscous": "viscous friction",
    "coulomb": "Coulomb friction",
    "offset": "constant force",
    "rest": "rest position of the spring",
    "asymmetry": "viscous, excess of forwards over backwards",
    "stribeck": "breakaway above Coulomb",
    "stribeck_speed": "speed over which that fades",
    "spring": "stiffness",
    "dead_zone": "input below which the drive gives no force",
    "unbalance": "gravity's greatest torque",
    "hangs": "angle at which the load hangs",
    "stiffness": "before it slides",
    "settling": "presliding damping over that stiffness",
    "delay": "of the force",
}
METHODS = ("inverse dynamics", "output error")
# Parameters that are there, or are not: of these the error must not exceed the value.
ABOVE_ZERO = ("mass", "viscous", "coulomb", "stribeck", "stribeck_speed", "spring", "dead_zone")
_DIVERGED = 10.0  # times the record's range: an error that is no figure any more


def units_of(force: str, x: str, u: str = "", driven: bool = True) -> dict[str, str]:
    """Units of the parameters, SI where force and position are; without a drive per mass."""
    named = {(p.named("N"), p.base): p.named("kg") for p in PLACES}
    mass = named.get((force, x), f"{force}*s^2/{x}")
    slope, stiff = f"{force}*s/{x}", f"{force}/{x}"
    if not driven:
        force, slope, stiff = f"{x}/s^2", "1/s", "1/s^2"
    return {
        "frequency": "Hz",
        "mass": mass,
        **dict.fromkeys(("viscous", "asymmetry"), slope),
        **dict.fromkeys(("coulomb", "offset", "stribeck", "unbalance"), force),
        **dict.fromkeys(("rest", "hangs"), x),
        "stribeck_speed": f"{x}/s",
        **dict.fromkeys(("spring", "stiffness"), stiff),
        "dead_zone": u,
        **dict.fromkeys(("settling", "delay", "lag"), "s"),
    }


def newton(x: str) -> str:
    """The unit of force where positions are in `x`: of torque for an angle."""
    return (ANGLE if x == ANGLE.base else LENGTH).named("N")


def parameter_values(found: Estimate | SprungFit) -> Values:
    """Parameters of an estimate; an eccentric load as unbalance and angle."""
    from macromicro.identify import eccentric
    from macromicro.identify.axis_inverse import ECCENTRIC

    each = (found.values, found.std, found.factors[1])
    every = zip(*(column.tolist() for column in each), strict=True)
    own = dict(zip(found.names, every, strict=True))
    made = {name: row for name, row in own.items() if name not in ECCENTRIC}
    factors = found.spread.factors(eccentric.slopes(found))[1]
    load = zip(
        *(column.tolist() for column in (*eccentric.gravity_terms(found), factors)), strict=True
    )
    return made | dict(zip(eccentric.NAMES, load, strict=False))


def _line(name: str, row: tuple[float, float, float], units: Mapping[str, str]) -> Line:
    value, error, factor = row
    return Line(name, value, error, units.get(name, ""), MEANINGS[name], factor)


def rigid_lines(fit: DriveFit, units: Mapping[str, str], dt: float) -> list[Line]:
    """Parameters of the surest estimate, the other one's as a note."""
    lines = []
    both = parameter_values(fit.inverse), parameter_values(fit.refined)
    best, other = both if fit.surest is fit.inverse else both[::-1]
    by = METHODS[fit.surest is fit.inverse]
    if "lag" in both[1]:
        lag, error, factor = both[1].pop("lag")
        lines.append(_line("delay", (fit.delay * dt + lag, error, factor), units))
    for name in both[1]:
        line = _line(name, best[name], units)
        second, spread = rounded(*other[name][:2])
        lines.append(line._replace(note=f"{line.note}; {by} {second}{spread and f' +- {spread}'}"))
    return lines


def sprung_lines(fit: SprungFit, units: Mapping[str, str]) -> list[Line]:
    """Parameters, and what follows from mass and spring."""
    rows: Values = {}
    if fit.load.spring:
        for name in ("frequency", "damping"):
            value, error, factors = fit.derived(name)
            rows[name] = value, error, float(factors[1])
    for name, (value, error, factor) in parameter_values(fit).items():
        if name == "offset" and fit.load.spring:
            k, f0 = fit.axis.spring, fit.axis.offset
            slopes = np.zeros((1, len(fit.names)))
            at = [fit.names.index("offset"), fit.names.index("spring")]
            slopes[0, at] = [-1.0 / k, f0 / (k * k)]
            spread, factors = fit.combined(slopes)
            rows["rest"] = -f0 / k, spread, float(factors[1])
        else:
            size = fit.gain if name == "dead_zone" else 1.0
            own = "delay" if name == "lag" else name
            rows[own] = value / size, error / abs(size), factor
    return [_line(name, row, units) for name, row in rows.items()]


def elastic_lines(fit: PreslidingFit, units: Mapping[str, str], place: str) -> list[Line]:
    """Parameters, with the levels of friction along the travel."""
    nodes = nodes_of(fit)
    lines: list[Line] = []
    levels = 0
    every = zip(fit.names, fit.values, fit.std, fit.factors[1].tolist(), strict=True)
    for name, value, error, factor in every:
        kind = name.split(maxsplit=1)[0]
        if kind == "level" and len(nodes) > 1:
            note = f"Coulomb friction at {nodes[levels]:.4g} {place}"
            lines.append(Line(name, value, error, units["coulomb"], note, factor))
            levels += 1
        else:
            own = "coulomb" if kind == "level" else name
            lines.append(_line(own, (value, error, factor), units))
    return lines


def nodes_of(fit: PreslidingFit) -> Array:
    return np.linspace(fit.model.low, fit.model.high, len(fit.model.levels))


def structure(
    head: str, taken: str, scores: Mapping[str, float], reasons: Mapping[str, str], most: float
) -> str:
    """The structures that were tried with their errors on data held out, up to `most`."""
    if not scores:
        return f"{taken}, as given"
    said = []
    for name in dict.fromkeys((taken, *scores, *reasons)):
        if scores.get(name, 0.0) > _DIVERGED * most:
            said.append(f"{name} diverges")
            continue
        error = f" {scores[name]:.4g}" if name in scores else ""
        why = f": {reasons[name]}" if reasons.get(name) else ""
        said.append(f"{name}{error}{', taken' if name == taken else why}")
    return f"{head}: " + "; ".join(said)


def slow(name: str) -> tuple[str, str]:
    """What errors by parts of a record leave out."""
    text = f"the error of {name} leaves out forces that last longer than a part of a record"
    return "slow forces", text


def ripple_lines(found: Ripple | None, force: str, x: str) -> list[tuple[str, str]]:
    if found is None:
        return []
    every = 2.0 * math.pi / found.turn
    said = f"a force of {found.size:.3g} {force} repeats every {every:.3g} {x}"
    return [("repeats", f"{said}; not modelled, but included in the errors")]


def late(delay: int | str) -> list[tuple[str, str]]:
    if not delay or isinstance(delay, str):
        return []
    return [("delay", f"u acts {delay} sample{'s' * (delay != 1)} late")]
