"""`identify linear`: a discrete linear model from an input to an output or a position."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify import _report, clusters, model_file
from macromicro.identify._linear import Start, free_runs, iterate, prepare_task
from macromicro.identify._report import Curves, Pair
from macromicro.identify.notices import DataWarning
from macromicro.identify.options import Linear as Options
from macromicro.identify.picking import RUN, Picked, Picking, Role, T, even_runs, load
from macromicro.identify.records import fit_percent
from macromicro.identify.result import Line, Result, rounded
from macromicro.identify.runs import Run
from macromicro.units import quotient

if TYPE_CHECKING:
    from macromicro.identify.linear import Complex, LinearFit


_TRAIN = 0.7  # of each record
_LESS = 0.1  # by which part the error of the last part must be lower
_MOST = 50_000  # samples that are looked at, the first ones of each record
_DELAYS = 50  # samples, at most
_EXACT = 1e-9  # of the output: no more than rounding is left
_FINE = 1e-4  # of the output's range: the search for a constant ends there
_PARTS = np.arange(0.05, 0.96, 0.05)  # of the largest input: dead zones and limits tried


class Asked(NamedTuple):
    # u, y: inputs and outputs, shape (n,) per record
    u: Sequence[Array]
    y: Sequence[Array]
    # na, nb, delay: orders of the model
    na: int
    nb: int
    delay: int
    dt: float  # sample time, s
    start: str = "rest"  # "rest" or "free"


# Hints, and the constant of the output: each model is fitted to the first part of every record and
# judged by a free simulation of the last part.


class Hint(NamedTuple):
    lowered: float  # relative reduction of the error
    words: str  # the model, and how to ask for it


def hints(asked: Asked, unit: str = "") -> list[Hint]:
    """Models that predict the last 30 % of the records better by a tenth or more."""
    asked = _short(asked)
    own = _free_run_error(asked)
    if not np.isfinite(own) or own <= _EXACT * _rms(list(asked.y)):
        return []
    found = []
    for tried, words in _others(asked, unit):
        lowered = 1.0 - _free_run_error(tried) / own
        if lowered >= _LESS:
            found.append(Hint(lowered, words))
    return sorted(found, reverse=True)


def _short(asked: Asked) -> Asked:
    most = _MOST // len(asked.u)
    return asked._replace(u=[u[:most] for u in asked.u], y=[y[:most] for y in asked.y])


def _others(asked: Asked, unit: str) -> Iterator[tuple[Asked, str]]:
    """The best of each kind on the first part, in words."""
    na, nb, delay = asked.na, asked.nb, asked.delay
    most = min(_DELAYS, min(len(u) for u in asked.u) // 20)
    late = [asked._replace(delay=k) for k in range(most + 1) if k != delay]
    best = min(late, key=_residual)
    yield best, f"a delay of {best.delay} (--order {na},{nb},{best.delay})"
    higher = asked._replace(na=na + 1, nb=nb + 1)
    yield higher, f"an order of {na + 1} (--order {na + 1},{nb + 1},{delay})"
    size = max(float(np.abs(u).max()) for u in asked.u)
    dead = {p * size: _limit_input(asked, low=p * size) for p in _PARTS}
    width = min(dead, key=lambda at: _residual(dead[at]))
    yield dead[width], f"a dead zone of {width:.2g} {unit}".rstrip() + f" (--width {width:.2g})"
    cut = {p * size: _limit_input(asked, high=p * size) for p in _PARTS}
    limit = min(cut, key=lambda at: _residual(cut[at]))
    yield cut[limit], f"an input that acts up to {limit:.2g} {unit} only".replace("  ", " ")


def _limit_input(asked: Asked, low: float = 0.0, high: float = np.inf) -> Asked:
    """The input beyond a dead zone and within a limit."""
    inputs = [np.sign(u) * np.minimum(np.maximum(np.abs(u) - low, 0.0), high) for u in asked.u]
    return asked._replace(u=inputs)


def constant(asked: Asked) -> float:
    """Constant of the output that lowers the error by a tenth or more, else 0."""
    from scipy.optimize import minimize_scalar

    asked = _short(asked)
    own = _free_run_error(asked)
    if own <= _EXACT * _rms(list(asked.y)):
        return 0.0

    def less(c: float) -> Asked:
        return asked._replace(y=[y - c for y in asked.y])

    rest = float(np.mean([y[0] for y in asked.y]))  # records often begin at rest
    extent = max(float(np.ptp(y)) for y in asked.y)
    found = minimize_scalar(
        lambda c: _residual(less(c)),
        bounds=(rest - extent, rest + extent),
        method="bounded",
        options={"xatol": _FINE * extent},
    )
    best = min((rest, float(found.x)), key=lambda c: _residual(less(c)))
    return best if _free_run_error(less(best)) <= (1.0 - _LESS) * own else 0.0


def _lead(record: Array) -> int:
    return round(_TRAIN * len(record))


def _errors(asked: Asked) -> list[Array]:
    """Errors over whole records by `mls` of their first parts; none if it fails."""
    u, y = ([part[: _lead(part)] for part in each] for each in (asked.u, asked.y))
    how = asked.na, asked.nb, asked.dt, asked.delay
    start = cast(Start, asked.start)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DataWarning)  # they are about an input that was cut here
        try:
            theta = iterate(prepare_task(u, y, *how, start=start), instruments=False).theta
            whole = prepare_task(asked.u, asked.y, *how, start=start)
        except InputError:
            return []
    with np.errstate(over="ignore", invalid="ignore"):
        return [b - run for b, run in zip(asked.y, free_runs(whole, theta), strict=True)]


def _rms(errors: list[Array]) -> float:
    every = np.concatenate(errors) if errors else np.full(1, np.inf)
    with np.errstate(over="ignore", invalid="ignore"):
        found = float(np.sqrt(np.mean(every**2)))
    return found if np.isfinite(found) else float("inf")


def _residual(asked: Asked) -> float:
    return _rms([e[: _lead(e)] for e in _errors(asked)])


def _free_run_error(asked: Asked) -> float:
    return _rms([e[_lead(e) :] for e in _errors(asked)])


U = Role("u", "input", ("u", "U", "motor", "voltage", "volts", "input", "force", "vir", "ctrl"))
Y = Role("y", "output", ("y", "Y", "speed", "velocity", "output"), optional=True)
X = Role(
    "x",
    "position, to be differentiated",
    ("x", "X", "macro_position", "position", "pos", "qm", "q"),
    optional=True,
)
ROLES = (T, U, Y, X, RUN)
METHODS = ("output_error", "box_jenkins", "mls", "sriv", "gls", "least_squares")
STARTS = ("rest", "free")


def identify(picking: Picking, options: Options) -> Result:
    import macromicro.identify as methods

    if options.method not in METHODS:
        raise InputError("--method", options.method, ", ".join(METHODS))
    if options.start not in STARTS:
        raise InputError("--start", options.start, "rest or free")
    na, nb, delay = order(options.order)
    tables = load(picking, ROLES)
    position = "y" not in tables[0].values
    others = _report.unseen(options.tests, picking, ROLES, tables[0])
    records, averaged = average_positions(sampled_runs(tables, options.width), position)
    dt = records[0].dt
    if any(abs(r.dt - dt) > 1e-3 * dt for r in records):
        found = f"the sample times are {sorted({round(r.dt, 9) for r in records})} s"
        raise ProblemError("records", found, "Give files with one sample time.")
    pairs = [methods.differentiated(r.u, r.x, dt) if position else (r.u, r.x) for r in records]
    u, y = [p[0] for p in pairs], [p[1] for p in pairs]
    asked = Asked(u, y, na, nb, delay, dt, options.start)
    offset = _offset(asked, options, position)
    y = [one - offset for one in y]
    method = getattr(methods, options.method)
    fit: LinearFit = method(u, y, na, nb, dt, delay, start=options.start)
    out_unit = tables[0].units.get("y" if not position else "x", "") or "y"
    in_unit = tables[0].units["u"] or "u"
    place_unit, out_unit = out_unit, f"{out_unit}/s" if position else out_unit
    lines = coefficients(fit, out_unit, in_unit)
    _report.warn_of_undetermined(lines, ("gain",))
    if offset:
        how = "as given" if options.offset is not None else "found with the parameters"
        lines.append(Line("offset", offset, unit=out_unit, note=f"constant of the output, {how}"))
    tests = [
        predict(fit, run._replace(x=run.x - offset), table.file, position=position)
        for table in others
        for run in sampled_runs([table], options.width)
    ]
    remarks = _remarks(fit, sum(map(len, y)), options.start)
    remarks += better(asked._replace(y=y), in_unit)
    if position:
        remarks.append(("output", f"speed: the position differentiated; {_travel(fit, y)}"))
    remarks += [("records", text) for text in averaged]
    if options.width:
        remarks.append(("dead zone", f"{options.width:g} {in_unit} subtracted from the input"))

    def curves() -> Curves:
        times = [np.arange(len(one), dtype=np.float64) * dt for one in y]
        label = f"output [{out_unit}]"
        if not position:
            return Curves(_report.pairs(times, y, fit.free_run), label, dt, fit.residuals)
        travel, free = ([np.cumsum(one) * dt for one in each] for each in (y, fit.free_run))
        name = f"position from the start [{place_unit}]"
        return Curves(_report.pairs(times, travel, free), name, dt, fit.residuals, label)

    title = "y = (b1 z^-1 + b2 z^-2 + ...) / (1 + a1 z^-1 + ...) u"
    title += f", {delay - 1} samples later" if delay > 1 else ""
    toml = coefficients_toml(fit, in_unit, out_unit)
    parts = Result("linear", title, fit, lines, remarks, toml, dict, data(fit))
    return _report.complete(parts, place_unit if position else out_unit, tests, curves)


def _remarks(fit: LinearFit, samples: int, start: str) -> list[tuple[str, str]]:
    white = fit.whiteness
    found = [
        ("fit", f"free run {fit.fit:.2f} %, {samples} samples of {fit.dt:g} s"),
        ("residuals", f"{'white' if white.white else 'not white'} (p = {white.p_value:.2g})"),
        ("method", f"{fit.method}, {fit.iterations} iterations, start at {start}"),
    ]
    found += [("errors uncertain", fit.doubt)] if fit.doubt else []
    if fit.starts:
        ends = ", ".join(f"{name} {end:.2f} %" for name, end in fit.starts.items())
        found.append(("ends of the search, by starting point", f"{ends}; the best is taken"))
    return found


def _offset(asked: Asked, options: Options, position: bool) -> float:
    if options.offset is None:
        return 0.0 if position else constant(asked)
    if not math.isfinite(options.offset):
        raise InputError("--offset", options.offset, "a finite number in the unit of the output")
    if position and options.offset:
        raise ProblemError(
            "--offset", "the output is the speed of a position, which has no constant"
        )
    return options.offset


def better(asked: Asked, unit: str) -> list[tuple[str, str]]:
    found = hints(asked, unit)
    if not found:
        return []
    each = "; ".join(f"{hint.words}, by {100.0 * hint.lowered:.0f} %" for hint in found)
    return [("lower error on the last 30 %, by a fit to the rest", each)]


def predict(fit: LinearFit, run: Run, file: str, *, position: bool) -> Pair:
    """A free simulation from rest over a validation record."""
    from macromicro.identify import differentiated

    if abs(run.dt - fit.dt) > 1e-3 * fit.dt:
        found = f"the sample time is {run.dt:.6g} s, that of the fit {fit.dt:.6g} s"
        raise ProblemError(file, found, "Give a test with the fit's.")
    if not position:
        return Pair(file, run.t, run.x, fit.simulate(run.u))
    u, y = differentiated(run.u, run.x, fit.dt)
    seen, made = (np.cumsum(each) * fit.dt for each in (y, fit.simulate(u)))
    return Pair(file, run.t[1:], seen, made)


def _travel(fit: LinearFit, y: list[Array]) -> str:
    travel, free = ([np.cumsum(one) for one in each] for each in (y, fit.free_run))
    return f"its own fit {fit_percent(travel, free):.2f} %"


def order(text: str) -> tuple[int, int, int]:
    parts = text.split(",")
    try:
        numbers = [int(part) for part in parts]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3):
        raise InputError("--order", text, "na,nb or na,nb,delay, such as 1,1")
    return (numbers[0], numbers[1], numbers[2] if len(numbers) == 3 else 1)


def sampled_runs(tables: list[Picked], width: float) -> list[Run]:
    """All runs, evenly sampled, without the dead zone."""
    found = []
    for table in tables:
        if "y" not in table.values and "x" not in table.values:
            remedy = "Name a column with --columns y=COLUMN or x=COLUMN."
            raise ProblemError(table.file, "there is neither an output y nor a position x", remedy)
        role = "y" if "y" in table.values else "x"
        for run in even_runs(table, role):
            less = np.sign(run.u) * np.maximum(np.abs(run.u) - width, 0.0)
            found.append(run._replace(u=less))
    return found


def average_positions(records: list[Run], position: bool) -> tuple[list[Run], list[str]]:
    """Positions under equal inputs averaged, and a note of what was done."""
    from macromicro.identify import average_runs

    if not position or len(records) < 2:
        return records, [] if len(records) < 2 else [f"{len(records)}, fitted together"]
    groups: list[list[Run]] = []
    for run in records:
        for group in groups:
            first = group[0]
            if len(first.u) == len(run.u) and np.allclose(np.abs(first.u), np.abs(run.u)):
                group.append(run)
                break
        else:
            groups.append([run])
    made, said = [], []
    for group in groups:
        u, x = average_runs([(r.u, r.x) for r in group])
        made.append(Run(group[0].t, u, x))
        said.append(f"{len(group)} with the same input")
    return made, [", ".join(said) + ", averaged" if len(made) < len(records) else "fitted together"]


def _with_error(fit: LinearFit, line: Line, slope: Array) -> Line:
    """A line with the error of a function of a and b, to first order."""
    error = float(clusters.errors(fit.covariance, slope[None])[0])
    return line._replace(error=error, factor=float(fit.spread.factors(slope[None])[1, 0]))


def _pair(fit: LinearFit, name: str, pole: complex, slope: Complex) -> Line:
    """Frequency and damping of a pair of poles, |s| and -Re s / |s|, with their errors."""
    size = abs(pole)
    by_size = (pole.conjugate() * slope).real / size
    damping = -pole.real / size
    error = float(
        clusters.errors(fit.covariance, (-(slope.real + damping * by_size) / size)[None])[0]
    )
    value, spread = rounded(damping, error) if math.isfinite(error) else (f"{damping:.3g}", "")
    note = f"a pair, damping {value}" + (spread and f" +- {spread}")
    return _with_error(fit, Line(name, size, unit="rad/s", note=note), by_size)


def coefficients(fit: LinearFit, out_unit: str, in_unit: str) -> list[Line]:
    slope = quotient(out_unit, in_unit)
    names = [f"a{k + 1}" for k in range(len(fit.a))] + [f"b{k + 1}" for k in range(len(fit.b))]
    units = [""] * len(fit.a) + [slope] * len(fit.b)
    factors = fit.factors[1].tolist()
    each = zip(names, np.r_[fit.a, fit.b].tolist(), fit.std.tolist(), units, factors, strict=True)
    lines = [Line(name, v, s, unit, factor=by) for name, v, s, unit, by in each]
    by = float(fit.gain_factors[1])
    lines.append(Line("gain", fit.gain, fit.gain_std, slope, "at standstill", by))
    slopes = fit.pole_slopes
    for k, pole in enumerate(fit.continuous_poles):
        name = f"pole {k + 1}" if len(fit.a) > 1 else "pole"
        if abs(pole.imag) > 1e-9 * abs(pole):
            if pole.imag > 0.0:
                lines.append(_pair(fit, name, complex(pole), slopes[k]))
            continue
        note = f"time constant {-1.0 / pole.real:.4g} s" if pole.real < 0.0 else "unstable"
        lines.append(
            _with_error(fit, Line(name, float(pole.real), unit="rad/s", note=note), slopes[k].real)
        )
    return lines


def data(fit: LinearFit) -> dict[str, Any]:
    return {
        "a": fit.a,
        "b": fit.b,
        "covariance": fit.covariance,
        "dt": fit.dt,
        "delay": fit.delay,
        "gain": fit.gain,
        "fit_percent": fit.fit,
        "white": fit.whiteness.white,
        "p_value": fit.whiteness.p_value,
        "converged": fit.converged,
        "starts": fit.starts,
        "doubt": fit.doubt,
    }


def coefficients_toml(fit: LinearFit, in_unit: str, out_unit: str) -> str:
    head = "A linear model y = (b1 z^-1 + ...) / (1 + a1 z^-1 + ...) u, for other programs.\n"
    head += "Not for `macromicro run --config`: the bench is not a linear model."
    values: dict[str, tuple[model_file.Value, str]] = {
        "a": (fit.a.tolist(), "without the leading 1"),
        "b": (fit.b.tolist(), f"{out_unit} per {in_unit}"),
        "delay": (fit.delay, "samples from u to y"),
        "dt": (fit.dt, "s"),
        "method": (fit.method, f"free-run fit {fit.fit:.2f} %"),
    }
    return model_file.plain(head, {"linear": values})
