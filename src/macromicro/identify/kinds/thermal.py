"""`identify thermal`: static gain, third-order heating and cooling from open-loop steps."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis.table import FodTable
from macromicro.identify import _report, model_file
from macromicro.identify._report import Curves, Pair
from macromicro.identify.clusters import within
from macromicro.identify.heating import (
    AMBIENT,
    CoolingFit,
    HeatingFit,
    StepRecord,
    exponential_fall,
    fall_of,
    heating,
    steady,
    step_of,
)
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.options import Thermal as Options
from macromicro.identify.picking import RUN, Picked, Picking, Role, T, even_runs
from macromicro.identify.result import Line, Result
from macromicro.identify.runs import Run

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.identify.heating import GainFit
    from macromicro.models.heating import Modes


_MODES = 3  # of a heating
U = Role("u", "heating voltage", ("u", "U", "ctrl", "voltage", "volts", "v", "V", "input"), ("V",))
TEMPERATURE = Role(
    "T",
    "temperature; a position x gives it with --table",
    ("temperature", "thermocouple", "temp", "T"),
    ("degC",),
)
X = Role("x", "position", ("x", "X", "laser", "position", "pos"), ("mm",))
_RISE = "temperature rise [K]"
_STILL = 0.01  # a rise that changes by less than this part in its last tenth has settled
_SHORTEST = 4.5  # samples of a fall to 63 %
NEAR_STOP = 0.97  # of the table's range: beyond it a position shows no temperature


class Found(NamedTuple):
    records: dict[float, StepRecord]  # steps from cold
    rises: dict[float, float]  # steady rises, K
    chosen: float  # voltage of the step for the dynamics, V
    heating: HeatingFit  # (5.6)
    gain: GainFit | None  # (5.2), where there are enough voltages
    cooling: dict[float, CoolingFit]  # (5.9)


def identify(picking: Picking, options: Options) -> Result:
    """(5.2), (5.6) as modes and as a ladder, and (5.9)."""
    source = Source(None, options.ambient)
    role = "T"
    if options.table is not None:
        from macromicro.identify.kiln import saved_table

        source, role = Source(saved_table(options.table), options.ambient), "x"
    roles = (T, U, X if role == "x" else TEMPERATURE, RUN)
    tables, others = _report.records(picking, roles, options.tests)
    sorted_ = steps(tables, role)
    remarks: list[tuple[str, str]] = []
    records = {
        v: record(group, source, sorted_.cold.get(v, ()))
        for v, group in sorted(sorted_.held.items())
    }
    rises = _steady(records, source, remarks)
    chosen = _choose_step(records, rises, options.step)
    fit = heating(records[chosen], rises[chosen])
    falls = _falls(sorted_, source)
    found = Found(records, rises, chosen, fit, _gain(rises, remarks), falls)
    tests = _predict(found, others, role, source)
    rest = drift(records[chosen])
    remarks.append(
        ("dynamics", f"from the step to {chosen:g} V, error {100.0 * fit.nrmse:.2f} % of its range")
    )
    slow = (
        "errors of the middle rate and of shares leave out what lasts longer than a part of a step"
    )
    remarks.append(("slow disturbances", slow))
    if not _is_long_enough(fit):
        slowest, lasted = 1.0 / fit.modes[_MODES - 1], float(records[chosen].t[-1])
        notice(
            DataWarning,
            f"the step to {chosen:g} V lasts {lasted:.4g} s, too short for its slowest time "
            f"constant ({slowest:.2g} s found, uncertain by any factor): the slowest rate and "
            "share, c3, r3 and the remainder of the rises are unknown. Record a longer step",
        )
    if abs(rest) > _STILL:
        text = f"the step to {chosen:g} V still changed by {100.0 * rest:.1f} % in its last tenth; "
        notice(DataWarning, text + "its end was taken as steady")
    remarks.append(
        ("ladder", "three heat capacities in a row; 1 K of heat warms by r1 + r2 + r3 K")
    )
    title = "Heating: T / T_d = sum of share rate / (s + rate); steady T_d by voltage"
    data = {"steady_K": rises, "chosen_V": chosen, "nrmse": fit.nrmse}
    parts = Result(
        "thermal", title, found, _lines(found), remarks, _toml(found), lambda: _draw(found), data
    )
    return _report.complete(parts, "K", tests, lambda: _curves(found))


def _predict(found: Found, others: list[Picked], role: str, source: Source) -> list[Pair]:
    """Heating of test steps: by (5.2), or the rise at the same voltage."""
    from macromicro.models.weighted_gain import exponential

    tests = []
    for table in others:
        seen = steps([table], role)
        for volts, group in sorted(seen.held.items()):
            step = record(group, source, seen.cold.get(volts, ()))
            if volts in found.rises:
                end = found.rises[volts]
            elif found.gain is not None:
                end = float(exponential(found.gain.model, volts))
                low, high = min(found.rises), max(found.rises)
                if not low < volts < high:
                    notice(
                        DataWarning,
                        f"{table.file}: the rise of a step to {volts:g} V is extrapolated by "
                        f"(5.2), which was fitted from {low:g} to {high:g} V",
                    )
            else:
                known = ", ".join(f"{v:g}" for v in found.rises)
                remedy = f"Give one of {known} V, or steady rises at four voltages for (5.2)."
                raise ProblemError("--test", f"{table.file} steps to {volts:g} V", remedy)
            tests.append(_heating(found, step, end, table.file))
    return tests


def _heating(found: Found, step: StepRecord, end: float, file: str = "") -> Pair:
    """Rise of a step where it is known, and by (5.6) to a steady `end` [K]."""
    from macromicro.models.heating import step_response

    usable = np.isfinite(step.error)
    t, rise = step.t[usable], step.rise[usable]
    return Pair(file, t, rise, end * np.asarray(step_response(found.heating.modes, t)))


def _curves(found: Found) -> Curves:
    one = _heating(found, found.records[found.chosen], found.rises[found.chosen])
    return Curves([one], _RISE, float(one.t[1] - one.t[0]))


def _steady(
    records: dict[float, StepRecord], source: Source, remarks: list[tuple[str, str]]
) -> dict[float, float]:
    """Steady rise [K] of each voltage whose end shows one."""
    rises, stopped = {}, []
    for volts, step in records.items():
        if not clear_of_stop(step, source):
            stopped.append(volts)
            continue
        try:
            rises[volts] = steady(step, _end(step))
        except InputError:
            stopped.append(volts)
    if stopped:
        listed = ", ".join(f"{v:g}" for v in stopped)
        remarks.append(("no steady temperature", f"at {listed} V: the position does not show it"))
    if not rises:
        remedy = "Record a step that stays clear of the stop."
        raise ProblemError("steps", "no step shows a steady temperature", remedy)
    return rises


def _end(step: StepRecord) -> float:
    """Duration [s] of the end of a step, for the mean steady rise."""
    return min(2.0, 0.1 * float(step.t[-1]))


def _choose_step(
    records: dict[float, StepRecord], rises: dict[float, float], requested: float | None
) -> float:
    """The step for the dynamics: as requested, or the middle one, clear of the stop."""
    if requested is not None:
        near = min(rises, key=lambda v: abs(v - requested))
        if abs(near - requested) > 1e-6:
            listed = ", ".join(f"{v:g}" for v in rises)
            raise InputError("--step", requested, f"a voltage whose step is steady: {listed}")
        return near
    every = sorted(records)
    middle = every[(len(every) - 1) // 2]
    return min(rises, key=lambda v: (abs(v - middle), -v))


def _gain(rises: dict[float, float], remarks: list[tuple[str, str]]) -> GainFit | None:
    from macromicro.identify.heating import static_gain

    if len(rises) < 4:
        remarks.append(("static gain", f"{len(rises)} steady voltages; four are needed for (5.2)"))
        return None
    try:
        return static_gain(list(rises), list(rises.values()))
    except (InputError, np.linalg.LinAlgError) as error:
        remarks.append(("static gain", f"(5.2) does not fit: {error}"))
        return None


def _falls(sorted_: Steps, source: Source) -> dict[float, CoolingFit]:
    """Cooling by voltage; unusable steps are left out with a warning."""
    found = {}
    for volts, group in sorted(sorted_.cooled.items()):
        try:
            found[volts] = fall(group, source, sorted_.cold.get(volts, ()))
        except InputError as error:
            notice(DataWarning, f"cooling from {volts:g} V left out: {error}")
    return found


def _lines(found: Found) -> list[Line]:
    lines = [_risen(found, volts) for volts in found.rises]
    if found.gain is not None:
        gain = found.gain
        reach = 2.0 * within(len(found.rises) - 3)
        names = ("b", "a", "y0")
        values = (gain.model.b, gain.model.a, gain.model.y0)
        for name, value, (low, high), unit in zip(
            names, values, gain.interval, ("K", "1/V", "K"), strict=True
        ):
            note = f"(5.2), 95 %: {low:.4g} to {high:.4g}"
            lines.append(Line(name, value, (high - low) / reach, unit, note, 0.5 * reach))
        low, high = gain.asymptote_interval
        note = f"95 %: {low:.4g} to {high:.4g}; RMS error of the curve {gain.rms:.2g} K"
        error = (high - low) / reach
        lines.append(Line("asymptote b + y0", gain.asymptote, error, "K", note, 0.5 * reach))
    heated = found.heating
    each = zip(heated.modes, heated.std, heated.factors[1].tolist(), strict=True)
    for k, (value, error, factor) in enumerate(each):
        what, unit = ("rate", "rad/s") if k < _MODES else ("share", "")
        note = f"time constant {1.0 / value:.4g} s" if k < _MODES else ""
        lines.append(Line(f"{what} {k % _MODES + 1}", value, error, unit, note, factor))
    for name, value in found.heating.ladder._asdict().items():
        lines.append(Line(name, value, unit="s" if name[0] == "c" else "", note="ladder"))
    for volts, fall in found.cooling.items():
        note = (
            f"to 63 % of the fall from {fall.peak:.4g} degC; by least squares {fall.fitted:.4g} s"
        )
        lines.append(Line(f"cooling from {volts:g} V", fall.time, unit="s", note=note))
    return lines


def _risen(found: Found, volts: float) -> Line:
    """Rise at the end of a step; the predicted remainder counts as its error."""
    step, rise = found.records[volts], found.rises[volts]
    error, left = _doubt(step), rise * _remainder(found.heating.modes, float(step.t[-1]))
    if not _is_long_enough(found.heating):
        return Line(f"rise at {volts:g} V", rise, unit="K", note="at the end of the step")
    note = f"{left:.2g} K still to come at its end" if left > error else ""
    return Line(f"rise at {volts:g} V", rise, math.hypot(error, left), "K", note)


def _remainder(modes: Modes, t: float) -> float:
    """Remainder of a steady rise after a time [s], by (5.6)."""
    rates, shares = np.split(np.array(modes), 2)
    return float(shares @ np.exp(-rates * t))


def _is_long_enough(fit: HeatingFit) -> bool:
    """Whether the step was long enough for the slowest rate, to a half at least."""
    return fit.std[_MODES - 1] < 0.5 * fit.modes[_MODES - 1]


def _doubt(step: StepRecord) -> float:
    """Standard error [K] of the rise at a step's end: the table's, or the scatter there."""
    last = step.t >= step.t[-1] - _end(step)
    spread = float(np.std(step.rise[last])) / np.sqrt(last.sum())
    return float(np.hypot(float(step.error[last].mean()), spread))


def _draw(found: Found) -> dict[str, Figure]:
    from macromicro.identify.kinds import pictures
    from macromicro.models.weighted_gain import exponential

    volts, rises = np.array(list(found.rises)), np.array(list(found.rises.values()))
    series = [("measured", volts, rises, "o")]
    if found.gain is not None:
        grid = np.linspace(volts[0], volts[-1], 100)
        curve = found.gain.model
        series.append(("(5.2)", grid, np.array([exponential(curve, v) for v in grid]), "-"))
    return {"gain": pictures.points("static gain", "voltage [V]", _RISE, series)}


def _toml(found: Found) -> str:
    modes, ladder = found.heating.modes, found.heating.ladder
    tables: dict[str, dict[str, Any]] = {
        "heating": {
            "rates": (list(modes)[:3], "rad/s"),
            "shares": (list(modes)[3:], f"of the rise; error {100.0 * found.heating.nrmse:.2f} %"),
        },
        "ladder": {
            name: (float(v), "s" if name[0] == "c" else "K per K of heat")
            for name, v in ladder._asdict().items()
        },
        "steady": {
            "volts": (list(found.rises), "V"),
            "rise": (list(found.rises.values()), "K above ambient"),
        },
    }
    if found.gain is not None:
        values = found.gain.model._asdict()
        tables["gain"] = {n: (float(v), "(5.2)") for n, v in values.items()}
    if found.cooling:
        tables["cooling"] = {
            "volts": (list(found.cooling), "V before"),
            "time": ([f.time for f in found.cooling.values()], "s to 63 % of the fall"),
        }
    head = "Heating and cooling as identified, for other programs and macromicro.models.\n"
    head += "Not for `macromicro run --config`: the bench has wires and plates, not these modes."
    return model_file.plain(head, tables)


class Source(NamedTuple):
    table: FodTable | None  # from position; None: it was measured
    ambient: float | None  # deg C; None: the first temperature of each record, or 25 deg C

    @property
    def room(self) -> float:
        """Ambient temperature where positions show none, deg C."""
        return AMBIENT if self.ambient is None else self.ambient


class Cold(NamedTuple):
    mean: float  # of a temperature, deg C, or a position, mm
    samples: int  # number, with the first of the step


class Steps(NamedTuple):
    held: dict[float, list[Run]]  # those of a constant voltage
    cooled: dict[float, list[Run]]  # those that end at 0 V
    # what was seen before the steps of each voltage
    cold: Mapping[float, list[Cold]] = MappingProxyType({})


def steps(tables: Sequence[Picked], role: str) -> Steps:
    held: dict[float, list[Run]] = {}
    cooled: dict[float, list[Run]] = {}
    cold: dict[float, list[Cold]] = {}
    left = 0
    for table in tables:
        for whole in even_runs(table, role, 50):
            first = int(np.argmax(whole.u != 0.0))
            before = Cold(float(whole.x[: first + 1].mean()), first + 1)
            run = Run(whole.t[first:] - whole.t[first], whole.u[first:], whole.x[first:])
            if len(run.t) < 50 or run.u[0] <= 0.0:
                left += 1
                continue
            change = np.flatnonzero(run.u != run.u[0])
            volts = round(float(run.u[0]), 9)
            if not len(change):
                held.setdefault(volts, []).append(run)
            elif np.all(run.u[change[0] :] == 0.0):
                cooled.setdefault(volts, []).append(run)
            else:
                left += 1
                continue
            cold.setdefault(volts, []).append(before)
    if left:
        accepted = "a constant voltage from a cold start, then 0 V perhaps"
        notice(DataWarning, f"{left} runs are no steps ({accepted}); left out")
    if not held and not cooled:
        remedy = "Record open-loop steps from cold."
        raise ProblemError(tables[0].file, "no run steps to a voltage and stays there", remedy)
    for volts, group in cooled.items():  # a fall's rise will do where there is nothing better
        if volts not in held:
            cut = [int(np.argmax(r.u == 0.0)) for r in group]
            held[volts] = [r.part(0, k) for r, k in zip(group, cut, strict=True)]
    return Steps(held, cooled, cold)


def _alike(group: list[Run]) -> list[Run]:
    """The longest runs of a group with equal sample times, cut to one length."""
    long = max(r.t[-1] for r in group)
    kept = [r for r in group if r.t[-1] > 0.9 * long]
    kept = [r for r in kept if abs(r.dt - kept[0].dt) < 1e-3 * kept[0].dt]
    n = min(len(r.t) for r in kept)
    return [r.part(0, n) for r in kept]


def record(group: list[Run], source: Source, cold: Sequence[Cold] = ()) -> StepRecord:
    """Mean temperature rise over ambient of one voltage's runs."""
    # An unknown ambient temperature is the mean of the readings before the steps; its error is
    # their scatter.
    group = _alike(group)
    t, mean = group[0].t, np.mean([r.x for r in group], axis=0)
    if source.table is not None:
        return step_of(source.table, t, mean, source.room)
    if source.ambient is not None:
        return StepRecord(t, mean, mean - source.ambient, np.zeros_like(mean))
    cold = _cold(group, cold)
    error = _scatter(mean) * math.sqrt(np.mean([1.0 / c.samples for c in cold]))
    ambient = _ambient(cold)
    return StepRecord(t, mean, mean - ambient, np.full_like(mean, error))


def _cold(group: list[Run], cold: Sequence[Cold]) -> Sequence[Cold]:
    return cold or [Cold(float(r.x[0]), 1) for r in group]


def _ambient(cold: Sequence[Cold]) -> float:
    return float(np.mean([c.mean for c in cold]))


def _scatter(x: Array) -> float:
    """Noise over the last half, by second differences (J. von Neumann, 1941)."""
    return float(np.sqrt(np.mean(np.diff(x[len(x) // 2 :], 2) ** 2) / 6.0))


def clear_of_stop(step: StepRecord, source: Source) -> bool:
    """Whether the end of a step shows a temperature."""
    if source.table is None:
        return True
    table = source.table
    return float(step.position.max()) < table.f_low + NEAR_STOP * table.span


def drift(step: StepRecord) -> float:
    """Change of the rise over the last tenth of a record."""
    last = step.t >= step.t[-1] - 0.1 * (step.t[-1] - step.t[0])
    rise = step.rise[last]
    if len(rise) < 10:
        return math.nan
    tenth = max(len(rise) // 5, 1)
    return float(rise[-tenth:].mean() - rise[:tenth].mean()) / max(abs(float(rise[-1])), 1e-12)


def fall(group: list[Run], source: Source, cold: Sequence[Cold] = ()) -> CoolingFit:
    """Cooling constant of (5.9) from one voltage's runs."""
    group = _alike(group)
    t, x = group[0].t, np.mean([r.x for r in group], axis=0)
    begin = int(np.argmax(group[0].u == 0.0))
    if source.table is not None:
        return fall_of(source.table, t, x, begin, source.room)
    ambient = _ambient(_cold(group, cold)) if source.ambient is None else source.ambient
    peak = float(x[max(begin - 5, 0) : begin].mean())
    every = np.ones(len(x) - begin, dtype=np.bool_)
    fit = exponential_fall(t[begin:] - t[begin], x[begin:] - ambient, every, peak, ambient)
    if fit is None or fit.time < _SHORTEST * group[0].dt:
        found = f"it falls from {peak:.4g} to {x[-1]:.4g} degC"
        raise ProblemError("cooling record", found, "Record 63 % of the way to ambient or more.")
    return fit
