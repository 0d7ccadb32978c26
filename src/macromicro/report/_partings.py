"""Differences of two recordings' columns, on a common time base."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.recording import Recording
from macromicro.recording_format import TIME

_WHOLE = 1e-6  # of a row: nearer to one than that is at it


class Parting(NamedTuple):
    rows: int  # instants that are compared: those of both, each from its own first row
    period: float  # between them, s: the longer of both periods
    t: float | None  # of the first instant in which a shared column differs, s; None if none does
    columns: tuple[str, ...]  # those that differ there
    # those that differ anywhere, in their order; no number in one alone is a difference, too
    differing: tuple[str, ...]
    rms: dict[str, float]  # by column, in its unit, over the instants at which both are numbers
    largest: dict[str, float]  # NaN if there are none
    at: dict[str, float]  # when the difference is largest, s as in the first; NaN if there is none
    # lacking, added: columns that only the first has, and only this one
    lacking: tuple[str, ...]
    added: tuple[str, ...]
    # units of the first and of this one, of columns that both have in different units
    units: dict[str, tuple[str, str]]


def parting(first: Recording, other: Recording, columns: Sequence[str]) -> Parting:
    """Compare a recording with the first.

    The recording with the longer period gives the instants, from the first row of each. The other's
    floats are interpolated linearly; its integers keep the earlier row's value.
    """
    period = max(first.dt, other.dt)
    ends = (len(first) - 1) * first.dt, (len(other) - 1) * other.dt
    rows = 1 + math.floor(min(ends) / period + _WHOLE)
    parted: dict[str, int] = {}
    rms, largest, at = {}, {}, {}
    start = float(first[TIME][0])
    for name in columns:
        a, b = _at(first, name, period, rows), _at(other, name, period, rows)
        apart: Array = np.abs(b - a)
        differs = np.flatnonzero((a != b) & ~(np.isnan(a) & np.isnan(b)))
        if len(differs):
            parted[name] = int(differs[0])
        known = np.flatnonzero(np.isfinite(apart))
        size = apart[known]
        rms[name] = float(np.sqrt(np.mean(size * size))) if len(known) else math.nan
        largest[name] = float(size.max()) if len(known) else math.nan
        most = size.argmax() if len(known) and size.any() else None
        at[name] = math.nan if most is None else round(start + float(known[most]) * period, 9)
    row = min(parted.values(), default=None)
    t = None if row is None else round(start + row * period, 9)
    parts = tuple(n for n, k in parted.items() if k == row)
    return Parting(
        rows, period, t, parts, tuple(parted), rms, largest, at,
        _beyond(first, other), _beyond(other, first), _units(first, other),
    )  # fmt: skip


def _at(recording: Recording, name: str, period: float, rows: int) -> Array:
    """A column at instants a period apart, from its first row."""
    y = recording[name]
    whole = y.dtype.kind != "f"
    y = np.asarray(y, float)
    if math.isclose(recording.dt, period, rel_tol=1e-9):
        return y[:rows]
    place = np.arange(rows) * (period / recording.dt)
    near = np.round(place)
    place = np.where(np.abs(place - near) < _WHOLE, near, place)
    low = np.floor(place).astype(np.intp)
    high = np.minimum(low + 1, len(y) - 1)
    share = place - low
    held: Array = y[low]
    if not whole:
        held = np.where(share > 0.0, (1.0 - share) * held + share * y[high], held)
    return held


def _beyond(one: Recording, other: Recording) -> tuple[str, ...]:
    return tuple(c.name for c in one.columns if c.name not in other)


def _units(first: Recording, other: Recording) -> dict[str, tuple[str, str]]:
    return {
        c.name: (c.unit, other.unit(c.name))
        for c in first.columns
        if c.name in other and other.unit(c.name) != c.unit
    }
