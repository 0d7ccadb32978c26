"""`identify drive`: mass and friction of a motor-driven axis."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from macromicro.errors import InputError
from macromicro.identify.driven import Driven
from macromicro.identify.kinds import model_file, presliding, sprung, testing
from macromicro.identify.kinds.loading import Picking, loaded
from macromicro.identify.picking import RUN, Picked, Role, railed, runs
from macromicro.identify.result import Line, Result, rounded
from macromicro.identify.runs import Run, checked
from macromicro.place import ANGLE, LENGTH, PLACES, Place

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.identify.axis_fit import DriveFit
    from macromicro.identify.axis_inverse import Estimate

T = Role("t", "time", ("t", "time", "zeit"), ("s",))
U = Role(
    "u",
    "drive voltage, current or force; where nothing drives: --free",
    ("u", "U", "motor", "voltage", "volts", "v", "V", "force", "f", "vir", "input"),
    ("V", "N", "A"),
)
X = Role(
    "x",
    "position; a speed instead: --columns v=COLUMN",
    ("x", "X", "macro_position", "position", "pos", "qm", "q", "y", "Y", "angle"),
    ("m", "rad", "counts"),
)
ROLES = (T, U, X, RUN)
_FINEST = 1e-9  # of the travel; smaller steps are rounding, not counts
GAINS = ("gain", "gtau")
MEANINGS = {
    "mass": "inertia",
    "viscous": "viscous friction",
    "coulomb": "Coulomb friction",
    "offset": "constant force",
    "asymmetry": "viscous, forwards more than backwards by",
    "stribeck": "breakaway above Coulomb",
    "stribeck_speed": "speed over which that fades",
    "unbalance": "gravity's greatest torque",
    "hangs": "angle at which the load hangs",
}


class Options(NamedTuple):
    """Options of `identify drive`.

    Attributes
    ----------
    gain : float | None
        Force per unit of u; None: as the file says, else 1.
    structure : str
        Structure of the friction.
    limit : float | None
        u saturates there.
    delay : int | None
        Samples by which u acts late; None: as the file says, else 0.
    tests : tuple[str, ...]
        Files with records that are not fitted.
    spring : bool
        Whether a spring pulls (`kinds.sprung`).
    dead_zone : bool
        Whether the drive has a dead zone.
    free : bool
        Whether nothing drives: a decay.
    along : int | None
        Nodes of the friction's level along the travel, of elastic friction; None: as pieces held
        out ask for.
    eccentric : bool
        Whether gravity pulls at an eccentric load, which turns.
    """

    gain: float | None = None
    structure: str = "auto"
    limit: float | None = None
    delay: int | None = None
    tests: tuple[str, ...] = ()
    spring: bool = False
    dead_zone: bool = False
    free: bool = False
    along: int | None = None
    eccentric: bool = False


def identify(picking: Picking, options: Options) -> Result:
    """Physical parameters by inverse dynamics and output error (`macromicro.identify.drive`).

    Parameters
    ----------
    picking : Picking
        Files to read, and role to column.
    options : Options
        Options as on the command line.

    Returns
    -------
    Result
        Its model is an `Axis`.

    Raises
    ------
    InputError
        An option or the data are not accepted.
    """
    from macromicro.identify import drive
    from macromicro.identify.presliding import FRICTIONS

    _checked(options)
    if _other(picking, options):
        return sprung.identify(picking, (T, U, X), _asked(options), GAINS)
    tables = loaded(picking, ROLES)
    first = tables[0]
    others = testing.unseen(options.tests, picking, ROLES, first)
    records = [run for table in tables for run in measured(table)]
    gain, said = options.gain, "as given"
    if gain is None:
        name = next((n for n in GAINS if n in first.constants), "")
        gain, said = first.constants.get(name, 1.0), f"{name} in the file"
    delay = options.delay
    if delay is None:
        delay = int(first.constants.get("delay", 0))
    u_unit, x_unit = first.units["u"] or "u", first.units["x"] or "x"
    if options.eccentric and x_unit != ANGLE.base:
        accepted = "a position in rad or deg, such as --columns x=angle:deg"
        raise InputError("--eccentric", f"x in {first.units['x'] or 'no unit'}", accepted)
    newton = (ANGLE if x_unit == ANGLE.base else LENGTH).named("N")
    force = newton if gain != 1.0 else u_unit
    named = bool(first.units["x"]) and (gain != 1.0 or bool(first.units["u"]))
    units = units_of(force, x_unit) if named else dict.fromkeys(MEANINGS, "")
    unseen = [(table.file, run) for table in others for run in measured(table)]
    if options.structure in FRICTIONS:
        told = presliding.Records(records, unseen, force, x_unit, units)
        driven = Driven(gain, options.limit, delay)
        return presliding.identify(told, options.structure, options.along, driven)
    fit = drive(
        [r.t for r in records],
        [r.u for r in records],
        [r.x for r in records],
        gain=gain,
        structure=options.structure,
        limit=options.limit,
        delay=delay,
        eccentric=options.eccentric,
    )
    lines = _lines(fit, units)
    trials = [testing.driven(fit, run, file) for file, run in unseen]
    lines += testing.lines(trials, x_unit)
    samples = sum(len(r.t) for r in records)
    remarks = [
        ("fit", f"free run {fit.fit:.2f} %, RMS {fit.rms:.4g} {x_unit} over {samples} samples"),
        ("on data that was not fitted to", f"RMS {fit.holdout_rms:.4g} {x_unit}"),
        ("force, inverse dynamics", f"error {fit.inverse.percent:.2f} %"),
        ("structure", structure(fit)),
    ]
    if not named:
        bare = " and ".join(n for n in ("u", "x") if not first.units[n])
        remarks.append(("units", f"none is named for {bare}: parameters in those of the columns"))
    if gain != 1.0:
        remarks.append(("gain", f"{gain:g} {newton}/{u_unit}, {said}"))
    if delay:
        remarks.append(("delay", f"u acts {delay} samples late"))
    data = {
        "structure": fit.structure,
        "rms": fit.rms,
        "fit_percent": fit.fit,
        "gain": gain,
        "delay": delay,
        "holdout": fit.holdout,
        "reasons": fit.reasons,
        "holdout_rms": fit.holdout_rms,
        "inverse": dict(zip(fit.inverse.names, fit.inverse.values, strict=True)),
        "inverse_std": dict(zip(fit.inverse.names, fit.inverse.std, strict=True)),
        "tests": testing.data(trials),
    }

    def draw() -> dict[str, Figure]:
        from macromicro.identify.kinds import pictures

        t = [r.t for r in records]
        label = f"position [{x_unit}]"
        return {
            "free_run": testing.drawn(t, [r.x for r in records], fit.free_run, trials, label),
            "residuals": pictures.leftover(fit.residuals, records[0].dt, label),
        }

    title = "M dv/dt = gain u - (Fv +- Fa) v -+ (Fc + Fs exp(-(v/vs)^2)) - F0"
    title += " - unbalance sin(x - hangs)" if options.eccentric else ""
    toml = settings(fit, records, force, x_unit, units)
    return Result("drive", title, fit.axis, lines, remarks, toml, draw, data)


def _checked(options: Options) -> None:
    from macromicro.identify.presliding import FRICTIONS

    if options.limit is not None and not options.limit > 0.0:
        raise InputError("--limit", options.limit, "a value above zero")
    if options.along is not None and options.structure not in FRICTIONS:
        accepted = f"only with --structure {' or '.join(FRICTIONS)}"
        raise InputError("--along", options.along, accepted)
    if options.eccentric and options.structure in FRICTIONS:
        raise InputError("--eccentric", options.structure, "no elastic friction beside it")


def _lines(fit: DriveFit, units: dict[str, str]) -> list[Line]:
    """The parameters by output error, beside those by inverse dynamics."""
    lines = []
    inverse = told(fit.inverse)
    for name, (value, error) in told(fit.refined).items():
        other, spread = rounded(*inverse[name])
        note = f"{MEANINGS[name]}; inverse dynamics {other}" + (spread and f" +- {spread}")
        lines.append(Line(name, value, error, units[name], note))
    return lines


def told(found: Estimate) -> dict[str, tuple[float, float]]:
    """What an estimate tells of an axis; an eccentric load as people know it.

    Parameters
    ----------
    found : Estimate
        By any method.

    Returns
    -------
    dict[str, tuple[float, float]]
        Value and standard error by name.
    """
    from macromicro.identify import eccentric
    from macromicro.identify.axis_inverse import ECCENTRIC

    every = zip(found.names, found.values.tolist(), found.std.tolist(), strict=True)
    made = {name: (value, error) for name, value, error in every if name not in ECCENTRIC}
    values, errors = eccentric.told(found)
    load = zip(values.tolist(), errors.tolist(), strict=True)
    return made | dict(zip(eccentric.NAMES, load, strict=False))


def _other(picking: Picking, options: Options) -> bool:
    """Whether the axis is one for `kinds.sprung`."""
    flags = options.spring or options.dead_zone or options.free
    return flags or sprung.in_speeds(picking, X)


def _asked(options: Options) -> sprung.Asked:
    """The options that it shares. Raises InputError for those that it does not have."""
    if options.limit is not None:
        accepted = "no limit with a spring, a dead zone, speeds or a free motion"
        raise InputError("--limit", options.limit, accepted)
    if options.eccentric:
        accepted = "no spring, dead zone, speeds or free motion beside it"
        raise InputError("--eccentric", "with one of these", accepted)
    if options.delay is not None and options.delay < 0:
        raise InputError("delay", options.delay, "a whole number of samples from 0")
    shared = {n: getattr(options, n) for n in sprung.Asked._fields}
    return sprung.Asked(**shared)


def measured(table: Picked) -> list[Run]:
    """The runs of a file, checked.

    Parameters
    ----------
    table : Picked
        Columns t, u and x.

    Returns
    -------
    list[Run]
        One or more.

    Raises
    ------
    InputError
        One of them is unusable.
    """
    found = []
    for part in runs(table):
        railed(part["x"], f"{table.file}, x")
        found.append(checked(part["t"], part["u"], part["x"], table.file, 200))
    return found


def units_of(force: str, x: str) -> dict[str, str]:
    """Units of the parameters; kg, N s/m and N, or kg m^2, N m s/rad and N m, where force and
    position are SI.

    Parameters
    ----------
    force : str
        Unit of the force.
    x : str
        Unit of the position.

    Returns
    -------
    dict[str, str]
        Unit by name of the parameter.
    """
    whole = {(p.named("N"), p.base): p.named("kg") for p in PLACES}
    slope = f"{force}*s/{x}"
    return {
        "mass": whole.get((force, x), f"{force}*s^2/{x}"),
        "viscous": slope,
        "coulomb": force,
        "offset": force,
        "asymmetry": slope,
        "stribeck": force,
        "stribeck_speed": f"{x}/s",
        "unbalance": force,
        "hangs": x,
    }


def structure(fit: DriveFit) -> str:
    """The friction that was chosen, and by what, in words.

    Parameters
    ----------
    fit : DriveFit
        What was found.

    Returns
    -------
    str
        One line.
    """
    if not fit.holdout:
        return f"{fit.structure}, as given"
    tried = [f"{fit.structure} {fit.holdout[fit.structure]:.4g}, taken"]
    for name, why in fit.reasons.items():
        error = f" {fit.holdout[name]:.4g}" if name in fit.holdout else ""
        tried.append(f"{name}{error}: {why}")
    return "force error on held-out data: " + "; ".join(tried)


def settings(fit: DriveFit, records: list[Run], force: str, x: str, units: dict[str, str]) -> str:
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
            return machine(fit, records, units, errors, place)
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

    Returns
    -------
    str
        TOML.
    """
    from macromicro.identify import axis_settings, eccentric
    from macromicro.identify.axis_settings import Around

    places = np.concatenate([r.x for r in records])
    travel, dt = float(np.ptp(places)), records[0].dt
    steps = np.abs(np.concatenate([np.diff(r.x) for r in records]))
    least = float(steps[steps > _FINEST * travel].min())
    around = Around(
        gain=fit.gain,
        effort=max(float(np.abs(r.u).max()) for r in records),
        pitch=float(f"{least:.4g}"),
        period=float(f"{dt:.6g}"),
        travel=travel,
        speed=float(steps.max()) / dt,
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
    for name, (value, error) in told(fit.refined).items():
        head.append(" ".join(filter(None, (f"  {name} = {value:.5g}", about(error), units[name]))))
    values, name = axis_settings.values(axis, around), "axis"
    if place.turns:
        load = eccentric.of(axis)
        load = load._replace(hangs=load.hangs - float(places.min()))
        values, name = axis_settings.turned(values, load), "rotary"
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
