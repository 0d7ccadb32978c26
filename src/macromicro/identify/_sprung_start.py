"""Starting points for a sprung drive: inverse dynamics, and the frequency of its spectrum."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.identify.axis_inverse import differences
from macromicro.identify.runs import Run
from macromicro.identify.sprung import Sprung

_CORNER = 0.08  # of the samples' rate: cut-off of positions before they are differentiated
_ZONES = np.linspace(0.0, 0.7, 15)  # dead zones tried, parts of the largest force
_STILL = 0.02  # of the top speed
_FIRST = 12  # samples from which the speed at the start is taken
_PADDED = 8  # times the record's length: the spectrum's grid


def _located(run: Run, speed: bool) -> Run:
    if not speed:
        return run
    step = 0.5 * (run.x[1:] + run.x[:-1]) * run.dt
    return run._replace(x=np.concatenate([[0.0], np.cumsum(step)]))


def begins(
    records: Sequence[Run], names: tuple[str, ...], driven: bool, speed: bool
) -> list[tuple[Sprung, Array]]:
    kept = [_located(r, speed) for r in records]
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
    first = _regressed(kept, names, driven)
    at = np.array([start(r, speed) for r in records])
    found = [(first, at)]
    if "spring" in names:
        tone = max((_tone(r) for r in records), key=lambda one: one[1])[0]
        stiff = first.mass * (2.0 * math.pi * tone) ** 2
        found.append((first._replace(spring=stiff), at))
        if driven:
            found.append((first._replace(mass=2.0 * first.mass, spring=2.0 * first.spring), at))
    else:
        found.append((first._replace(mass=2.0 * first.mass if driven else 1.0, viscous=0.0), at))
    return found


def _regressed(records: Sequence[Run], names: tuple[str, ...], driven: bool) -> Sprung:
    """Least squares for the force, or for the acceleration of a free motion."""
    tables, forces = [], []
    wanted = [n for n in names if n != "dead_zone"]
    for r in records:
        rows = differences(r, r.u, _CORNER / r.dt, 1)
        moves = np.abs(rows.v) > _STILL * np.abs(rows.v).max()
        made = {
            "mass": rows.a,
            "viscous": rows.v,
            "coulomb": np.sign(rows.v),
            "asymmetry": np.abs(rows.v),
            "offset": np.ones_like(rows.v),
            "spring": r.x,
        }
        tables.append(np.stack([made[n] for n in wanted], axis=1)[moves])
        forces.append((r.u if driven else -rows.a)[moves])
    # Of speeds the position is known but for a constant, each record its own.
    table = np.concatenate(tables)
    if "spring" in names and "offset" not in names:
        own = np.zeros((len(table), len(records)))
        stops = np.cumsum([0, *(len(part) for part in tables)])
        for k in range(len(records)):
            own[stops[k] : stops[k + 1], k] = 1.0
        table = np.hstack([table, own])
    force = np.concatenate(forces)
    size = np.sqrt((table**2).sum(axis=0))
    size[size == 0.0] = 1.0
    top = float(np.abs(force).max())
    zones = _ZONES * top if "dead_zone" in names else np.zeros(1)
    best: tuple[float, Array, float] | None = None
    for zone in zones:
        left = force if zone == 0.0 else np.sign(force) * np.maximum(np.abs(force) - zone, 0.0)
        theta = np.linalg.lstsq(table / size, left, rcond=None)[0] / size
        error = float(np.mean((left - table @ theta) ** 2)) / max(float(np.var(left)), 1e-300)
        if best is None or error < best[0]:
            best = error, theta, float(zone)
    assert best is not None
    _, theta, zone = best
    found = dict(zip(wanted, theta.tolist(), strict=False))
    least = 1e-3 * top
    reach = max(float(np.abs(np.concatenate([r.x for r in records])).max()), 1e-300)
    for name, floor in (("mass", 1e-6), ("viscous", 0.0), ("coulomb", 0.0), ("spring", 0.0)):
        if name in found:
            found[name] = max(found[name], floor)
    if found.get("spring") == 0.0:
        found["spring"] = least / reach
    if "dead_zone" in names:
        found["dead_zone"] = max(zone, 0.02 * top)
    return Sprung(**({"mass": 1.0, "viscous": 0.0} | found))


def start(run: Run, speed: bool) -> tuple[float, float]:
    """Initial position and speed from the first samples."""
    if speed:
        return 0.0, float(run.x[:2].mean())
    many = min(_FIRST, len(run.t) // 2)
    slope, level = np.polyfit(run.t[:many] - run.t[0], run.x[:many], 1)
    return float(level), float(slope)


def _tone(run: Run) -> tuple[float, float]:
    """Frequency of the highest spectral peak of the output, Hz, and its size."""
    y = run.x - np.mean(run.x)
    window = np.hanning(len(y))
    size = np.abs(np.fft.rfft(y * window, _PADDED * len(y)))
    size[: _PADDED // 2] = 0.0
    k = int(size.argmax())
    return k / (_PADDED * len(y) * run.dt), float(size[k]) / max(float(size.sum()), 1e-300)


def sizes(records: Sequence[Run], axis: Sprung, names: tuple[str, ...], speed: bool) -> Array:
    place, rate = scales(records, speed, 1.0)
    drive = max(float(np.abs(r.u).max()) for r in records)
    force = max(drive, axis.spring * place, axis.mass * rate)
    usual = {
        "mass": axis.mass,
        "viscous": 0.1 * force / rate,
        "coulomb": 0.05 * force,
        "asymmetry": 0.1 * force / rate,
        "offset": 0.05 * force,
        "spring": force / place,
        "dead_zone": 0.1 * force,
    }
    return np.array([max(abs(getattr(axis, n)), usual[n], 1e-300) for n in names])


def scales(records: Sequence[Run], speed: bool, least: float) -> tuple[float, float]:
    kept = [_located(r, speed) for r in records]
    place = max(float(np.ptp(r.x)) for r in kept) or least
    if speed:
        rate = max(float(np.abs(r.x).max()) for r in records)
    else:
        rate = max(float(np.abs(np.gradient(r.x, r.dt)).max()) for r in records)
    return place, rate or least
