"""`identify drive`: mass and friction of a motor-driven axis.

By inverse dynamics and output error; by output error alone with a spring, a dead zone, a measured
speed or no drive, and with friction that is elastic before it slides.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.files.reading import is_forc, read_table
from macromicro.identify import _report, model_file
from macromicro.identify._report import Curves, Pair
from macromicro.identify.kinds import drive_report
from macromicro.identify.options import Drive as Options
from macromicro.identify.picking import RUN, Picking, Role, T, even_runs, match_columns
from macromicro.identify.records import fit_percent
from macromicro.identify.result import Line, Result
from macromicro.identify.runs import Run
from macromicro.identify.sprung_fit import FIT
from macromicro.place import ANGLE
from macromicro.units import readable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.identify.axis_fit import DriveFit
    from macromicro.identify.presliding_fit import PreslidingFit
    from macromicro.identify.sprung_fit import SprungFit

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
V = Role(
    "v",
    "speed",
    ("speed", "velocity", "rate", "omega", "qd", "dq", "dx"),
    ("m/s", "rad/s", "counts/s"),
)
ROLES = (T, U, X, RUN)
GAINS = ("gain", "gtau")
_PLACES = {unit: unit.removesuffix("/s") for unit in V.units}
_LEAST, _FEWEST = 200, 50  # samples of a record: for inverse dynamics, for output error alone
_EXPLAINED = 80.0  # %: a fit that is one
# Misfits that ask for another sign, and that answer it, by the scatter of the record.
_POOR, _GOOD = 0.5, 0.2
_FAILURES = (InputError, ArithmeticError, ValueError, np.linalg.LinAlgError)
_OTHERS = "a spring, a dead zone, a measured speed or a free motion"
_FRICTION = "(Fv +- Fa) v -+ (Fc + Fs exp(-(v/vs)^2)) - F0"


class Loaded(NamedTuple):
    """Records with their units and what is assumed about the drive."""

    runs: list[Run]
    tests: list[tuple[str, Run]]  # file and record of those that are not fitted
    file: str
    gain: float  # force per unit of u
    gain_by: str
    delay: int | str
    speed: bool  # the output is a speed
    output: str  # unit of the output
    place: str  # unit of the position
    u: str
    bare: tuple[str, ...]  # columns without a unit

    @property
    def columns(self) -> tuple[list[Array], list[Array], list[Array]]:
        """Times, inputs and outputs of the records."""
        return [r.t for r in self.runs], [r.u for r in self.runs], [r.x for r in self.runs]

    @property
    def named(self) -> bool:
        """Whether the parameters' units are known."""
        return "x" not in self.bare and ("u" not in self.bare or abs(self.gain) != 1.0)

    @property
    def force(self) -> str:
        return drive_report.newton(self.place) if abs(self.gain) != 1.0 else self.u


class Part(NamedTuple):
    """What one kind of drive adds to the report of all."""

    model: Any
    title: str
    lines: list[Line]
    remarks: list[tuple[str, str]]  # first ones
    more: list[tuple[str, str]]  # last ones
    data: dict[str, Any]
    toml: str
    start: Callable[[Run], tuple[float, float]]  # place and speed where a test begins
    draw: Callable[[], dict[str, Figure]] = dict


def identify(picking: Picking, options: Options) -> Result:
    from macromicro.identify.presliding import LUGRE

    _check(options)
    if options.spring or options.dead_zone or options.free or in_speeds(picking, X):
        _checked_output_error(picking, options)
        records = _load(picking, options, in_speeds(picking, X), _FEWEST)
        found = _sprung(records, options)
        return _report_fit(records, found, _sprung_part(records, options, found))
    records = _load(picking, options, False, _LEAST)
    if options.structure == LUGRE:
        elastic = _elastic(records, options)
        return _report_fit(records, elastic, _elastic_part(records, elastic))
    fit = _rigid(records, options)
    return _report_fit(records, fit, _rigid_part(records, options, fit))


def _report_fit(records: Loaded, fit: DriveFit | SprungFit | PreslidingFit, part: Part) -> Result:
    _report.warn_of_undetermined(part.lines, drive_report.ABOVE_ZERO)
    t, _, x = records.columns
    each = zip(fit.free_run, fit.residuals, strict=True)
    percent = fit_percent([free + left for free, left in each], fit.free_run)
    samples, unit = sum(map(len, t)), records.output
    remarks = [
        ("fit", f"free run {percent:.2f} %, RMS {_amount(fit.rms, unit)} over {samples} samples"),
        *part.remarks,
        *drive_report.late(records.delay),
        *part.more,
    ]
    data = {"rms": fit.rms, "fit_percent": percent, "gain": records.gain, **part.data}

    def curves() -> Curves:
        label = f"{'speed' if records.speed else 'position'} [{unit}]"
        pairs = _report.pairs(t, x, fit.free_run)
        return Curves(pairs, label, records.runs[0].dt, fit.residuals)

    def predicted(file: str, run: Run) -> Pair:
        return Pair(file, run.t, run.x, fit.simulate(run.u, run.dt, *part.start(run)))

    tests = [predicted(*one) for one in records.tests]
    result = Result(
        "drive", part.title, part.model, part.lines, remarks, part.toml, part.draw, data
    )
    return _report.complete(result, unit, tests, curves)


def _amount(value: float, unit: str) -> str:
    scale, to = readable(value, unit)
    return f"{scale * value:.4g} {to}"


def _rigid_part(records: Loaded, options: Options, fit: DriveFit) -> Part:
    units = drive_report.units_of(records.force, records.place)
    if not records.named:
        units = dict.fromkeys(units, "") | {"delay": "s"}
    method = drive_report.METHODS[fit.surest is not fit.inverse]
    tried = drive_report.structure(
        "force error on held-out data", fit.structure, fit.holdout, fit.reasons, math.inf
    )
    remarks = [
        ("on held-out data", f"RMS {_amount(fit.holdout_rms, records.place)}"),
        ("method", f"{method}, the more accurate one"),
        ("force, inverse dynamics", f"error {fit.inverse.percent:.2f} %"),
        ("structure", tried),
        drive_report.slow("offset"),
        *drive_report.ripple_lines(fit.refined.repeats, records.force, records.place),
    ]
    more = []
    if not records.named:
        bare = " and ".join(records.bare)
        said = f"none given for {bare}; the parameters are in the units of the columns"
        more.append(("units", said))
    if records.gain != 1.0:
        newton = drive_report.newton(records.place)
        more.append(("gain", f"{records.gain:g} {newton}/{records.u}, {records.gain_by}"))
    toml = drive_report.settings(
        fit, records.runs, records.force, records.place, units, options.endless
    )
    more += drive_report.limits(toml, records.runs, (records.u, records.place))
    data = {
        "structure": fit.structure,
        "delay": fit.delay,
        "lag": fit.axis.lag,
        "holdout": fit.holdout,
        "reasons": fit.reasons,
        "holdout_rms": fit.holdout_rms,
        "method": method,
    }
    for name, one in (("refined", fit.refined), ("inverse", fit.inverse)):
        data[name] = dict(zip(one.names, one.values, strict=True))
        data[f"{name}_std"] = dict(zip(one.names, one.std, strict=True))
    title = _title("gain u", options.eccentric)
    lines = drive_report.rigid_lines(fit, units, records.runs[0].dt)
    return Part(fit.axis, title, lines, remarks, more, data, toml, _measured_start(fit))


def _sprung_part(records: Loaded, options: Options, fit: SprungFit) -> Part:
    from macromicro.identify.sprung_fit import initial_state, same

    unit = records.output
    units = drive_report.units_of(records.force, records.place, records.u, not options.free)
    lines = drive_report.sprung_lines(fit, units)
    runs = zip(fit.free_run, fit.residuals, strict=True)
    most = max(float(np.ptp(free + left)) for free, left in runs)
    head = f"RMS on pieces held out in turn, in {unit}"
    ends = f"{fit.ends[0]:.4g}" + (f" to {fit.ends[-1]:.4g}" if len(fit.ends) > 1 else "")
    remarks = [
        ("structure", drive_report.structure(head, fit.friction, fit.holdout, fit.reasons, most)),
        ("searches", f"{same(fit.ends)} of {len(fit.ends)} end there; RMS {ends} {unit}"),
        ("starts", "position and speed at the start of each record are fitted too"),
    ]
    if "offset" in fit.names:
        remarks.append(drive_report.slow("rest" if fit.load.spring else "offset"))
    remarks += drive_report.ripple_lines(fit.repeats, units["coulomb"], unit)
    more = [("free motion", "without a drive, forces are per mass")] if options.free else []
    data = {
        "structure": fit.friction,
        "spring": fit.load.spring,
        "dead_zone": fit.load.dead_zone,
        "delay": records.delay,
        "lag": fit.axis.lag,
        "holdout": fit.holdout,
        "reasons": fit.reasons,
        "searches": fit.ends,
        "starts": fit.starts,
    }
    note = "A drive with a spring, a dead zone or none: parameters by output error, for other\n"
    note += "programs. Not for `macromicro run --config`: no machine of the package is like it."
    toml = model_file.plain(note, {"free" if options.free else "drive": _report.notes(lines)})
    title = _title("D(gain u) - k x", options.eccentric)
    return Part(
        fit.axis, title, lines, remarks, more, data, toml, lambda run: initial_state(fit, run)
    )


def _elastic_part(records: Loaded, fit: PreslidingFit) -> Part:
    from macromicro.identify.presliding import LUGRE

    place = records.place
    units = drive_report.units_of(records.force, place)
    if not records.named:
        units = dict.fromkeys(units, "") | {"settling": "s"}
    lines = drive_report.elastic_lines(fit, units, place)
    nodes, levels = drive_report.nodes_of(fit), fit.model.levels
    head = f"RMS of free runs over pieces held out, in {place}"
    tried = drive_report.structure(head, fit.taken, fit.judged, fit.reasons, math.inf)
    remarks = [("structure", tried), drive_report.slow("offset")]
    values: dict[str, tuple[Any, str]] = {"friction": (LUGRE, ""), **_report.notes(lines)}
    if len(nodes) > 1:
        values["low"] = (fit.model.low, "place of the first level")
        values["high"] = (fit.model.high, "place of the last one")
        at = ", ".join(f"{x:.4g}" for x in nodes)
        remarks.append(("levels", f"of the Coulomb friction at {at} {place}, linear between"))
    remarks += drive_report.ripple_lines(fit.repeats, records.force, place)
    data = {
        "structure": LUGRE,
        "taken": fit.taken,
        "judged": fit.judged,
        "reasons": fit.reasons,
        "delay": fit.delay,
        "nodes": nodes,
    }
    note = "A motor-driven axis whose friction is elastic before it slides: parameters by output\n"
    note += "error, for other programs. Not for `macromicro run --config`."

    def draw() -> dict[str, Figure]:
        from macromicro.identify.kinds import pictures

        if len(nodes) < 2:
            return {}
        series = [("Coulomb friction", nodes, levels, "o-")]
        label = f"position [{place}]"
        title = "friction along the travel"
        return {"along": pictures.points(title, label, f"[{records.force}]", series)}

    title = "M dv/dt = gain u - (Fv +- Fa) v - (f + tau df/dt) - F0, f elastic up to Fc(x) + Fs"
    toml = model_file.plain(note, {"drive": values})
    return Part(fit.model, title, lines, remarks, [], data, toml, _measured_start(fit), draw)


def _measured_start(fit: DriveFit | PreslidingFit) -> Callable[[Run], tuple[float, float]]:
    """The measured place and speed at the start of a record."""
    from macromicro.identify.axis_fit import start

    return lambda run: start(run, fit.gain, fit.delay)


def _title(drive: str, eccentric: bool) -> str:
    return f"M dv/dt = {drive} - {_FRICTION}" + " - unbalance sin(x - hangs)" * eccentric


def _rigid(records: Loaded, options: Options) -> DriveFit:
    """The drive; of rotary records a poor fit tries an eccentric load."""
    from macromicro.identify import drive

    def fitted(eccentric: bool | None) -> DriveFit:
        return drive(
            *records.columns,
            gain=records.gain,
            structure=options.structure,
            limit=options.limit,
            delay=records.delay,
            eccentric=eccentric,
        )

    if options.eccentric or records.place != ANGLE.base:
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
            raise ProblemError(records.file, said, "Add --eccentric.")
    if isinstance(found, InputError):
        raise found
    return found


def _elastic(records: Loaded, options: Options) -> PreslidingFit:
    from macromicro.identify import presliding_fit

    return presliding_fit.presliding_drive(
        *records.columns,
        along=options.along,
        gain=records.gain,
        limit=options.limit,
        delay=int(records.delay),
    )


def _sprung(records: Loaded, options: Options) -> SprungFit:
    from macromicro.identify.sprung_fit import sprung_drive

    late = records.delay
    lag = late if isinstance(late, str) else late * records.runs[0].dt

    def fitted(gain: float) -> SprungFit:
        return sprung_drive(
            records.runs,
            driven=not options.free,
            speed=records.speed,
            spring=options.spring,
            dead_zone=options.dead_zone,
            eccentric=options.eccentric,
            friction=options.structure,
            gain=gain,
            limit=options.limit,
            lag=lag,
        )

    return fitted(records.gain) if options.free else _check_sign(fitted, records)


def _check_sign(fitted: Callable[[float], SprungFit], records: Loaded) -> SprungFit:
    """A fit; refused where it fails and the input with its sign reversed explains the record."""
    extent = float(np.std(np.concatenate([r.x for r in records.runs])))
    found: SprungFit | Exception
    with warnings.catch_warnings(record=True) as doubts:
        warnings.simplefilter("always")
        try:
            found = fitted(records.gain)
        except _FAILURES as error:
            found = error
    missed = math.inf
    if isinstance(found, Exception) or found.rms >= _POOR * extent:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # they are about another input
            with suppress(*_FAILURES):
                missed = fitted(-records.gain).rms / extent
    if missed < _GOOD:  # the doubts are about the wrong input
        problem = f"its sign is opposite to the motion: reversed, it fits {1.0 - missed:.1%}"
        remedy = f"Reverse u, or give --gain {-records.gain:g}."
        raise ProblemError(f"{records.file}, u", problem, remedy)
    for doubt in doubts:
        warnings.warn(doubt.message, doubt.category, stacklevel=2)
    if isinstance(found, Exception):
        raise found
    return found


def _check(options: Options) -> None:
    from macromicro.identify.presliding import LUGRE

    if options.limit is not None and not options.limit > 0.0:
        raise InputError("--limit", options.limit, "a value above zero")
    if options.along is not None and options.structure != LUGRE:
        raise ProblemError("--along", "it needs elastic friction", f"Add --structure {LUGRE}.")
    if options.delay == FIT and options.structure == LUGRE:
        raise InputError("--delay", FIT, "a whole number of samples with elastic friction")
    for name in ("eccentric", "endless"):
        if getattr(options, name) and options.structure == LUGRE:
            raise ProblemError(
                f"--{name}", f"it cannot be combined with --structure {options.structure}"
            )


def _checked_output_error(picking: Picking, options: Options) -> None:
    if options.endless:
        raise ProblemError("--endless", f"it cannot be combined with {_OTHERS}")
    if options.free and options.limit is not None:
        raise ProblemError("--limit", "a free motion has no drive")
    whole = isinstance(options.delay, int) and options.delay >= 0
    if not (options.delay in (None, FIT) or whole) or (options.free and options.delay == FIT):
        accepted = "a whole number of samples from 0" + ("" if options.free else f', or "{FIT}"')
        raise InputError("--delay", options.delay, accepted)
    if options.free and U.name in picking.columns:
        problem = f"a column is named for {U.name}, but a free motion has no input"
        raise ProblemError("--free", problem, "Remove one of them.")


def in_speeds(picking: Picking, place: Role) -> bool:
    if V.name in picking.columns or place.name in picking.columns:
        return place.name not in picking.columns
    if is_forc(picking.files[0]):
        return False
    found = match_columns(read_table(picking.files[0]), (place, V))
    return V.name in found and place.name not in found


def _load(picking: Picking, options: Options, speed: bool, least: int) -> Loaded:
    out = V if speed else X
    roles = [T, *(() if options.free else (U,)), out, RUN]
    tables, others = _report.records(picking, roles, options.tests)
    first = tables[0]
    gain, gain_by = options.gain, "as given"
    if gain is None:
        name = next((n for n in GAINS if n in first.constants), "")
        gain, gain_by = first.constants.get(name, 1.0), f"{name} in the file"
    delay = options.delay
    if delay is None:
        delay = int(first.constants.get("delay", 0))
    unit = first.units[out.name]
    for name in ("eccentric", "endless"):
        if getattr(options, name) and (speed or unit != ANGLE.base):
            problem = f"the unit of {out.name} is {unit or 'unknown'}"
            remedy = "Name an angle in rad or deg, such as --columns x=angle:deg."
            raise ProblemError(f"--{name}", problem, remedy)
    shown = unit or ("x/s" if speed else "x")
    return Loaded(
        [run for table in tables for run in even_runs(table, out.name, least)],
        [(table.file, run) for table in others for run in even_runs(table, out.name, least)],
        first.file,
        gain,
        gain_by,
        delay,
        speed,
        shown,
        _PLACES.get(shown, "x") if speed else shown,
        first.units.get("u", "") or "u",
        tuple(n for n in ("u", "x") if not first.units.get(n, "")),
    )
