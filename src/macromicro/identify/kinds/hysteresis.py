"""`identify hysteresis`: a table of first-order curves, the Preisach model (2.11)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.files.reading import is_forc, read_table
from macromicro.hysteresis import FodTable, Preisach, congruency, wiping_out
from macromicro.hysteresis.curves import Kind, direction
from macromicro.hysteresis.shape import ROUGH, ROUNDS
from macromicro.hysteresis.table import BETWEENS, SHAPES
from macromicro.identify import _report, model_file
from macromicro.identify._report import Pair as Prediction
from macromicro.identify.kiln import window_means
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.options import Hysteresis as Options
from macromicro.identify.picking import (
    Picked,
    Picking,
    Role,
    alike,
    find_saturated,
    load,
    pick,
    there,
)
from macromicro.identify.picking import T as TIME
from macromicro.identify.result import Line, Result
from macromicro.schema.text import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure


T = TIME._replace(optional=True)
U = Role(
    "u",
    "input",
    ("u", "U", "thermocouple", "field", "h", "H", "input", "temperature", "T", "voltage"),
)
F = Role(
    "f", "output", ("f", "moment", "m", "M", "output", "position", "x", "X", "y", "Y", "laser")
)
CURVE = Role("curve", "which curve a row belongs to", ("curve", "curves"), optional=True)
ROLES = (T, U, F, CURVE)
TABLE, SHEET = "table.h5", "table.csv"
_FEWEST = 6  # curves from which on every second one is held out
_SHOWN = 5
AUTO = "auto"
_TRIED = (0.5, 1.0, 2.0, 4.0, 8.0)  # grid steps
Choice = tuple[float, str]  # smoothness in grid steps, and how tables go on between curves
_FOLDS = 3
_ENOUGH = 2 + 2 * _FOLDS  # curves by which something is chosen: the outer ones, two in each fold
Pair = tuple[Array, Array]
_NEAR = 0.1  # a cycle begins within this part of the range from an end of it
_BACK = 0.5  # of its range: what ends nearer to its begin is a cycle
_LEG = 0.03  # what turns by less than this part of the range is noise; of the output, too
_WINDOWS = 300  # points of a curve over the whole range


class Errors(NamedTuple):
    """Errors of a table from every second curve on the others."""

    rms: float  # unit of the output
    largest: float  # unit of the output
    # input, output, and predicted output of each, shape (m,)
    curves: list[tuple[Array, Array, Array]]


def identify(picking: Picking, options: Options) -> Result:
    _check(options)
    if (saved := _saved_table(picking)) is not None:
        return _of_saved(saved, picking, options)
    _report.refuse_fitted(options.tests, picking)
    found, units = _find_curves(picking, options)
    pairs = sorted(found.curves, key=lambda pair: float(pair[0][0]))
    ends = np.concatenate([u[np.isfinite(u)] for u, _ in pairs])
    limits = (float(ends.min()), float(ends.max()))
    starts = np.array([u[np.isfinite(u)][:1].sum() for u, _ in pairs])
    if float(np.ptp(starts)) < 0.05 * (limits[1] - limits[0]):
        raise ProblemError(
            printable(picking.files[0], 300),
            f"all {len(pairs)} curves reverse at {starts[0]:.4g}: they show the major loop only",
            "Record reversals over most of the input's range, or use `identify plays`.",
        )
    make = _Maker(found, options, limits)
    tried = held_out_errors(make, pairs) if make.open else {}
    if tried:
        make.choice = min(tried, key=lambda choice: tried[choice])
    f_unit, u_unit = units["f"], units["u"]
    table = replace(make(pairs), input_unit=u_unit, output_unit=f_unit)
    extent = abs(table.span)
    own = table.misfit()
    held = _held_out(lambda some: make(some, _best(make, some)), pairs)
    top = table.f_low + table.span
    lines = [
        Line("input, from", table.lo, unit=u_unit),
        Line("input, to", table.hi, unit=u_unit),
        _output("output, low", table.f_low, own.rms, f_unit, "in negative saturation"),
        _output("output, high", top, own.rms, f_unit, "in positive saturation"),
        Line("misfit", 100.0 * own.rms / extent, unit="% of range", note="of its own curves, RMS"),
    ]
    if held is not None:
        note = "RMS on every second curve, by a table from the others"
        lines.append(Line("prediction", 100.0 * held.rms / extent, unit="% of range", note=note))
    share = round(100.0 * table.negative_share, 6)
    lines.append(Line("negative weight", share, unit="%", note="of the relays; ideally 0"))
    lines += _broken(found)
    how = f"smoothed over {table.smooth:g} steps, between curves along the {table.between}"
    remarks = [
        ("curves", f"{len(table.raw)} {table.kind}, {sum(len(u) for u, _ in pairs)} points"),
        ("table", f"{table.n} by {table.n}, density {table.shape}, {how}"),
        ("misfit", "RMS over the curves"),
    ]
    if tried:
        for way in dict.fromkeys(way for _, way in tried):
            errors = [(k, v) for (k, other), v in tried.items() if other == way]
            told = ", ".join(f"{k:g} {100.0 * v / extent:.3g}" for k, v in errors)
            head = "RMS on curves held out, % of range, by grid steps"
            remarks.append((f"along the {way}", f"{head}: {told}"))

    def draw() -> dict[str, Figure]:
        from macromicro.hysteresis.pictures import draw_curves, draw_density
        from macromicro.identify.kinds import pictures

        curves, density = draw_curves(table, u_unit, f_unit), draw_density(table, u_unit)
        drawn = {"curves": curves, "density": density}
        if held is not None:
            some = held.curves[:: max(1, math.ceil(len(held.curves) / _SHOWN))]
            left = [(f"from {u[0]:.4g}", u, f - model, ".-") for u, f, model in some]
            name, x, y = "held-out curves", f"input [{u_unit}]", f"output [{f_unit}]"
            drawn["residuals"] = pictures.points(f"{name}: measured less predicted", x, y, left)
        return drawn

    data = {
        "nodes": table.n, "kind": table.kind, "curves": len(table.raw),
        "misfit": own._asdict(), "holdout_rms": math.nan if held is None else held.rms,
        "range": extent, "negative_share": table.negative_share,
    }  # fmt: skip
    title = "First-order curves: f = f_M,m for every maximum M and minimum m of the input"
    parts = Result("hysteresis", title, table, lines, remarks, _toml(table), draw, data)
    return _with_tests(parts, picking, options, units)


def _toml(table: FodTable) -> str:
    head = "No setting of `macromicro run --config` holds a table of first-order curves.\n"
    head += "Read it with macromicro.hysteresis.table_files.load_table, or the CSV with anything."
    values: dict[str, tuple[model_file.Value, str]] = {
        "table": (TABLE, "exact, with the measured curves"),
        "kind": (table.kind, f"{len(table.raw)} curves"),
        "input": ([table.lo, table.hi], table.input_unit or "unit of the input"),
        "output": (
            [table.f_low, table.f_low + table.span],
            table.output_unit or "unit of the output",
        ),
    }
    return model_file.plain(head, {"hysteresis": values})


def _output(name: str, value: float, rms: float, unit: str, note: str) -> Line:
    return Line(name, value, unit=unit, note=note, extra=rms, extra_name="misfit")


def _saved_table(picking: Picking) -> FodTable | None:
    """The table in a file of `identify hysteresis`, if a single one is given."""
    from macromicro.hysteresis.table_files import is_table, load_table

    files = picking.files
    return load_table(files[0]) if len(files) == 1 and is_table(files[0]) else None


def _of_saved(table: FodTable, picking: Picking, options: Options) -> Result:
    """Predictions of a table that was saved, without a fit."""
    where = printable(picking.files[0], 300)
    if not options.tests:
        remedy = "Name a recording to predict: --test FILE."
        raise ProblemError(where, "the file holds a table, not a recording", remedy)
    u, f = table.input_unit, table.output_unit
    lines = [
        Line("input, from", table.lo, unit=u, note="of the table"),
        Line("input, to", table.hi, unit=u, note="of the table"),
        Line("output, low", table.f_low, unit=f, note="in negative saturation"),
        Line("output, high", table.f_low + table.span, unit=f, note="in positive saturation"),
    ]
    remarks = [("table", f"{table.n} by {table.n}, read from {where}")]

    def draw() -> dict[str, Figure]:
        from macromicro.hysteresis.pictures import draw_curves

        return {"curves": draw_curves(table, u, f)}

    data = {"nodes": table.n, "kind": table.kind, "range": abs(table.span)}
    title = "First-order curves of a saved table: predictions"
    toml = model_file.plain("A table that was read; see the folder it is from.", {})
    parts = Result("hysteresis", title, table, lines, remarks, toml, draw, data)
    known = {name: unit for name, unit in (("u", u), ("f", f)) if unit}
    return _with_tests(parts, picking, options, known)


def _with_tests(
    result: Result, picking: Picking, options: Options, units: dict[str, str]
) -> Result:
    """A table's result with its files and predictions of test recordings."""
    from macromicro.hysteresis.table_files import save_table

    table = result.model
    made = [_predict(table, test, picking.columns, units) for test in options.tests]
    result.remarks += [_report.of_range(test, abs(table.span), how) for test, how in made]
    result.extra = dict.fromkeys((TABLE, SHEET), partial(save_table, table))
    return _report.complete(result, units.get("f", ""), [test for test, _ in made])


def _check(options: Options) -> None:
    if isinstance(options.smooth, str) and options.smooth != AUTO:
        raise InputError("--smooth", options.smooth, f"a length in grid steps, or {AUTO}")
    if options.between not in (*BETWEENS, AUTO):
        raise InputError("--between", options.between, ", ".join((*BETWEENS, AUTO)))
    if options.shape not in SHAPES:
        raise InputError("--shape", options.shape, ", ".join(SHAPES))


def _find_curves(picking: Picking, options: Options) -> tuple[Found, dict[str, str]]:
    if not any(is_forc(file) for file in picking.files):
        if options.drift:
            problem = f"{printable(picking.files[0], 300)} is not a MicroMag file"
            remedy = "Other files have no calibrations between their curves."
            raise ProblemError("--drift", problem, remedy)
        tables = load(picking, ROLES)
        for table in tables:
            find_saturated(table.values["f"], f"{table.file}, f")
        return from_tables(tables, options.curves), tables[0].units
    from macromicro.hysteresis.forc import read_forc

    if len(picking.files) > 1:
        found = f"{len(picking.files)} files were given"
        raise ProblemError("FILE", found, "Give a single MicroMag file.")
    if options.curves not in ("auto", "ascending"):
        raise InputError("--curves", options.curves, "ascending, the only kind in a MicroMag file")
    file = read_forc(picking.files[0], drift=options.drift)
    cgs = "cgs" in file.settings.get("Units of measure", "").lower()
    units = {"u": "Oe", "f": "emu"} if cgs else {"u": "T", "f": "A*m^2"}
    return Found(file.curves, "ascending", []), units


class _Maker:
    """Builder of tables of one kind and grid; `open` are the choices to be made."""

    def __init__(self, found: Found, options: Options, limits: tuple[float, float]) -> None:
        self.found, self.options, self.limits = found, options, limits
        smooth = 1.0 if options.smooth == AUTO else float(options.smooth)
        lengths = _TRIED if options.smooth == AUTO else (smooth,)
        ways = BETWEENS if options.between == AUTO else (options.between,)
        self.open = [(length, way) for way in ways for length in lengths]
        self.first: Choice = (smooth, ways[0])
        self.choice = self.first
        if len(self.open) == 1:
            self.open = []

    def __call__(
        self, pairs: list[Pair], choice: Choice | None = None, rounds: int = ROUNDS
    ) -> FodTable:
        smooth, between = choice or self.choice
        return FodTable.from_curves(
            pairs,
            self.found.kind,
            shape=self.options.shape,  # type: ignore[arg-type]
            smooth=smooth,
            between=between,  # type: ignore[arg-type]
            limits=self.limits,
            rounds=rounds,
        )


def held_out_errors(make: _Maker, pairs: list[Pair]) -> dict[Choice, float]:
    import warnings

    if len(pairs) < _ENOUGH:
        by_length = make.options.smooth == AUTO
        name = "--smooth" if by_length else "--between"
        other = "a length in grid steps" if by_length else " or ".join(BETWEENS)
        problem = f"{AUTO} needs {_ENOUGH} curves or more, and there are {len(pairs)}"
        raise ProblemError(name, problem, f"Give {other}, or more curves.")
    found = {}
    for choice in make.open:
        squares, count = 0.0, 0
        for fold in range(_FOLDS):
            unseen = [p for k, p in enumerate(pairs[1:-1]) if k % _FOLDS == fold]
            seen = [
                p
                for k, p in enumerate(pairs)
                if k in (0, len(pairs) - 1) or (k - 1) % _FOLDS != fold
            ]
            with warnings.catch_warnings():  # they were said about the whole table
                warnings.simplefilter("ignore")
                misfit = make(seen, choice, ROUGH).misfit(unseen)
            points = sum(len(u) for u, _ in unseen)
            squares, count = squares + misfit.rms**2 * points, count + points
        found[choice] = math.sqrt(squares / count)
    return found


def _best(make: _Maker, pairs: list[Pair]) -> Choice:
    """The best choice by these curves; the given one where they are too few."""
    if not make.open or len(pairs) < _ENOUGH:
        return make.first
    tried = held_out_errors(make, pairs)
    return min(tried, key=lambda choice: tried[choice])


def _held_out(make: Callable[[list[Pair]], FodTable], pairs: list[Pair]) -> Errors | None:
    """Errors of a table from curves 1, 3, ... and the last one on curves 2, 4, ..."""
    import warnings

    if len(pairs) < _FEWEST:
        return None
    seen = [*pairs[:-1:2], pairs[-1]]
    unseen = pairs[1:-1:2]
    with warnings.catch_warnings():  # they were said about the whole table already
        warnings.simplefilter("ignore")
        table = make(seen)
        misfit = table.misfit(unseen)
    return Errors(misfit.rms, misfit.largest, _along(table, unseen))


def _along(table: FodTable, pairs: list[Pair]) -> list[tuple[Array, Array, Array]]:
    """Input, output and output by the table of each curve, from its saturation."""
    predicted = []
    for u, f in pairs:
        good = np.isfinite(u) & np.isfinite(f)
        start = float(u[good].max() if table.kind == "descending" else u[good].min())
        predicted.append((u[good], f[good], table.curve(start, u[good])))
    return predicted


def _broken(found: Found) -> list[Line]:
    lines = []
    for name, check in (("wiping-out", wiping_out), ("congruency", congruency)):
        for u, f in found.records[:1]:
            try:
                gap = check(u, f, 0.03 * float(np.ptp(u)))
            except InputError:
                continue
            note = f"RMS of {len(gap.gaps)} comparisons; 0 for a Preisach model"
            lines.append(Line(name, 100.0 * gap.rms, unit="% of range", note=note))
    return lines


def _predict(
    table: FodTable, test: str, columns: dict[str, str], units: dict[str, str]
) -> tuple[Prediction, str]:
    """Prediction of curves, each from its own saturation, or of a recording; from where it runs."""
    place = there([test])[0]
    if is_forc(place):
        from macromicro.hysteresis.forc import read_forc

        return _curves_predicted(table, printable(place, 300), read_forc(place).curves)
    picked = pick(read_table(place), ROLES, columns)
    alike(picked, units, "the table")
    if "curve" in picked.values:
        curves = from_tables([picked], table.kind).curves
        return _curves_predicted(table, picked.file, curves)
    u, f = clean(picked, 2)
    model = Preisach(table)
    beyond = int(((u < table.lo) | (u > table.hi)).sum())
    if beyond > 0.01 * len(u):
        notice(
            DataWarning,
            f"{picked.file}: {beyond} of {len(u)} inputs beyond the table's {table.lo:g} to "
            f"{table.hi:g}; taken as its ends",
        )
    begin = "its first point"
    try:
        model.initialise_at(float(u[0]), float(f[0]))
    except InputError:
        begin = "negative saturation"  # as a new model is
    index = np.arange(len(u), dtype=np.float64)
    return Prediction(picked.file, index, f, model.run(u)), f"from {begin} on"


def _curves_predicted(table: FodTable, file: str, pairs: list[Pair]) -> tuple[Prediction, str]:
    _, measured, model = map(np.concatenate, zip(*_along(table, pairs), strict=True))
    index = np.arange(len(model), dtype=np.float64)
    how = f"{len(pairs)} curves, each from its saturation"
    return Prediction(file, index, measured, model), how


class Found(NamedTuple):
    """`curves` of one `kind`, and the whole `records` (u, f) that they come from."""

    curves: list[Pair]  # pairs of input and output, shape (m,) each
    kind: Kind  # the kind of all of them
    records: list[Pair]  # the whole records that they were cut from, as pairs


def from_tables(tables: list[Picked], kind: str) -> Found:
    """Curves of the files: by the column `curve`, or cut out of the time record or its cycles."""
    pairs = _numbered_curves(tables)
    if pairs and sum(map(_whole_cycle, pairs)) <= 0.5 * len(pairs):  # a record may end within one
        ways = [direction(u) for u, _ in pairs]
        many: Kind = "ascending" if sum(np.sign(ways)) > 0.0 else "descending"
        return Found(pairs, _requested_kind(kind) or many, [])
    records = [clean(table) for table in tables]
    down = [c for u, f in records for c in cut_curves(u, f)]
    up = [(-u, -f) for a, b in records for u, f in cut_curves(-a, -b)]
    way = _requested_kind(kind) or ("ascending" if len(up) > len(down) else "descending")
    curves = up if way == "ascending" else down
    if len(curves) < 2:
        raise ProblemError(
            tables[0].file,
            f"{len(curves)} {way} curves found: the input never reverses in cycles from one end",
            "Move the input from one end of its range to different turning points and back, "
            "twice or more.",
        )
    return Found(curves, way, records)


def _requested_kind(kind: str) -> Kind | None:
    if kind not in ("auto", "ascending", "descending"):
        raise InputError("--curves", kind, "auto, ascending or descending")
    return "ascending" if kind == "ascending" else "descending" if kind == "descending" else None


def _numbered_curves(tables: list[Picked]) -> list[Pair]:
    """Curves by the column `curve`; none where a file lacks it."""
    if not all("curve" in table.values for table in tables):
        return []
    found = []
    for table in tables:
        u, f, curve = (table.values[n] for n in ("u", "f", "curve"))
        found += [(u[curve == c], f[curve == c]) for c in dict.fromkeys(curve.tolist())]
    return found


def _whole_cycle(pair: Pair) -> bool:
    """Whether the input comes back to where it began."""
    u, _ = pair
    return bool(abs(u[-1] - u[0]) < _BACK * np.ptp(u))


def clean(table: Picked, least: int = 20) -> Pair:
    """Input and output over time, a thermocouple's without spikes and noise."""
    u, f = table.values["u"], table.values["f"]
    for name, values in (("u", u), ("f", f)):
        if np.ptp(values) == 0.0:
            raise ProblemError(
                f"{table.file}, {name}",
                f"the column is constant at {values[0]:g}",
                "Record a change.",
            )
    if len(u) < least:
        problem, remedy = f"the file has {len(u)} rows", f"Give {least} rows or more."
        raise ProblemError(table.file, problem, remedy)
    if table.names["u"] == "thermocouple" and "t" in table.values:
        from macromicro.identify.kiln import denoise
        from macromicro.identify.runs import checked

        run = checked(table.values["t"], u, f, table.file)
        u, f = denoise(run.t, run.u, run.dt), run.x
    return u, f


def cut_curves(u: Array, f: Array) -> list[Pair]:
    """Descending curves: falls of the input that follow a rise from its low end."""
    # A rise also begins where the output equals its value at the low end, since a record may begin
    # below it in a cold room. Points are means over windows, so that noise does not reorder them.
    from macromicro.hysteresis.diagnostics import turning_points

    extent = float(np.ptp(u))
    low = float(u.min()) + _NEAR * extent
    off = np.abs(f - f[np.argmin(u)]) > _LEG * float(np.ptp(f))
    turns = turning_points(u, _LEG * extent)
    found = []
    for (before, top), (_, end) in pairwise(pairwise(turns)):
        fall = u[top : end + 1]
        if (u[before] > low and off[before]) or fall[0] - fall[-1] < _LEG * extent or len(fall) < 5:
            continue
        uu, ff = window_means(fall, f[top : end + 1], len(fall), extent / _WINDOWS)
        # The curve begins where the record turned, not in the middle of its first window.
        count = max(len(fall) // 1000, 1)
        found.append((np.r_[fall[0], uu[1:]], np.r_[f[top : top + count].mean(), ff[1:]]))
    return found
