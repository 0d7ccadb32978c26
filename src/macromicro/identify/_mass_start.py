"""Starting points for a mass: inverse dynamics, and the frequency of its spectrum."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.identify._moved_mass import CORNER, Model, located
from macromicro.identify.axis_inverse import differences
from macromicro.identify.runs import Run
from macromicro.models.mass import Axis, late

_ZONES = np.linspace(0.0, 0.7, 15)  # dead zones tried, parts of the largest force
_LAGS = (0, 1, 2, 3, 5, 8, 12, 18, 27, 40, 60)  # delays tried, samples
_FADES = (0.01, 0.02, 0.04, 0.08, 0.15, 0.3)  # Stribeck speeds tried, parts of the top speed
_STILL = 0.02  # of the top speed
_PADDED = 8  # times the record's length: the spectrum's grid
_NO_COLUMN = ("dead_zone", "lag", "stribeck_speed")
_USUAL = 0.08  # Stribeck speed of a first fit, part of the top speed


class _Table(NamedTuple):
    columns: Array  # what a unit of each parameter adds to the force
    force: Array
    place: Array
    record: Array  # number of each row's record


def begins(records: Sequence[Run], model: Model) -> list[Axis]:
    """Starting points, the likeliest first."""
    checked(records, model)
    first = _first(records, model)
    found = [first]
    if "spring" in model.names:
        tone = max((_tone(r) for r in records), key=lambda one: one[1])[0]
        found.append(first._replace(spring=first.mass * (2.0 * math.pi * tone) ** 2))
    elif "mass" in model.names:
        found.append(first._replace(mass=2.0 * first.mass, viscous=0.0))
    if "stribeck" in model.names:
        top = max(float(np.abs(located(r, model.speed)[1]).max()) for r in records)
        late_records = [r._replace(u=late(r.u, first.lag / r.dt)) for r in records]
        tried = [_regressed(_table(late_records, model, part * top), model) for part in _FADES]
        likely = sorted(zip([error for error, _ in tried], range(len(tried)), strict=True))[:2]
        found = [
            tried[k][1]._replace(stribeck_speed=_FADES[k] * top, lag=first.lag) for _, k in likely
        ]
    return found


def checked(records: Sequence[Run], model: Model) -> None:
    driven = "mass" in model.names
    for k, r in enumerate(records):
        if np.ptp(r.x) == 0.0:
            raise ProblemError(
                f"record[{k}]", f"the output is constant at {r.x[0]:g}", "Record a motion."
            )
        if driven and np.ptp(r.u) == 0.0 and r.u[0] == 0.0 and len(records) == 1:
            raise ProblemError(
                f"record[{k}].u",
                "the input is 0 throughout",
                "Record an input, or omit the column u.",
            )


def _first(records: Sequence[Run], model: Model) -> Axis:
    """Least squares for the force, at the delay and dead zone that leave least."""
    best: tuple[float, Axis] | None = None
    for lag in _LAGS if "lag" in model.names else (0,):
        pushed = [r._replace(u=late(r.u, lag)) for r in records]
        error, axis = _regressed(_table(pushed, model), model)
        if best is None or error < best[0]:
            best = error, axis._replace(lag=lag * records[0].dt if lag else axis.lag)
    assert best is not None
    return best[1]


def _table(records: Sequence[Run], model: Model, fades: float | None = None) -> _Table:
    parts, limit = [], model.fixed.limit
    for number, r in enumerate(records):
        place, _ = located(r, model.speed)
        rows = differences(r._replace(x=place), r.u, CORNER / r.dt, 1)
        moves = np.abs(rows.v) > _STILL * np.abs(rows.v).max()
        speed = fades or _USUAL * float(np.abs(rows.v).max())
        made = {
            "mass": rows.a,
            "viscous": rows.v,
            "coulomb": np.sign(rows.v),
            "asymmetry": np.abs(rows.v),
            "offset": np.ones_like(rows.v),
            "stribeck": np.sign(rows.v) * np.exp(-((rows.v / speed) ** 2)),
            "spring": place,
            "sine": np.sin(place),
            "cosine": np.cos(place),
        }
        columns = np.stack([made[n] for n in model.names if n not in _NO_COLUMN], axis=1)
        force = np.clip(r.u, -limit, limit) if "mass" in model.names else -rows.a
        parts.append(
            _Table(columns[moves], force[moves], place[moves], np.full(moves.sum(), number))
        )
    table = _Table(*(np.concatenate(each) for each in zip(*parts, strict=True)))
    if "spring" in model.names and "offset" not in model.names:
        # Of speeds the place is known but for a constant, each record its own.
        own = np.equal.outer(table.record, np.arange(len(records))).astype(np.float64)
        table = table._replace(columns=np.hstack([table.columns, own]))
    return table


def _regressed(table: _Table, model: Model) -> tuple[float, Axis]:
    """Error of the force, as part of it, and the parameters."""
    names = [n for n in model.names if n not in _NO_COLUMN]
    size = np.linalg.norm(table.columns, axis=0)
    even = table.columns / np.where(size > 0.0, size, 1.0)
    top = float(np.abs(table.force).max())
    best: tuple[float, Array, float] | None = None
    for zone in _ZONES * top if "dead_zone" in model.names else (0.0,):
        force = np.sign(table.force) * np.maximum(np.abs(table.force) - zone, 0.0)
        theta = np.linalg.lstsq(even, force, rcond=None)[0]
        error = float(np.mean((force - even @ theta) ** 2)) / max(float(np.var(force)), 1e-300)
        if best is None or error < best[0]:
            best = error, theta / np.where(size > 0.0, size, 1.0), float(zone)
    assert best is not None
    error, theta, zone = best
    found = dict(zip(names, theta.tolist(), strict=False))
    for name in ("mass", "viscous", "coulomb", "stribeck", "spring"):
        if name in found:
            found[name] = max(found[name], 1e-6 if name == "mass" else 0.0)
    if found.get("spring") == 0.0:
        reach = max(float(np.abs(table.place).max()), 1e-300)
        found["spring"] = 1e-3 * top / reach
    if "dead_zone" in model.names:
        found["dead_zone"] = max(zone, 0.02 * top)
    return error, model.fixed._replace(**found)


def _tone(run: Run) -> tuple[float, float]:
    """Frequency of the highest spectral peak of the output, Hz, and its size."""
    y = run.x - np.mean(run.x)
    size = np.abs(np.fft.rfft(y * np.hanning(len(y)), _PADDED * len(y)))
    size[: _PADDED // 2] = 0.0
    k = int(size.argmax())
    return k / (_PADDED * len(y) * run.dt), float(size[k]) / max(float(size.sum()), 1e-300)
