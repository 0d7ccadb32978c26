"""Heating and cooling steps, sorted by voltage, as temperatures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.columns import Column
from macromicro.errors import ProblemError
from macromicro.hysteresis.table import FodTable
from macromicro.identify.heating import (
    CoolingFit,
    StepRecord,
    cooling,
    exponential_fall,
    inferred_step,
)
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.picking import Picked, railed, runs
from macromicro.identify.runs import Run, checked
from macromicro.recording import Recording

_SHORTEST = 4.5  # samples of a fall to 63 %
NEAR_STOP = 0.97  # of the table's range: beyond it a position shows no temperature
_COLUMNS = (Column("t", "s", ""), Column("ctrl", "V", ""), Column("laser", "um", ""))


class Source(NamedTuple):
    table: FodTable | None  # from position; None: it was measured
    ambient: float | None  # deg C; None: the first temperature of each record, or 25 deg C


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
        raise ProblemError(
            tables[0].file,
            "no run steps to a voltage and stays there",
            "Record open-loop steps from cold.",
        )
    for volts, group in cooled.items():  # a fall's rise will do where there is nothing better
        if volts not in held:
            cut = [int(np.argmax(r.u == 0.0)) for r in group]
            held[volts] = [Run(*(c[:k] for c in r)) for r, k in zip(group, cut, strict=True)]
    return Steps(held, cooled, cold)


def _alike(group: list[Run]) -> list[Run]:
    """The longest runs of a group with equal sample times, cut to one length."""
    long = max(r.t[-1] for r in group)
    kept = [r for r in group if r.t[-1] > 0.9 * long]
    kept = [r for r in kept if abs(r.dt - kept[0].dt) < 1e-3 * kept[0].dt]
    n = min(len(r.t) for r in kept)
    return [Run(r.t[:n], r.u[:n], r.x[:n]) for r in kept]


def _recordings(group: list[Run]) -> list[Recording]:
    return [
        Recording.from_arrays(_COLUMNS, [r.t, r.u, r.x * 1e3], float(f"{r.dt:.9g}"), {})
        for r in group
    ]


def record(group: list[Run], source: Source, cold: Sequence[Cold] = ()) -> StepRecord:
    """Mean temperature rise over ambient of one voltage's runs."""
    # An unknown ambient temperature is the mean of the readings before the steps; its error is
    # their scatter.
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
    if source.table is not None:
        ambient = 25.0 if source.ambient is None else source.ambient
        return cooling(source.table, _recordings(group), ambient)
    t, x = group[0].t, np.mean([r.x for r in group], axis=0)
    begin = int(np.argmax(group[0].u == 0.0))
    ambient = _ambient(_cold(group, cold)) if source.ambient is None else source.ambient
    peak = float(x[max(begin - 5, 0) : begin].mean())
    every = np.ones(len(x) - begin, dtype=np.bool_)
    fit = exponential_fall(t[begin:] - t[begin], x[begin:] - ambient, every, peak, ambient)
    if fit is None or fit.time < _SHORTEST * group[0].dt:
        found = f"it falls from {peak:.4g} to {x[-1]:.4g} degC"
        raise ProblemError("cooling record", found, "Record 63 % of the way to ambient or more.")
    return fit
