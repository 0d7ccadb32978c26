"""Fits a correction to the readings of a calibration."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from macromicro.arrays import Array
from macromicro.calibration.measuring import Readings
from macromicro.control.correction import Correction

SIZES = (2, 3, 5, 9, 17, 33, 65)  # values of a table
ACROSS = (2, 3, 5)
BETTER = 0.97  # a larger model must predict the held-out positions so much better
FOLDS = 6
TIMES = 8  # constants of a growth since the start that are tried, at most twice the duration
WARMER = 0.5  # K; a smaller change of temperature shows no growth
BLOCKS = 15  # of time at least, in each of which the reference may be off by as much
DRIFT = 60.0  # s between the corners of the reference's drift
FREQUENCIES = 4  # of a spectrum, for each resolved one
GROWTH = "growth after the start"  # name of an estimate


class Estimate(NamedTuple):
    """A parameter with the half width of its 95 % interval."""

    name: str
    value: float
    half: float
    unit: str  # of a slide: "m", "rad", "1/K", "1"


class Model(NamedTuple):
    """What a fit consists of."""

    size: int  # values of the table of the mean of both flanks
    gap: int  # values of the table of their difference; 1: it is the same everywhere
    period: float  # of a deviation that repeats, m; 0: none
    across: int  # values of the table over the other axis; 0: none
    warm: bool
    time: float = 0.0  # constant of a growth since the start, s; 0: none


class Fit(NamedTuple):
    model: Model
    correction: Correction
    estimates: list[Estimate]
    residual: float  # standard deviation of what is left, m
    left: Array  # what is left of each reading, m
    apart: Array  # the same without the difference of the flanks, m

    @property
    def scatter(self) -> Array:
        """What is left, as large as at positions that the fit has not seen, m."""
        usual = math.sqrt(float(np.mean(self.left**2)))
        return self.left * (self.residual / usual if usual > 0.0 else 1.0)


def basis(low: float, high: float, size: int, x: Array) -> Array:
    """What each value of a table adds at some places, as `correction.curve` reads the table."""
    step, last = (high - low) / (size - 1), size - 1
    at = (x - low) / step
    k = np.clip(np.floor(at).astype(int), 0, last - 1)
    u = at - k
    found = np.zeros((len(x), size))
    rows = np.arange(len(x))
    # What the cubic has of a value, and of the slopes at its begin and its end.
    end = np.where(at > last, 1.0, np.where(at < 0.0, 0.0, 3.0 * u**2 - 2.0 * u**3))
    first = np.where(at > last, 0.0, np.where(at < 0.0, u, u - 2.0 * u**2 + u**3))
    second = np.where(at > last, u - 1.0, np.where(at < 0.0, 0.0, u**3 - u**2))
    found[rows, k] += 1.0 - end
    found[rows, k + 1] += end
    for slope, below, above in ((first, k > 0, 0), (second, k + 1 < last, 1)):
        # By the nearest values to either side; at an end of the table, by its last two.
        before = k + above - np.where(below, 1, above)
        after = k + above + np.where(below, 1, 1 - above)
        share = np.where(below, 0.5, 1.0)
        np.add.at(found, (rows, after), share * slope)
        np.add.at(found, (rows, before), -share * slope)
    return found


def waves(period: float, x: Array, harmonics: int = 2) -> Array:
    angles = [2.0 * math.pi * (k + 1) * x / period for k in range(harmonics)]
    return np.stack([f(angle) for angle in angles for f in (np.sin, np.cos)], axis=1)


class _Columns(NamedTuple):
    """The matrix of a fit, with the columns of each of its parts."""

    matrix: Array
    parts: dict[str, slice]


class Data(NamedTuple):
    """One stage's readings."""

    low: float
    high: float
    x: Array  # readings, m
    deviation: Array  # reference less reading, m
    flank: Array
    t: Array
    temperature: Array
    other: Array | None  # readings of the other axis
    other_span: tuple[float, float]
    target: Array
    on_drive: Array  # where the load lies on its drive, of which a wave is a function, m


def _columns(data: Data, model: Model) -> _Columns:
    parts: dict[str, Array] = {"table": basis(data.low, data.high, model.size, data.x)}
    parts["gap"] = (data.flank - 0.5)[:, None] * _gap(data, model, data.x)
    if model.period > 0.0:
        parts["waves"] = waves(model.period, data.on_drive)
    if model.across and data.other is not None:
        whole = basis(*data.other_span, model.across, data.other)
        parts["across"] = whole[:, 1:]  # its first value is 0: the table has the constant
    if model.warm:
        degrees = data.temperature - data.temperature.mean()
        parts["growth"] = (degrees * data.x)[:, None]  # from the place 0
    if model.time > 0.0:
        parts["warming"] = ((1.0 - np.exp(-data.t / model.time)) * data.x)[:, None]
    if data.t[-1] > 0.0:  # readings of a file have no times
        parts["drift"] = _drift(data.t)
    edges = np.cumsum([0, *(part.shape[1] for part in parts.values())]).tolist()
    spans = {name: slice(*edge) for name, edge in zip(parts, pairwise(edges), strict=True)}
    return _Columns(np.concatenate(list(parts.values()), axis=1), spans)


def _gap(data: Data, model: Model, x: Array) -> Array:
    """What each value of the flanks' difference adds at some places."""
    return np.ones((len(x), 1)) if model.gap == 1 else basis(data.low, data.high, model.gap, x)


def _drift(t: Array) -> Array:
    """Lines between corners of the reference's drift, which is 0 at the time 0."""
    corners = np.linspace(0.0, float(t[-1]), max(round(float(t[-1]) / DRIFT), 1) + 1)
    found = np.stack([np.interp(t, corners, one) for one in np.eye(len(corners))[1:]], axis=1)
    return np.asarray(found)


def solve(matrix: Array, wanted: Array) -> Array:
    """Least squares, the drift and steep tables bound by a whisper of ridge."""
    scale = np.maximum(np.sqrt((matrix**2).sum(axis=0)), 1e-12)
    scaled = matrix / scale
    count = matrix.shape[1]
    ridge = 1e-4 * np.eye(count)
    both = np.concatenate((scaled, ridge))
    found, *_ = np.linalg.lstsq(both, np.concatenate((wanted, np.zeros(count))), rcond=None)
    return np.asarray(found / scale)


def _held_out(data: Data, model: Model) -> float:
    """RMS error at positions that the fit has not seen."""
    columns = _columns(data, model)
    places = np.unique(data.target)
    order = np.searchsorted(places, data.target) % FOLDS
    errors = []
    for fold in range(min(FOLDS, len(places))):
        out = order == fold
        if columns.matrix.shape[1] >= (~out).sum():
            return math.inf
        found = solve(columns.matrix[~out], data.deviation[~out])
        errors.append(data.deviation[out] - columns.matrix[out] @ found)
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def _better(data: Data, best: Model, score: float, models: list[Model]) -> tuple[Model, float]:
    for model in models:
        tried = _held_out(data, model)
        if tried < BETTER * score:
            best, score = model, tried
    return best, score


def choose_model(data: Data, periods: list[float]) -> Model:
    """The smallest model that predicts held-out positions about as well as the best one."""
    warm = bool(np.ptp(data.temperature) > WARMER) if np.isfinite(data.temperature).all() else False
    across = 2 if data.other is not None else 0
    best = Model(2, 1, 0.0, across, warm)
    score = _held_out(data, best)
    places = len(np.unique(data.target))
    for _ in range(2):  # a period shows once the table is fine enough, and the other way round
        sizes = [size for size in SIZES if best.size < size <= max(places // 2, 2)]
        best, score = _better(data, best, score, [best._replace(size=size) for size in sizes])
        if best.period == 0.0:
            best, score = _better(data, best, score, [best._replace(period=p) for p in periods])
        if best.period == 0.0:
            seen = [best._replace(period=p) for p in _spectrum(data, best)]
            best, score = _better(data, best, score, seen)
        if not warm and best.time == 0.0 and data.t[-1] > 0.0:
            growing = best._replace(time=_time(data, best))
            best, score = _better(data, best, score, [growing])
    finer = [best._replace(gap=size) for size in SIZES if size <= best.size]
    best, score = _better(data, best, score, finer)
    if across:
        best, score = _better(data, best, score, [best._replace(across=n) for n in ACROSS[1:]])
    return best


def _time(data: Data, model: Model) -> float:
    """The time constant of a growth since the start that leaves least."""
    from scipy.optimize import minimize_scalar

    longest = 2.0 * float(data.t[-1])

    def left(log: float) -> float:
        matrix = _columns(data, model._replace(time=math.exp(log))).matrix
        return float(np.sum((data.deviation - matrix @ solve(matrix, data.deviation)) ** 2))

    edges = np.linspace(math.log(longest / 100.0), math.log(longest), TIMES)
    k = min(max(int(np.argmin([left(log) for log in edges])), 1), TIMES - 2)
    best = minimize_scalar(left, bounds=(edges[k - 1], edges[k + 1]), method="bounded")
    return math.exp(float(best.x))


def _spectrum(data: Data, model: Model) -> list[float]:
    """The period that explains most of what a model leaves."""
    columns = _columns(data, model)
    left = data.deviation - columns.matrix @ solve(columns.matrix, data.deviation)
    length, places = data.high - data.low, len(np.unique(data.target))
    cycles = np.arange(2.0 * FREQUENCIES, 2.0 * places * FREQUENCIES) / FREQUENCIES
    return [strongest(data.on_drive, left, length, cycles)]


def strongest(x: Array, left: Array, length: float, cycles: Array) -> float:
    """The period that explains most, of those that go so many times into a length."""

    def gained(number: float) -> float:
        own = waves(length / number, x, 1)
        found, *_ = np.linalg.lstsq(own, left, rcond=None)
        return float(np.sum((own @ found) ** 2))

    return _refine_period(x, left, length, max(cycles.tolist(), key=gained))


def _refine_period(x: Array, left: Array, length: float, cycles: float) -> float:
    from scipy.optimize import minimize_scalar

    def lost(number: float) -> float:
        own = waves(length / number, x, 1)
        found, *_ = np.linalg.lstsq(own, left, rcond=None)
        return float(np.sum((left - own @ found) ** 2))

    around = 1.0 / FREQUENCIES
    best = minimize_scalar(lost, bounds=(cycles - around, cycles + around), method="bounded")
    return length / float(best.x)


def fit(data: Data, periods: list[float], other: str = "") -> Fit:
    """The correction of one stage; `periods` are those that its drive suggests, m."""
    data = _on_drive(data, Model(2, 1, 0.0, 2 if data.other is not None else 0, False))
    found = _fit(data, choose_model(data, periods), other)
    growth = [each for each in found.estimates if each.name == GROWTH]
    if growth and abs(growth[0].value) < growth[0].half:  # it may be none, and would be used later
        return _fit(data, found.model._replace(time=0.0), other)
    return found


def _fit(data: Data, model: Model, other: str) -> Fit:
    data = _on_drive(data, model)
    columns = _columns(data, model)
    found = solve(columns.matrix, data.deviation)
    left = data.deviation - columns.matrix @ found
    free = max(len(left) - columns.matrix.shape[1], 1)
    residual = float(math.sqrt(np.sum(left**2) / free))
    matrix = columns.matrix
    if model.time > 0.0:  # that constant is a parameter as well
        slower = data.t * np.exp(-data.t / model.time) * data.x
        matrix = np.column_stack((matrix, slower / model.time))
    errors = _errors(data, matrix)
    changes = _changes(data, model, columns, found, other)
    return Fit(
        model,
        Correction(**{name: _round(value) for name, value in changes.items()}),
        _estimates(data, model, columns, found, errors, free),
        residual,
        left,
        left + columns.matrix[:, columns.parts["gap"]] @ found[columns.parts["gap"]],
    )


def _on_drive(data: Data, model: Model) -> Data:
    """The readings with their places on the drive, by the tables of a fit."""
    columns = _columns(data, model)
    found = solve(columns.matrix, data.deviation)
    parts = [columns.parts[name] for name in ("table", "gap")]
    table, gap = (columns.matrix[:, part] @ found[part] for part in parts)
    return data._replace(on_drive=data.x + table + gap)


def _round(value: Any) -> Any:
    """Numbers as a file should have them: six digits."""
    if isinstance(value, tuple):
        return tuple(map(_round, value))
    return float(f"{value:.6g}") if isinstance(value, float) else value


def _errors(data: Data, matrix: Array) -> Array:
    """Standard errors.

    What is left is alike at one position, and for some time, as the reference drifts.
    """
    places = np.unique(data.target, return_inverse=True)[1]
    blocks = max(round(float(data.t[-1]) / DRIFT), BLOCKS)
    times = np.arange(len(places)) * blocks // len(places)
    variances = [_jackknife(matrix, data.deviation, groups) for groups in (places, times)]
    return np.asarray(np.sqrt(variances[0] + variances[1]))


def _jackknife(matrix: Array, wanted: Array, groups: Any) -> Array:
    """Variances by fits that leave out one group of readings each."""
    rows = [groups != group for group in np.unique(groups)]
    found = np.array([solve(matrix[own], wanted[own]) for own in rows])
    return np.asarray((len(rows) - 1) * np.var(found, axis=0))


def _changes(
    data: Data, model: Model, columns: _Columns, found: Array, other: str
) -> dict[str, Any]:
    middle = found[columns.parts["table"]]
    places = np.linspace(data.low, data.high, model.size)
    gap = _gap(data, model, places) @ found[columns.parts["gap"]]
    made: dict[str, Any] = {
        "low": data.low,
        "high": data.high,
        "up": tuple((middle + 0.5 * gap).tolist()),
        "down": tuple((middle - 0.5 * gap).tolist()),
    }
    if model.period > 0.0:
        made |= {"period": model.period, "waves": tuple(found[columns.parts["waves"]].tolist())}
    if "across" in columns.parts:
        low, high = data.other_span
        values = (0.0, *found[columns.parts["across"]].tolist())
        made |= {"other": other, "across_low": low, "across_high": high, "across": values}
    if model.warm:
        made["expansion"] = float(found[columns.parts["growth"]][0])
    if model.time > 0.0:
        made |= {"warm_up": float(found[columns.parts["warming"]][0]), "warm_time": model.time}
        made["warm_until"] = float(data.t[-1])
    if np.isfinite(data.temperature).all():
        made["temperature"] = float(data.temperature.mean())
        low, high = float(data.temperature.min()), float(data.temperature.max())
        made |= {"cold": low - WARMER, "hot": high + WARMER}
    return made


def _estimates(
    data: Data, model: Model, columns: _Columns, found: Array, errors: Array, free: int
) -> list[Estimate]:
    factor = float(stats.t.ppf(0.975, min(free, 1000)))
    rows = []
    if model.gap == 1:
        k = columns.parts["gap"].start
        rows.append(Estimate("reversal", float(found[k]), factor * float(errors[k]), "m"))
    if model.period > 0.0:
        sine, cosine = found[columns.parts["waves"]][:2]
        error = errors[columns.parts["waves"]][:2]
        size = math.hypot(sine, cosine)
        half = math.hypot(sine * error[0], cosine * error[1]) / max(size, 1e-30)
        rows.append(Estimate("periodic error", size, factor * float(half), "m"))
    if model.warm:
        k = columns.parts["growth"].start
        rows.append(Estimate("expansion", float(found[k]), factor * float(errors[k]), "1/K"))
    if model.time > 0.0:
        k = columns.parts["warming"].start
        half = factor * float(errors[k])
        rows.append(Estimate(GROWTH, float(found[k]), half, "1"))
    if "across" in columns.parts and model.across == 2:
        k = columns.parts["across"].start
        across = 1.0 / (data.other_span[1] - data.other_span[0])
        half = factor * across * float(errors[k])
        rows.append(Estimate("squareness", across * float(found[k]), half, "rad"))
    return rows


def data_of(readings: Readings, stage: int, span: tuple[float, float], other: int = -1,
            other_span: tuple[float, float] = (0.0, 1.0)) -> Data:  # fmt: skip
    """One stage's part of some readings."""
    x = readings.reading[:, stage]
    return Data(
        *span,
        x,
        readings.reference[:, stage] - x,
        readings.flank[:, stage],
        readings.t,
        readings.temperature,
        readings.reading[:, other] if other >= 0 else None,
        other_span,
        readings.target[:, stage],
        x,
    )
