"""`identify plays`: Prandtl-Ishlinskii operators from any recording that goes both ways."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis import prandtl, prandtl_loop, prandtl_rate
from macromicro.hysteresis.prandtl_fit import PrandtlFit, fit
from macromicro.hysteresis.prandtl_rate import RateFit
from macromicro.identify import _report, model_file
from macromicro.identify._report import Pair
from macromicro.identify.kinds.hysteresis import ROLES, clean
from macromicro.identify.options import Plays as Options
from macromicro.identify.picking import Picked, Picking, load
from macromicro.identify.play_operators import Loop
from macromicro.identify.result import Line, Result
from macromicro.identify.runs import checked
from macromicro.units import convert, quotient

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STAGE = """\
This is the law's hysteresis alone. Run as it is, the file is a machine whose other settings are
the defaults: amplifier, stack, guide and sensor of a P-621.1CD of Physik Instrumente (PI), 100 um,
20 g on it. `controller.invert = 0` switches the inverse off."""
HELD = "RMS over the held-out end of the recording"
HEAD = """\
Play operators: output = offset + sum of weights y, y = max(u - r, min(u + r, y)) for each
threshold r. macromicro.hysteresis.prandtl.operator takes these lists."""


def identify(picking: Picking, options: Options) -> Result:
    if len(picking.files) > 1:
        remedy = "Give one recording over time, and others to predict with --test."
        raise ProblemError("FILE", f"{len(picking.files)} files were given", remedy)
    table = load(picking, ROLES)[0]
    if "curve" in table.values:
        remedy = "Give a recording over time."
        raise ProblemError(f"{table.file}, curve", "the file holds single curves", remedy)
    u, f = clean(table)
    rated: RateFit | None = None
    try:
        if options.rate:
            u, f, dt = _samples(table)
            rated = prandtl_rate.fit(u, f, dt, options.plays)
        found = rated.fit if rated else fit(u, f, options.plays)
    except InputError as error:
        raise error.at(f"{table.file}: {error.where}") from None
    u_unit, f_unit = table.units["u"], table.units["f"]
    p = found.operator
    extent, span = float(np.ptp(f)), float(np.ptp(u))
    loop = prandtl_loop.measured(p.thresholds, p.weights, span)
    share = 100.0 * loop.width / loop.stroke
    per = quotient(f_unit, u_unit)
    lines = [
        Line("input, from", float(u.min()), unit=u_unit),
        Line("input, to", float(u.max()), unit=u_unit),
        Line("stroke", loop.stroke, unit=f_unit, note="of a slow cycle over that input"),
        Line("loop width", share, unit="% of stroke", note="in mid-input"),
        Line("reversible gain", float(p.weights[0]), unit=per, note="right after a reversal"),
        Line("mean gain", loop.stroke / span, unit=per, note="stroke over input"),
        Line("misfit", 100.0 * found.rms / extent, unit="% of range", note="RMS where fitted"),
        Line("prediction", 100.0 * found.held_rms / extent, unit="% of range", note=HELD),
    ]
    if rated:
        lines += _rate_lines(rated, extent)
    used = int(np.count_nonzero(p.weights))
    began = f"the first {found.known} depend on the earlier input"
    held = f"{u.size - found.fitted} held out"
    remarks = [
        ("plays", f"{options.plays}, {used} of them with a weight, none below 0"),
        ("samples", f"{found.fitted - found.known} fitted, {held}; {began}"),
    ]
    lag = rated.lag if rated else None
    others = _report.unseen(options.tests, picking, ROLES, table)
    tests = [_predict(p, other, lag) for other in others]
    remarks += [_report.of_range(test, extent) for test in tests]

    def draw() -> dict[str, Figure]:
        return draw_figures(u, f, found, (u_unit, f_unit))

    toml = as_toml(p, (u_unit, f_unit), (float(u.min()), float(u.max())))
    data = {
        "thresholds": p.thresholds.tolist(), "weights": p.weights.tolist(), "offset": p.offset,
        "range": extent, "rms": found.rms, "holdout_rms": found.held_rms,
        "stroke": loop.stroke, "loop_width": loop.width, "widening": p.widening, "lag": lag,
    }  # fmt: skip
    title = "Prandtl-Ishlinskii: f = offset + sum of w_i y_i, y_i a play of threshold r_i"
    parts = Result("plays", title, p, lines, remarks, toml, draw, data)
    return _report.complete(parts, f_unit, tests)


def _samples(table: Picked) -> tuple[Array, Array, float]:
    if "t" not in table.values:
        remedy = "Name one, or omit --rate."
        raise ProblemError("recording, t", "there is no column of times", remedy)
    run = checked(table.values["t"], table.values["u"], table.values["f"], "recording")
    return run.u, run.x, run.dt


def _rate_lines(rated: RateFit, extent: float) -> list[Line]:
    """Effect of the rate, and the gain in accuracy."""
    still = 100.0 * rated.still.held_rms / extent
    verdict = "worse than this" if rated.better else "no worse: no effect of the rate"
    return [
        Line("widening", rated.fit.operator.widening, unit="s", note="of thresholds, by the rate"),
        Line("lag", rated.lag, unit="s", note="of the output, of first order"),
        Line("without rate", still, unit="% of range", note=f"the same prediction, {verdict}"),
    ]


def as_toml(p: prandtl.Prandtl, units: tuple[str, str], ends: tuple[float, float]) -> str:
    """Settings of a piezo stage for an input in volts, else plain values."""
    u, f = units
    where = f"input from {ends[0]:g} to {ends[1]:g} {u}, output {p.offset:.6g} {f} at rest at 0"
    try:
        volts, metres = convert(1.0, u, "V"), convert(1.0, f, "m")
    except ValueError:
        table = {
            "thresholds": (p.thresholds.tolist(), u or "unit of the input"),
            "weights": (p.weights.tolist(), f"{f}/{u}" if f and u else "output per input"),
            "offset": (p.offset, f or "unit of the output"),
        }
        return model_file.plain(f"{HEAD}\nHere: {where}.", {"hysteresis": table})
    weights = 1e6 * metres / volts * p.weights
    law = {
        "loop_thresholds": ([f"{volts * r:.9g} V" for r in p.thresholds], "at the stack"),
        "loop_weights": ([f"{w:.9g} um/V" for w in weights], "inverted by the law"),
    }
    head = f"For a machine of kind piezo: copy the table into its file. Here: {where}.\n{STAGE}"
    comment, _, body = model_file.plain(head, {"controller": law}).partition("\n\n")
    return f'{comment}\nmachine = "piezo"\n\n{body}'


def draw_figures(
    u: Array, f: Array, found: PrandtlFit, units: tuple[str, str]
) -> dict[str, Figure]:
    from macromicro.identify.kinds import pictures

    known, fitted = found.known, found.fitted
    x, y = f"input [{units[0]}]", f"output [{units[1]}]"
    error = f - found.outputs
    index = np.arange(u.size, dtype=np.float64)
    p = found.operator
    loop = [
        ("measured", u[known:], f[known:], "-"),
        ("play operators", u[known:], found.outputs[known:], "--"),
    ]
    left = [
        ("fitted", index[known:fitted], error[known:fitted], "-"),
        ("held out", index[fitted:], error[fitted:], "-"),
    ]
    weights = [("weights", p.thresholds, p.weights, "o")]
    threshold, weight = f"threshold [{units[0]}]", f"weight [{units[1]}/{units[0]}]"
    return {
        "curves": pictures.points("the loop", x, y, loop),
        "residuals": pictures.points("measured less play operators", "sample", y, left),
        "thresholds": pictures.points("weights", threshold, weight, weights),
    }


def _predict(p: prandtl.Prandtl, picked: Picked, lag: float | None = None) -> Pair:
    """Prediction of another recording, once its past is known."""
    u, f, dt = (*clean(picked, 2), None) if lag is None else _samples(picked)
    outputs = Loop(p, lag).run(u, dt)
    # The larger the swing so far, the fewer plays still depend on what was before.
    low, high = np.minimum.accumulate(u), np.maximum.accumulate(u)
    counts = high - low >= min(2.0 * float(p.thresholds[-1]), 0.99 * float(np.ptp(u)))
    index = np.flatnonzero(counts).astype(np.float64)
    return Pair(picked.file, index, f[counts], outputs[counts])
