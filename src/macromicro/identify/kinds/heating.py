"""Records of heating and cooling steps, sorted by voltage, as temperatures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.columns import Column
from macromicro.errors import InputError
from macromicro.hysteresis.table import FodTable
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.picking import Picked, railed, runs
from macromicro.identify.runs import Run, checked
from macromicro.identify.thermal import CoolingFit, StepRecord, cooling, inferred_step
from macromicro.recording import Recording

NEAR_STOP = 0.97  # of the table's range: beyond it a position shows no temperature
_COLUMNS = (Column("t", "s", ""), Column("ctrl", "V", ""), Column("laser", "um", ""))


class Source(NamedTuple):
    """How a temperature is found.

    Attributes
    ----------
    table : FodTable | None
        From position; None: it was measured.
    ambient : float | None
        deg C; None: the first temperature of each record, or 25 deg C.
    """

    table: FodTable | None
    ambient: float | None


class Cold(NamedTuple):
    """What was seen before a step.

    Attributes
    ----------
    mean : float
        Of a temperature, deg C, or a position, mm.
    samples : int
        How many, with the one at which the step begins.
    """

    mean: float
    samples: int


class Steps(NamedTuple):
    """Runs by voltage (V).

    Attributes
    ----------
    held : dict[float, list[Run]]
        Those of a constant voltage.
    cooled : dict[float, list[Run]]
        Those that end at 0 V.
    cold : dict[float, list[Cold]]
        What was seen before the steps of each voltage.
    """

    held: dict[float, list[Run]]
    cooled: dict[float, list[Run]]
    cold: Mapping[float, list[Cold]] = MappingProxyType({})


def steps(tables: Sequence[Picked], role: str) -> Steps:
    """Sort all runs by voltage.

    Parameters
    ----------
    tables : Sequence[Picked]
        Tables with the roles t, u and `role`.
    role : str
        "T" or "x": what x of a run holds, temperature (deg C) or position (mm).

    Returns
    -------
    Steps
        By voltage.

    Raises
    ------
    InputError
        No run is an open-loop step from cold.
    """
    held: dict[float, list[Run]] = {}
    cooled: dict[float, list[Run]] = {}
    cold: dict[float, list[Cold]] = {}
    left = 0
    for table in tables:
        for part in runs(table):
            railed(part[role], f"{table.file}, {role}")
            run = checked(part["t"], part["u"], part[role], table.file, 50)
            first = int(np.argmax(run.u != 0.0))
            before = Cold(float(run.x[: first + 1].mean()), first + 1)
            run = Run(run.t[first:] - run.t[first], run.u[first:], run.x[first:])
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
        found = "no run that steps to a voltage and stays there"
        raise InputError(tables[0].file, found, "open-loop steps from cold")
    for volts, group in cooled.items():  # a fall's rise will do where there is nothing better
        if volts not in held:
            cut = [int(np.argmax(r.u == 0.0)) for r in group]
            held[volts] = [Run(*(c[:k] for c in r)) for r, k in zip(group, cut, strict=True)]
    return Steps(held, cooled, cold)


def _alike(group: list[Run]) -> list[Run]:
    """The longest runs of a group with the first one's sample time, cut to one length."""
    long = max(r.t[-1] for r in group)
    kept = [r for r in group if r.t[-1] > 0.9 * long]
    kept = [r for r in kept if abs(r.dt - kept[0].dt) < 1e-3 * kept[0].dt]
    n = min(len(r.t) for r in kept)
    return [Run(r.t[:n], r.u[:n], r.x[:n]) for r in kept]


def _recordings(group: list[Run]) -> list[Recording]:
    """Runs of a position [mm] as the recordings that `identify.thermal` takes."""
    return [
        Recording.from_arrays(_COLUMNS, [r.t, r.u, r.x * 1e3], float(f"{r.dt:.9g}"), {})
        for r in group
    ]


def record(group: list[Run], source: Source, cold: Sequence[Cold] = ()) -> StepRecord:
    """The mean of one voltage's runs as temperature rise over ambient.

    Where nobody tells the room's temperature it is the mean of what was measured before the steps,
    and how sure that is by the scatter of the record's samples counts as its error.

    Parameters
    ----------
    group : list[Run]
        Runs of one voltage.
    source : Source
        How a temperature is found.
    cold : Sequence[Cold], optional
        What was seen before the runs; by default their first samples.

    Returns
    -------
    StepRecord
        K.
    """
    group = _alike(group)
    if source.table is not None:
        ambient = 25.0 if source.ambient is None else source.ambient
        return inferred_step(source.table, _recordings(group), ambient)
    mean = np.mean([r.x for r in group], axis=0)
    if source.ambient is not None:
        return StepRecord(group[0].t, mean, mean - source.ambient, np.zeros_like(mean))
    cold = _cold(group, cold)
    error = _scatter(mean) * math.sqrt(np.mean([1.0 / c.samples for c in cold]))
    ambient = _ambient(cold)
    return StepRecord(group[0].t, mean, mean - ambient, np.full_like(mean, error))


def _cold(group: list[Run], cold: Sequence[Cold]) -> Sequence[Cold]:
    """What was seen before the runs, or their first samples."""
    return cold or [Cold(float(r.x[0]), 1) for r in group]


def _ambient(cold: Sequence[Cold]) -> float:
    return float(np.mean([c.mean for c in cold]))


def _scatter(x: Array) -> float:
    """Standard deviation of single samples about the smooth way that they are of: by their second
    differences, whose variance is six times theirs (J. von Neumann, 1941), over the last half."""
    return float(np.sqrt(np.mean(np.diff(x[len(x) // 2 :], 2) ** 2) / 6.0))


def clear_of_stop(step: StepRecord, source: Source) -> bool:
    """Whether the end of a step shows a temperature.

    Parameters
    ----------
    step : StepRecord
        One voltage's mean.
    source : Source
        How a temperature is found.

    Returns
    -------
    bool
        False where a position is near the stop.
    """
    if source.table is None:
        return True
    table = source.table
    return float(step.position.max()) < table.f_low + NEAR_STOP * table.span


def drift(step: StepRecord) -> float:
    """By how much the rise still changed over the last tenth of a record.

    Parameters
    ----------
    step : StepRecord
        One voltage's mean.

    Returns
    -------
    float
        As a share of the rise; NaN for too short a record.
    """
    last = step.t >= step.t[-1] - 0.1 * (step.t[-1] - step.t[0])
    rise = step.rise[last]
    if len(rise) < 10:
        return math.nan
    tenth = max(len(rise) // 5, 1)
    return float(rise[-tenth:].mean() - rise[:tenth].mean()) / max(abs(float(rise[-1])), 1e-12)


def fall(group: list[Run], source: Source, cold: Sequence[Cold] = ()) -> CoolingFit:
    """The cooling constant of (5.9) from one voltage's runs.

    Parameters
    ----------
    group : list[Run]
        Runs that end at 0 V.
    source : Source
        How a temperature is found.
    cold : Sequence[Cold], optional
        As for `record`.

    Returns
    -------
    CoolingFit
        With the exponential that was fitted.

    Raises
    ------
    InputError
        The record does not cover 63 % of the way to ambient.
    """
    group = _alike(group)
    if source.table is not None:
        ambient = 25.0 if source.ambient is None else source.ambient
        return cooling(source.table, _recordings(group), ambient)
    from scipy.optimize import curve_fit

    t, x = group[0].t, np.mean([r.x for r in group], axis=0)
    begin = int(np.argmax(group[0].u == 0.0))
    ambient = _ambient(_cold(group, cold)) if source.ambient is None else source.ambient
    peak = float(x[max(begin - 5, 0) : begin].mean())
    time, rise = t[begin:] - t[begin], x[begin:] - ambient
    done = np.flatnonzero(rise <= (peak - ambient) * math.exp(-1.0))
    if not peak > ambient or not len(done) or done[0] < 5:
        found = f"a fall from {peak:.4g} to {x[-1]:.4g} degC"
        raise InputError("cooling record", found, "one that covers 63 % of the way to ambient")
    last = int(done[0]) + 1
    found_time = curve_fit(
        lambda s, tau: (peak - ambient) * np.exp(-s / tau), time[:last], rise[:last], time[last - 1]
    )[0][0]
    model = (peak - ambient) * np.exp(-time[:last] / found_time)
    nrmse = float(np.sqrt(np.mean((model - rise[:last]) ** 2)) / np.ptp(rise[:last]))
    return CoolingFit(float(time[last - 1]), float(found_time), nrmse, peak)
