"""Checks of a rig at rest: channels, units, time, rate and stop. In motion: `contract_moving`."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from macromicro.conformance import Broken, Checks, Finding, failed, performed, require
from macromicro.rig.cards._roles import DIGITAL, ROLES
from macromicro.rig.session import BENCH, Fixture, Session

SHORTEST = 0.5  # s that a rig is watched, and at least so many readings:
LEAST = 25
SLOW_STOP = 0.05  # s
Array = NDArray[np.float64]

_WIDE = {  # where a value beyond means another unit
    "hall": (15.0, "V"),
    "laser": (1.0, "m"),
    "thermocouple": (1000.0, "degC"),
    "room": (60.0, "degC"),
}
_COSTS = {  # what a bench without a channel cannot do; those of the micro-stage behind `hall`
    "encoder": "no macro-stage",
    "hall": "no micro-stage",
    "laser": "micro moves are judged by the Hall sensor",
    "extend": "the guard cannot see the wires at their end",
    "contract": "the guard cannot see the wires at their end",
}


class Watched(NamedTuple):
    """Samples of a rig at rest."""

    samples: list[Any]  # one a period
    clock: Array  # the rig's clock just behind each reading, s
    # reading, writing, period: how long each took, s
    reading: Array
    writing: Array
    period: Array


def safe(fixture: Fixture) -> Any:
    written = ROLES[fixture.kind].written
    return written(*[0.0] * len(written._fields))


def check(fixture: Fixture) -> Iterator[Finding]:
    """Open a rig and check everything that shows at rest."""
    try:
        with fixture.open() as rig:
            watched = watch(fixture, rig)
            trips = rig.round_trips()
            rig.stop()
            asked = time.perf_counter()
            rig.stop()
            stopped = time.perf_counter() - asked
    except Exception as error:
        yield failed("open", error, "fix what the message names, then run this again")
        return
    yield Finding("open", True, f"{fixture.kind}, {len(watched.samples)} readings, closed again")
    yield from performed(_CHECKS, fixture, watched)
    if trips:
        yield Finding("link", True, _link(fixture, trips))
    yield from performed((("stop", _stop),), stopped)
    try:
        with fixture.open() as rig:
            rig.read()
    except Exception as error:
        remedy = "leave in __exit__ what __enter__ opens: a port, a lock, a task"
        yield failed("again", error, remedy)
        return
    yield Finding("again", True, "opened and read again")


def _stop(seconds: float) -> str:
    found = f"stop returned after {1e3 * seconds:.2g} ms, twice"
    remedy = f"it must return within {1e3 * SLOW_STOP:g} ms: let nothing wait in it"
    require(seconds <= SLOW_STOP, found, remedy)
    return found


def watch(fixture: Fixture, rig: Session) -> Watched:
    """Read an opened rig for a while, its outputs safe."""
    periods, quiet = max(round(SHORTEST / fixture.dt), LEAST), safe(fixture)
    samples, marks = [], np.empty((periods + 1, 4))
    for k in range(periods + 1):
        began = time.perf_counter()
        samples.append(rig.read())
        read, at = time.perf_counter(), rig.now()
        rig.write(quiet)
        marks[k] = began, read, time.perf_counter(), at
        rig.wait(fixture.dt)
    starts, seen, wrote, clock = marks.T
    return Watched(samples, clock, seen - starts, wrote - seen, np.diff(starts))


def _channels(fixture: Fixture, watched: Watched) -> str:
    silent = [c for c in fixture.channels if np.isnan(values(watched.samples, c)).all()]
    found = f"no value of {', '.join(silent)} in {len(watched.samples)} readings"
    require(not silent, found, "connect it, or leave it out of `channels`")
    fields = watched.samples[0]._fields
    extra = [
        c
        for c in fields[1:]
        if c not in fixture.channels and not np.isnan(values(watched.samples, c)).all()
    ]
    found = f"values of {', '.join(extra)}, which `channels` does not name"
    require(not extra, found, "name it in `channels`, or give NaN for it")
    asked = [] if fixture.kind != BENCH else list(_COSTS)[: None if fixture.has("hall") else 2]
    without = [f"no {c}: {_COSTS[c]}" for c in asked if c not in fixture.channels]
    return ", ".join(fixture.channels) + "".join(f"; {text}" for text in without)


def _units(fixture: Fixture, watched: Watched) -> str:
    for channel in fixture.channels:
        seen = values(watched.samples, channel)
        seen = seen[~np.isnan(seen)]
        worst = float(seen[np.argmax(np.abs(seen))]) if len(seen) else 0.0
        role = ROLES[fixture.kind].inputs.get(channel)
        if role is not None and role.signal == DIGITAL:
            known = bool(np.isin(seen, (0.0, 1.0)).all())
            require(known, f"{channel} is {worst:g}", "0 or 1, NaN where it is not known")
        elif channel in _WIDE:
            most, unit = _WIDE[channel]
            remedy = f"give it in {unit}: at most {most:g}"
            require(abs(worst) <= most, f"{channel} is {worst:g}", remedy)
        else:
            for odd in seen[seen != np.round(seen)].tolist():
                raise Broken(f"{channel} is {odd!r}", "give whole counts of the encoder")
    return ", ".join(f"{c} {values(watched.samples, c)[-1]:.6g}" for c in fixture.channels)


def _time(fixture: Fixture, watched: Watched) -> str:
    t, dt = values(watched.samples, "t"), fixture.dt
    steps = np.diff(t)
    k = int(np.argmin(steps > 0.0))
    found = f"t goes from {t[k]:g} to {t[k + 1]:g} s from one reading to the next"
    remedy = "give the time of each reading on the rig's own clock, in s"
    require(bool((steps > 0.0).all()), found, remedy)
    off = float(np.max(np.abs(watched.clock - t)))
    found = f"t is up to {off:.3g} s from the clock's `now`"
    require(off <= max(2.0 * dt, 0.01), found, "take both from the same clock, in s")
    mean = float(t[-1] - t[0]) / len(steps)
    found = f"a period of {1e3 * mean:.4g} ms in the mean, for {1e3 * dt:g} ms"
    remedy = "let `wait` return at absolute deadlines, `dt` apart"
    require(abs(mean / dt - 1.0) <= 0.02, found, remedy)
    return f"{1e3 * mean:.4g} ms a period in the mean, t rises"


def _rate(fixture: Fixture, watched: Watched) -> str:
    dt = fixture.dt
    median, late, worst = np.quantile(watched.period, (0.5, 0.99, 1.0))
    work = 1e6 * float(np.median(watched.reading)), 1e6 * float(np.median(watched.writing))
    calls = f"a reading takes {work[0]:.3g} us, writing {work[1]:.3g} us"
    if median < 0.5 * dt:
        return f"its clock is virtual, {dt / median:.3g} times as fast as time; {calls}"
    spans = f"period {1e3 * median:.4g} ms, 99 % below {1e3 * late:.4g}, worst {1e3 * worst:.4g} ms"
    missed = int(np.sum(watched.period > 1.5 * dt))
    if fixture.timed:  # the computer may be late, as long as each reading is taken
        missed = int(np.sum(np.rint(np.diff(values(watched.samples, "t")) / dt) - 1.0))
    found = f"{spans}, {missed} of {len(watched.period)} missed; {calls}"
    remedy = "end other programs, or permit real-time priority: macromicro doctor"
    if sum(work) > 0.7e6 * dt:
        remedy = (
            "the card or link is too slow for this period: fewer channels, or a board that "
            "closes the loop itself"
        )
    require(missed <= 0.01 * len(watched.period), found, remedy)
    return found


def _link(fixture: Fixture, trips: list[float]) -> str:
    """Whether orders are answered in the next period."""
    median, late, worst = 1e3 * np.quantile(trips, (0.5, 0.99, 1.0))
    spans = f"an answer after {median:.3g} ms, 99 % within {late:.3g}, worst {worst:.3g} ms"
    if late <= 1.5e3 * fixture.dt:
        return f"{spans}: the host may close the loop"
    return f"{spans}: too late for a loop on the host (--loop host); let the board close it"


_CHECKS: Checks = (
    ("channels", _channels),
    ("units", _units),
    ("time stamps", _time),
    ("rate", _rate),
)


def values(samples: list[Any], channel: str) -> Array:
    return np.array([float(getattr(s, channel, math.nan)) for s in samples])
