"""`identify linear`: a discrete linear model from an input to an output or a position."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify import _linear_hints, _report, clusters
from macromicro.identify._report import Curves, Pair
from macromicro.identify.kinds import model_file
from macromicro.identify.picking import RUN, Picked, Picking, Role, T, loaded, sampled
from macromicro.identify.records import fit_percent
from macromicro.identify.result import Line, Result, rounded
from macromicro.identify.runs import Run
from macromicro.units import quotient

if TYPE_CHECKING:
    from macromicro.identify._linear_hints import Asked
    from macromicro.identify.linear import Complex, LinearFit


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


class Options(NamedTuple):
    method: str = METHODS[0]  # one of `METHODS`
    order: str = "1,1"  # "na,nb" or "na,nb,delay"
    start: str = "rest"  # "rest" or "free"
    width: float = 0.0  # dead zone taken off the input's size, unit of u
    offset: float | None = None  # constant of the output, in its unit; None: found from the data
    tests: tuple[str, ...] = ()  # files with records that are not fitted


def identify(picking: Picking, options: Options) -> Result:
    import macromicro.identify as methods

    if options.method not in METHODS:
        raise InputError("--method", options.method, ", ".join(METHODS))
    if options.start not in STARTS:
        raise InputError("--start", options.start, "rest or free")
    na, nb, delay = order(options.order)
    tables = loaded(picking, ROLES)
    position = "y" not in tables[0].values
    others = _report.unseen(options.tests, picking, ROLES, tables[0])
    records, averaged = joined(measured(tables, options.width), position)
    dt = records[0].dt
    if any(abs(r.dt - dt) > 1e-3 * dt for r in records):
        found = f"the sample times are {sorted({round(r.dt, 9) for r in records})} s"
        raise ProblemError("records", found, "Give files with one sample time.")
    pairs = [methods.differentiated(r.u, r.x, dt) if position else (r.u, r.x) for r in records]
    u, y = [p[0] for p in pairs], [p[1] for p in pairs]
    offset = _offset(_linear_hints.Asked(u, y, na, nb, delay, dt, options.start), options, position)
    y = [one - offset for one in y]
    method = getattr(methods, options.method)
    fit: LinearFit = method(u, y, na, nb, dt, delay, start=options.start)
    out_unit = tables[0].units.get("y" if not position else "x", "") or "y"
    in_unit = tables[0].units["u"] or "u"
    place_unit, out_unit = out_unit, f"{out_unit}/s" if position else out_unit
    lines = coefficients(fit, out_unit, in_unit)
    _report.undetermined(lines, ("gain",))
    if offset:
        how = "as given" if options.offset is not None else "found with the parameters"
        lines.append(Line("offset", offset, unit=out_unit, note=f"constant of the output, {how}"))
    tests = [
        predicted(fit, run._replace(x=run.x - offset), table.file, position=position)
        for table in others
        for run in measured([table], options.width)
    ]
    remarks = _remarks(fit, sum(map(len, y)), options.start)
    remarks += better(_linear_hints.Asked(u, y, na, nb, delay, dt, options.start), in_unit)
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
    return _report.completed(parts, place_unit if position else out_unit, tests, curves)


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
        return 0.0 if position else _linear_hints.constant(asked)
    if not math.isfinite(options.offset):
        raise InputError("--offset", options.offset, "a finite number in the unit of the output")
    if position and options.offset:
        raise ProblemError(
            "--offset", "the output is the speed of a position, which has no constant"
        )
    return options.offset


def better(asked: Asked, unit: str) -> list[tuple[str, str]]:
    found = _linear_hints.hints(asked, unit)
    if not found:
        return []
    each = "; ".join(f"{hint.words}, by {100.0 * hint.lowered:.0f} %" for hint in found)
    return [("lower error on the last 30 %, by a fit to the rest", each)]


def predicted(fit: LinearFit, run: Run, file: str, *, position: bool) -> Pair:
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


def measured(tables: list[Picked], width: float) -> list[Run]:
    """All runs, evenly sampled, without the dead zone."""
    found = []
    for table in tables:
        if "y" not in table.values and "x" not in table.values:
            raise ProblemError(
                table.file,
                "there is neither an output y nor a position x",
                "Name a column with --columns y=COLUMN or x=COLUMN.",
            )
        role = "y" if "y" in table.values else "x"
        for run in sampled(table, role):
            less = np.sign(run.u) * np.maximum(np.abs(run.u) - width, 0.0)
            found.append(run._replace(u=less))
    return found


def joined(records: list[Run], position: bool) -> tuple[list[Run], list[str]]:
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


def _shown(fit: LinearFit, line: Line, slope: Array) -> Line:
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
    return _shown(fit, Line(name, size, unit="rad/s", note=note), by_size)


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
            _shown(fit, Line(name, float(pole.real), unit="rad/s", note=note), slopes[k].real)
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
