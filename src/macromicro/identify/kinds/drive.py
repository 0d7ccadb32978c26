"""`identify drive`: mass and friction of a motor-driven axis."""

from __future__ import annotations

import warnings
from contextlib import suppress
from typing import TYPE_CHECKING, NamedTuple

from macromicro.errors import InputError, ProblemError
from macromicro.identify import _report
from macromicro.identify._report import Curves
from macromicro.identify.driven import FIT, Driven
from macromicro.identify.kinds import drive_file, drive_words, presliding, sprung, testing
from macromicro.identify.kinds.loading import Picking, loaded
from macromicro.identify.picking import RUN, Picked, Role, T, railed, runs
from macromicro.identify.result import Result
from macromicro.identify.runs import Run, checked
from macromicro.place import ANGLE

if TYPE_CHECKING:
    from macromicro.identify.axis_fit import DriveFit


U = Role(
    "u",
    "drive voltage, current or force; --free without a drive",
    ("u", "U", "motor", "voltage", "volts", "v", "V", "force", "torque", "f", "vir", "input"),
    ("V", "N", "A", "N*m"),
)
X = Role(
    "x",
    "position, or a speed with --columns v=COLUMN",
    ("x", "X", "macro_position", "position", "pos", "qm", "q", "y", "Y", "angle"),
    ("m", "rad", "counts"),
)
ROLES = (T, U, X, RUN)
_EXPLAINED = 80.0  # %: a fit that is one
GAINS = ("gain", "gtau")
_OTHERS = "a spring, a dead zone, a measured speed or a free motion"


class Options(NamedTuple):
    gain: float | None = None  # force per unit of u; None: as the file says, else 1
    structure: str = "auto"  # structure of the friction
    limit: float | None = None  # u saturates there
    # samples by which u acts late, or "fit": found with the parameters; None: as the file says,
    # else 0
    delay: int | str | None = None
    tests: tuple[str, ...] = ()  # files with records that are not fitted
    spring: bool = False  # see `kinds.sprung`
    dead_zone: bool = False  # of the drive
    free: bool = False  # no drive: a decay
    # nodes of the friction's level along the travel, of elastic friction; None: as pieces held out
    # ask for
    along: int | None = None
    eccentric: bool = False  # eccentric load of a rotary axis
    endless: bool = False  # continuous rotation, without end stops


def identify(picking: Picking, options: Options) -> Result:
    from macromicro.identify.presliding import FRICTIONS

    _checked(options)
    if _other(picking, options):
        return sprung.identify(picking, (T, U, X), _asked(options), GAINS)
    tables = loaded(picking, ROLES)
    first = tables[0]
    others = _report.unseen(options.tests, picking, ROLES, first)
    records = [run for table in tables for run in measured(table)]
    gain, said = options.gain, "as given"
    if gain is None:
        name = next((n for n in GAINS if n in first.constants), "")
        gain, said = first.constants.get(name, 1.0), f"{name} in the file"
    delay = options.delay
    if delay is None:
        delay = int(first.constants.get("delay", 0))
    u_unit, x_unit = first.units["u"] or "u", first.units["x"] or "x"
    for name in ("eccentric", "endless"):
        if getattr(options, name) and x_unit != ANGLE.base:
            raise ProblemError(
                f"--{name}",
                f"the unit of x is {first.units['x'] or 'unknown'}",
                "Name an angle in rad or deg, such as --columns x=angle:deg.",
            )
    newton = drive_words.newton(x_unit)
    force = newton if abs(gain) != 1.0 else u_unit
    named = bool(first.units["x"]) and (abs(gain) != 1.0 or bool(first.units["u"]))
    units = (
        drive_words.units_of(force, x_unit) if named else dict.fromkeys(drive_words.MEANINGS, "")
    )
    units = {**units, "lag": "s"}
    unseen = [(table.file, run) for table in others for run in measured(table)]
    if options.structure in FRICTIONS:
        told = presliding.Records(records, unseen, force, x_unit, units)
        driven = Driven(gain, options.limit, int(delay))
        return presliding.identify(told, options.structure, options.along, driven)

    fit = _fitted(records, options, gain, delay, first.file if x_unit == ANGLE.base else "")
    lines = drive_words.lines(fit, units, records[0].dt)
    _report.undetermined(lines, drive_words.ABOVE_ZERO)
    trials = [testing.driven(fit, run, file) for file, run in unseen]
    samples = sum(len(r.t) for r in records)
    remarks = [
        ("fit", f"free run {fit.fit:.2f} %, RMS {fit.rms:.4g} {x_unit} over {samples} samples"),
        ("on held-out data", f"RMS {fit.holdout_rms:.4g} {x_unit}"),
        ("method", f"{drive_words.METHODS[fit.surest is not fit.inverse]}, the surer one"),
        ("force, inverse dynamics", f"error {fit.inverse.percent:.2f} %"),
        ("structure", drive_words.structure(fit)),
        drive_words.slow("offset"),
        *drive_words.repeated(fit.refined.repeats, force, x_unit),
    ]
    if not named:
        bare = " and ".join(n for n in ("u", "x") if not first.units[n])
        remarks.append(
            ("units", f"none given for {bare}; the parameters are in the units of the columns")
        )
    if gain != 1.0:
        remarks.append(("gain", f"{gain:g} {newton}/{u_unit}, {said}"))
    remarks += drive_words.late(delay)
    data = {
        "structure": fit.structure,
        "rms": fit.rms,
        "fit_percent": fit.fit,
        "gain": gain,
        "delay": fit.delay,
        "lag": fit.axis.lag,
        "holdout": fit.holdout,
        "reasons": fit.reasons,
        "holdout_rms": fit.holdout_rms,
        "method": drive_words.METHODS[fit.surest is not fit.inverse],
        "refined": dict(zip(fit.refined.names, fit.refined.values, strict=True)),
        "refined_std": dict(zip(fit.refined.names, fit.refined.std, strict=True)),
        "inverse": dict(zip(fit.inverse.names, fit.inverse.values, strict=True)),
        "inverse_std": dict(zip(fit.inverse.names, fit.inverse.std, strict=True)),
    }

    def curves() -> Curves:
        t, x = [r.t for r in records], [r.x for r in records]
        return Curves(
            _report.pairs(t, x, fit.free_run), f"position [{x_unit}]", records[0].dt, fit.residuals
        )

    title = "M dv/dt = gain u - (Fv +- Fa) v -+ (Fc + Fs exp(-(v/vs)^2)) - F0"
    title += " - unbalance sin(x - hangs)" if options.eccentric else ""
    toml = drive_file.settings(fit, records, force, x_unit, units, options.endless)
    remarks += drive_file.limits(toml, records, (u_unit, x_unit))
    parts = Result("drive", title, fit.axis, lines, remarks, toml, dict, data)
    return _report.completed(parts, x_unit, trials, curves)


def _fitted(
    records: list[Run], options: Options, gain: float, delay: int | str, turns: str
) -> DriveFit:
    """The drive; of the rotary file `turns` a poor fit tries an eccentric load."""
    from macromicro.identify import drive

    def fitted(eccentric: bool | None) -> DriveFit:
        return drive(
            [r.t for r in records],
            [r.u for r in records],
            [r.x for r in records],
            gain=gain,
            structure=options.structure,
            limit=options.limit,
            delay=delay,
            eccentric=eccentric,
        )

    if options.eccentric or not turns:
        return fitted(options.eccentric)
    found: DriveFit | InputError
    try:
        found = fitted(None)
    except InputError as error:
        found = error
    if isinstance(found, InputError) or found.fit < _EXPLAINED:
        fit = 0.0
        with warnings.catch_warnings(), suppress(InputError):
            warnings.simplefilter("ignore")
            fit = fitted(True).fit
        if fit >= _EXPLAINED:
            said = f"only gravity on an eccentric load explains the record (fit {fit:.1f} %)"
            raise ProblemError(turns, said, "Add --eccentric.")
    if isinstance(found, InputError):
        raise found
    return found


def _checked(options: Options) -> None:
    from macromicro.identify.presliding import FRICTIONS

    if options.limit is not None and not options.limit > 0.0:
        raise InputError("--limit", options.limit, "a value above zero")
    if options.along is not None and options.structure not in FRICTIONS:
        raise ProblemError(
            "--along", "it needs elastic friction", f"Add --structure {' or '.join(FRICTIONS)}."
        )
    if options.delay == FIT and options.structure in FRICTIONS:
        raise InputError("--delay", FIT, "a whole number of samples with elastic friction")
    for name in ("eccentric", "endless"):
        if getattr(options, name) and options.structure in FRICTIONS:
            raise ProblemError(
                f"--{name}", f"it cannot be combined with --structure {options.structure}"
            )


def _other(picking: Picking, options: Options) -> bool:
    flags = options.spring or options.dead_zone or options.free
    return flags or sprung.in_speeds(picking, X)


def _asked(options: Options) -> sprung.Asked:
    """Options for `kinds.sprung`; rejects those that it does not have."""
    if options.endless:
        raise ProblemError("--endless", f"it cannot be combined with {_OTHERS}")
    if options.free and options.limit is not None:
        raise ProblemError("--limit", "a free motion has no drive")
    whole = isinstance(options.delay, int) and options.delay >= 0
    if not (options.delay in (None, FIT) or whole) or (options.free and options.delay == FIT):
        accepted = "a whole number of samples from 0" + ("" if options.free else f', or "{FIT}"')
        raise InputError("--delay", options.delay, accepted)
    shared = {n: getattr(options, n) for n in sprung.Asked._fields}
    return sprung.Asked(**shared)


def measured(table: Picked) -> list[Run]:
    found = []
    for part in runs(table):
        railed(part["x"], f"{table.file}, x")
        found.append(checked(part["t"], part["u"], part["x"], table.file, 200))
    return found
