"""`identify drive` with a spring, a dead zone, a measured speed, or no drive."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.errors import InputError, ProblemError
from macromicro.files.reading import is_forc, read
from macromicro.identify import _report, eccentric
from macromicro.identify._report import Curves, Pair
from macromicro.identify.axis_inverse import ECCENTRIC
from macromicro.identify.kinds import drive_words, model_file
from macromicro.identify.kinds.loading import Picking, loaded
from macromicro.identify.picking import Picked, Role, matched, railed, runs
from macromicro.identify.records import fit_percent
from macromicro.identify.result import Line, Result
from macromicro.identify.runs import Run, checked
from macromicro.place import ANGLE

if TYPE_CHECKING:
    from macromicro.identify.sprung_fit import SprungFit

V = Role(
    "v",
    "speed",
    ("speed", "velocity", "rate", "omega", "qd", "dq", "dx"),
    ("m/s", "rad/s", "counts/s"),
)
_LEAST = 50
# Misfits that ask for another sign, and that answer it, by the scatter of the record.
_POOR, _GOOD = 0.5, 0.2
_DIVERGED = 10.0  # times the record's range: an error that is no figure any more
_FAILURES = (InputError, ArithmeticError, ValueError, np.linalg.LinAlgError)
_PLACES = {unit: unit.removesuffix("/s") for unit in V.units}
_MEANINGS = {
    "mass": "inertia",
    "viscous": "viscous friction",
    "coulomb": "Coulomb friction",
    "asymmetry": "viscous, excess of forwards over backwards",
    "offset": "constant force",
    "spring": "stiffness",
    "dead_zone": "input below which the drive gives no force",
    "frequency": "undamped, of mass and spring",
    "damping": "relative to critical damping",
    "rest": "rest position of the spring",
    "delay": "of the force",
    **{n: drive_words.MEANINGS[n] for n in ("stribeck", "stribeck_speed", "unbalance", "hangs")},
}


class Asked(NamedTuple):
    gain: float | None  # force per unit of u; None: as the file says, else 1
    structure: str  # friction, or "auto"
    # samples by which u acts late, or "fit"; None: as the file says, else 0
    delay: int | str | None
    tests: tuple[str, ...]  # files with records that are not fitted
    spring: bool
    dead_zone: bool  # of the drive
    free: bool  # no drive
    eccentric: bool = False  # gravity on a rotating load
    limit: float | None = None  # u saturates there


def in_speeds(what: Picking, place: Role) -> bool:
    if V.name in what.columns or place.name in what.columns:
        return place.name not in what.columns
    if is_forc(what.files[0]):
        return False
    found = matched(read(what.files[0]), (place, V))
    return V.name in found and place.name not in found


def identify(what: Picking, roles: tuple[Role, Role, Role], asked: Asked, gains: Any) -> Result:
    from macromicro.identify.picking import RUN
    from macromicro.identify.sprung_fit import same, sprung_drive

    time, force, place = roles
    speed = in_speeds(what, place)
    if asked.free and force.name in what.columns:
        raise ProblemError(
            "--free",
            f"a column is named for {force.name}, but a free motion has no input",
            "Remove one of them.",
        )
    wanted = [time, *(() if asked.free else (force,)), V if speed else place, RUN]
    tables = loaded(what, wanted)
    others = _report.unseen(asked.tests, what, wanted, tables[0])
    out = V.name if speed else place.name
    records = [run for table in tables for run in _measured(table, out)]
    first = tables[0]
    gain = asked.gain
    if gain is None:
        gain = next((first.constants[n] for n in gains if n in first.constants), 1.0)
    delay = int(first.constants.get("delay", 0)) if asked.delay is None else asked.delay
    if asked.eccentric and (speed or first.units[out] != ANGLE.base):
        raise ProblemError(
            "--eccentric",
            f"the unit of {out} is {first.units[out] or 'unknown'}",
            "Name an angle in rad or deg, such as --columns x=angle:deg.",
        )
    extent = float(np.std(np.concatenate([r.x for r in records])))

    def fitted(gain: float) -> SprungFit:
        return sprung_drive(
            records,
            driven=not asked.free,
            speed=speed,
            spring=asked.spring,
            dead_zone=asked.dead_zone,
            eccentric=asked.eccentric,
            friction=asked.structure,
            gain=gain,
            limit=asked.limit,
            lag=delay if isinstance(delay, str) else delay * records[0].dt,
        )

    fit = fitted(gain) if asked.free else _signed(fitted, gain, extent, first.file)
    shown = first.units[out] or ("x/s" if speed else "x")
    unit = _PLACES.get(shown, "x") if speed else shown
    u = first.units.get("u", "") or "u"
    units = _units(unit, drive_words.newton(unit) if abs(gain) != 1.0 else u, u, not asked.free)
    lines = _lines(fit, units)
    _report.undetermined(lines, drive_words.ABOVE_ZERO)
    trials = [_tried(fit, run, table.file) for table in others for run in _measured(table, out)]
    samples = sum(len(r.t) for r in records)
    percent = fit_percent([r.x for r in records], fit.free_run)
    remarks = [
        ("fit", f"free run {percent:.2f} %, RMS {fit.rms:.4g} {shown} over {samples} samples"),
        ("structure", _chosen(fit, shown)),
        ("searches", f"{same(fit.ends)} of {len(fit.ends)} end there; RMS {_ends(fit)} {shown}"),
        ("starts", "position and speed at the start of each record are fitted too"),
    ]
    if "offset" in fit.names:
        remarks.append(drive_words.slow("rest" if fit.load.spring else "offset"))
    remarks += drive_words.repeated(fit.repeats, units["coulomb"], shown)
    remarks += drive_words.late(delay)
    if asked.free:
        remarks.append(("free motion", "without a drive, forces are per mass"))
    data = {
        "structure": fit.friction,
        "spring": fit.load.spring,
        "dead_zone": fit.load.dead_zone,
        "rms": fit.rms,
        "fit_percent": percent,
        "gain": gain,
        "delay": delay,
        "lag": fit.axis.lag,
        "holdout": fit.holdout,
        "reasons": fit.reasons,
        "searches": fit.ends,
        "starts": fit.starts,
    }

    def curves() -> Curves:
        label = f"{'speed' if speed else 'position'} [{shown}]"
        t, x = [r.t for r in records], [r.x for r in records]
        return Curves(_report.pairs(t, x, fit.free_run), label, records[0].dt, fit.residuals)

    title = "M dv/dt = D(gain u) - k x - (Fv +- Fa) v -+ (Fc + Fs exp(-(v/vs)^2)) - F0"
    title += " - unbalance sin(x - hangs)" if asked.eccentric else ""
    parts = Result("drive", title, fit.axis, lines, remarks, _toml(lines, asked), dict, data)
    return _report.completed(parts, shown, trials, curves)


def _signed(
    fitted: Callable[[float], SprungFit], gain: float, extent: float, file: str
) -> SprungFit:
    """A fit; refused where it fails and the input with its sign reversed explains the record."""
    found: SprungFit | Exception
    with warnings.catch_warnings(record=True) as doubts:
        warnings.simplefilter("always")
        try:
            found = fitted(gain)
        except _FAILURES as error:
            found = error
    missed = math.inf
    if isinstance(found, Exception) or found.rms >= _POOR * extent:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # they are about another input
            with suppress(*_FAILURES):
                missed = fitted(-gain).rms / extent
    if missed < _GOOD:  # the doubts are about the wrong input
        problem = f"its sign is opposite to the motion: reversed, it fits {1.0 - missed:.1%}"
        raise ProblemError(f"{file}, u", problem, f"Reverse u, or give --gain {-gain:g}.")
    for doubt in doubts:
        warnings.warn(doubt.message, doubt.category, stacklevel=2)
    if isinstance(found, Exception):
        raise found
    return found


def _measured(table: Picked, out: str) -> list[Run]:
    found = []
    for part in runs(table):
        railed(part[out], f"{table.file}, {out}")
        u = part.get("u", np.zeros(len(part["t"])))
        found.append(checked(part["t"], u, part[out], table.file, _LEAST))
    return found


def _units(place: str, force: str, u: str, driven: bool) -> dict[str, str]:
    """Units of the parameters; of a free motion per mass."""
    shared = {"stribeck_speed": f"{place}/s", "hangs": place, "delay": "s"}
    shared |= {"rest": place, "frequency": "Hz"}
    if not driven:
        return shared | {
            "viscous": "1/s",
            "asymmetry": "1/s",
            "coulomb": f"{place}/s^2",
            "stribeck": f"{place}/s^2",
            "unbalance": f"{place}/s^2",
            "offset": f"{place}/s^2",
            "spring": "1/s^2",
        }
    kilogram = {("N", "m"): "kg", ("N", "rad"): "kg*m^2"}
    return shared | {
        "mass": kilogram.get((force, place), f"{force}*s^2/{place}"),
        "viscous": f"{force}*s/{place}",
        "asymmetry": f"{force}*s/{place}",
        "coulomb": force,
        "stribeck": force,
        "unbalance": force,
        "offset": force,
        "spring": f"{force}/{place}",
        "dead_zone": u,
    }


def _lines(fit: SprungFit, units: dict[str, str]) -> list[Line]:
    """The parameters and results from mass and spring."""
    lines = []
    if fit.load.spring:
        for name in ("frequency", "damping"):
            value, error, (_, factor) = fit.derived(name)
            lines.append(Line(name, value, error, units.get(name, ""), _MEANINGS[name], factor))
    every = zip(fit.names, fit.values, fit.std, fit.factors[1], strict=True)
    for name, value, error, factor in every:
        if name in ECCENTRIC:
            continue
        if name == "offset" and fit.load.spring:
            lines.append(_rest(fit, units["rest"]))
            continue
        size = fit.gain if name == "dead_zone" else 1.0
        own = "delay" if name == "lag" else name
        meant = units[own], _MEANINGS[own]
        lines.append(Line(own, value / size, error / abs(size), *meant, float(factor)))
    values, errors = eccentric.told(fit)
    factors = fit.spread.factors(eccentric.slopes(fit))[1]
    loads = zip(eccentric.NAMES, values, errors, factors, strict=False)
    for name, value, error, factor in loads:
        lines.append(Line(name, value, error, units[name], _MEANINGS[name], float(factor)))
    return lines


def _rest(fit: SprungFit, unit: str) -> Line:
    k, f0 = fit.axis.spring, fit.axis.offset
    slopes = np.zeros((1, len(fit.names)))
    slopes[0, [fit.names.index("offset"), fit.names.index("spring")]] = [-1.0 / k, f0 / (k * k)]
    error, factors = fit.combined(slopes)
    return Line("rest", -f0 / k, error, unit, _MEANINGS["rest"], float(factors[1]))


def _chosen(fit: SprungFit, unit: str) -> str:
    if not fit.holdout:
        return f"{fit.friction}, as given"
    told = []
    extent = max(
        float(np.ptp(free + left)) for free, left in zip(fit.free_run, fit.residuals, strict=True)
    )
    for name, error in fit.holdout.items():
        if error > _DIVERGED * extent:
            told.append(f"{name} diverges")
        else:
            why = "taken" if name == fit.friction else fit.reasons[name]
            told.append(f"{name} {error:.4g}, {why}")
    return f"RMS on pieces held out in turn, in {unit}: " + "; ".join(told)


def _ends(fit: SprungFit) -> str:
    if len(fit.ends) == 1:
        return f"{fit.ends[0]:.4g}"
    return f"{fit.ends[0]:.4g} to {fit.ends[-1]:.4g}"


def _tried(fit: SprungFit, run: Run, file: str) -> Pair:
    """A free simulation over a test record, its initial state fitted."""
    from macromicro.identify.sprung_fit import started

    x, v = started(fit, run)
    return Pair(file, run.t, run.x, fit.simulate(run.u, run.dt, x, v))


def _toml(lines: list[Line], asked: Asked) -> str:
    head = "A drive with a spring, a dead zone or none: parameters by output error, for other\n"
    head += "programs. Not for `macromicro run --config`: no machine of the package is like it."
    return model_file.plain(head, {"free" if asked.free else "drive": _report.notes(lines)})
