"""Checks of a rig: at rest its channels, units, time, rate and stop; then in motion."""

from __future__ import annotations

import math
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from macromicro.conformance import Broken, Checks, Finding, failure, perform, require
from macromicro.rig._driven import LONGEST
from macromicro.rig._strokes import Driven, Seen, Standing, safe
from macromicro.rig.cards._wiring import DIGITAL, ROLES
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
    trips: list[float]  # how long orders and their answers took, s; none without such a link
    stopped: float  # how long a second stop took, s


def check(fixture: Fixture) -> Iterator[Finding]:
    """Open a rig and check everything that shows at rest."""
    try:
        with fixture.open() as rig:
            watched = _watch(fixture, rig)
    except Exception as error:
        yield failure("open", error, "fix what the message names, then run this again")
        return
    yield Finding("open", True, f"{fixture.kind}, {len(watched.samples)} readings, closed again")
    linked = () if watched.trips else ("link",)
    checks = [each for each in _AT_REST if each[0] not in linked]
    yield from perform(checks, fixture, watched)
    try:
        with fixture.open() as rig:
            rig.read()
    except Exception as error:
        remedy = "leave in __exit__ what __enter__ opens: a port, a lock, a task"
        yield failure("again", error, remedy)
        return
    yield Finding("again", True, "opened and read again")


def _watch(fixture: Fixture, rig: Session) -> Watched:
    """Read an opened rig for a while, its outputs safe, and stop it twice."""
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
    trips = rig.round_trips()
    rig.stop()
    asked = time.perf_counter()
    rig.stop()
    stopped = time.perf_counter() - asked
    return Watched(samples, clock, seen - starts, wrote - seen, np.diff(starts), trips, stopped)


def _channels(fixture: Fixture, watched: Watched) -> str:
    silent = [c for c in fixture.channels if np.isnan(_values(watched.samples, c)).all()]
    found = f"no value of {', '.join(silent)} in {len(watched.samples)} readings"
    require(not silent, found, "connect it, or leave it out of `channels`")
    fields = watched.samples[0]._fields
    extra = [
        c
        for c in fields[1:]
        if c not in fixture.channels and not np.isnan(_values(watched.samples, c)).all()
    ]
    found = f"values of {', '.join(extra)}, which `channels` does not name"
    require(not extra, found, "name it in `channels`, or give NaN for it")
    asked = [] if fixture.kind != BENCH else list(_COSTS)[: None if fixture.has("hall") else 2]
    without = [f"no {c}: {_COSTS[c]}" for c in asked if c not in fixture.channels]
    return ", ".join(fixture.channels) + "".join(f"; {text}" for text in without)


def _units(fixture: Fixture, watched: Watched) -> str:
    for channel in fixture.channels:
        seen = _values(watched.samples, channel)
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
    return ", ".join(f"{c} {_values(watched.samples, c)[-1]:.6g}" for c in fixture.channels)


def _time(fixture: Fixture, watched: Watched) -> str:
    t, dt = _values(watched.samples, "t"), fixture.dt
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
        missed = int(np.sum(np.rint(np.diff(_values(watched.samples, "t")) / dt) - 1.0))
    found = f"{spans}, {missed} of {len(watched.period)} missed; {calls}"
    remedy = "end other programs, or permit real-time priority: macromicro doctor"
    if sum(work) > 0.7e6 * dt:
        remedy = (
            "the card or link is too slow for this period: fewer channels, or a board that "
            "closes the loop itself"
        )
    require(missed <= 0.01 * len(watched.period), found, remedy)
    return found


def _link(fixture: Fixture, watched: Watched) -> str:
    """Whether orders are answered in the next period."""
    median, late, worst = 1e3 * np.quantile(watched.trips, (0.5, 0.99, 1.0))
    spans = f"an answer after {median:.3g} ms, 99 % within {late:.3g}, worst {worst:.3g} ms"
    if late <= 1.5e3 * fixture.dt:
        return f"{spans}: the host may close the loop"
    return f"{spans}: too late for a loop on the host (--loop host); let the board close it"


def _stop(fixture: Fixture, watched: Watched) -> str:
    found = f"stop returned after {1e3 * watched.stopped:.2g} ms, twice"
    remedy = f"it must return within {1e3 * SLOW_STOP:g} ms: let nothing wait in it"
    require(watched.stopped <= SLOW_STOP, found, remedy)
    return found


def _values(samples: list[Any], channel: str) -> Array:
    return np.array([float(getattr(s, channel, math.nan)) for s in samples])


_AT_REST: Checks = (
    ("channels", _channels),
    ("units", _units),
    ("time stamps", _time),
    ("rate", _rate),
    ("link", _link),
    ("stop", _stop),
)


WAY = 200.0  # counts that a stroke covers at most, but for coming to rest
_STROKE = 0.5  # s, at most
_REST = 1.0  # s in which it must have come to rest
_SPAN = 0.02  # s that a speed is taken over
_STILL = 0.1  # s without a count are rest
_DEAD = 0.3  # s from the kill to the next opening
_HEAT = 1.0  # s


class Stroke(NamedTuple):
    """One stroke at a constant voltage."""

    moved: float  # by the end of the voltage, counts
    speed: float  # then, counts/s
    coasted: float  # from there on, counts
    rested: float  # how long it took to rest, s; NaN if it did not


def announce(fixture: Fixture, volts: float) -> list[str]:
    """What `check_moving` will do, for the operator."""
    if not fixture.has("encoder"):
        return [f"{fixture.name}: CTRL {volts:g} V for {_HEAT:g} s"]
    return [
        f"{fixture.name}: motor {volts:g} V, then {-volts:g} V, each until {WAY:g} counts or for "
        f"{_STROKE:g} s;",
        f"  then {volts:g} V in a process that is killed in motion, {_DEAD:g} s without control.",
        "  Put the stage in the middle of its travel, a hand at the emergency stop.",
    ]


def check_moving(fixture: Fixture, volts: float) -> Iterator[Finding]:
    """Move a rig and check it."""
    if not fixture.has("encoder"):
        yield from perform(HEAT, fixture, volts)
        return
    try:
        with fixture.open() as rig:
            there = stroke(fixture, rig, volts)
            back = stroke(fixture, rig, -volts)
    except Exception as error:
        yield failure("motion", error, "fix what the message names, then run this again")
        return
    yield from perform(_IN_MOTION, fixture, volts, there, back, first=("direction",))


def stroke(fixture: Fixture, rig: Session, volts: float) -> Stroke:
    """One stroke, and until it rests."""
    driven = Driven(fixture, rig)
    first = driven.last
    track = driven.run(
        lambda t: {"motor": volts}, lambda s: abs(s.place - first.place) >= WAY, _STROKE
    )
    end, standing = track[-1], Standing(track[-1])
    last = driven.run(lambda t: {}, lambda s: standing.seconds(s) >= _STILL, _REST)[-1]
    rested = standing.moved.t - end.t if standing.seconds(last) >= _STILL else math.nan
    return Stroke(end.place - first.place, _speed(track), last.place - end.place, rested)


def _direction(fixture: Fixture, volts: float, there: Stroke, back: Stroke) -> str:
    """Whether counts rise with the motor's voltage."""
    found = f"{volts:g} V: {there.moved:+.0f} counts, {-volts:g} V: {back.moved:+.0f} counts"
    moves = abs(there.moved) >= 2.0 or abs(back.moved) >= 2.0
    require(moves, found, "it does not move: a higher --move, or its wiring")
    remedy = "counts must rise with the motor's voltage: turn over one of the two"
    require(not there.moved < 0.0 < back.moved, found, remedy)
    remedy = "it moves one way only: a stop, a stage that sticks, or half of an amplifier"
    require(back.moved < 0.0 < there.moved, found, remedy)
    return found


def _stopping(fixture: Fixture, volts: float, there: Stroke, back: Stroke) -> str:
    rested = not any(math.isnan(s.rested) for s in (there, back))
    found = f"it still moves {_REST:g} s after its outputs were made safe"
    require(rested, found, "0 V must be 0 N: look at the offset")
    worst = max(there, back, key=lambda s: abs(s.coasted))
    gone = f"{abs(worst.coasted):.0f} counts in {worst.rested:.2g} s"
    return f"{gone} from {worst.speed:.4g} counts/s"


def _killed(fixture: Fixture, volts: float, there: Stroke, back: Stroke) -> str:
    """Kill a process that drives the rig, and measure how far it went."""
    last, at = _driven(fixture, volts)
    time.sleep(max(_DEAD - (time.monotonic() - at), 0.0))
    with fixture.open() as rig:
        place = rig.read().encoder
    if not fixture.counted:
        return (
            "opened again after SIGKILL; how far it went is not known: its counter does not count "
            "on while it is not open (attribute `counted`). Was there a motion after the kill?"
        )
    gone = place - last
    powered = abs(gone - there.coasted) / max(abs(there.speed), 1.0)
    found = (
        f"{gone:+.0f} counts in the {_DEAD:g} s after SIGKILL, {there.coasted:+.0f} after a stop: "
        f"its outputs stayed on for about {powered:.2g} s"
    )
    remedy = (
        "the outputs stay as they were when the process dies: give the amplifier an enable line "
        "that a watchdog of its own drops"
    )
    require(powered <= 0.5 * _DEAD, found, remedy)
    return found


def _driven(fixture: Fixture, volts: float) -> tuple[float, float]:
    """The last place [counts] that a process told before it was killed, and when that was."""
    command = (sys.executable, "-m", "macromicro.rig._driven", fixture.name, f"{volts!r}", f"{WAY}")
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    first = last = math.nan
    assert child.stdout is not None and child.stderr is not None
    for line in child.stdout:
        last = float(line.split()[1])
        first = last if math.isnan(first) else first
        if abs(last - first) >= 0.5 * WAY:
            break
    ended = child.poll() is not None
    child.kill()
    at = time.monotonic()
    rest = child.communicate()
    seen = [float(line.split()[1]) for line in rest[0].splitlines() if len(line.split()) == 2]
    found = f"it ended before it could be killed: {rest[1].strip()[-160:] or 'no motion'}"
    remedy = f"it must move within {LONGEST:g} s at this voltage"
    require(not ended and not math.isnan(first), found, remedy)
    return seen[-1] if seen else last, at


def _heated(fixture: Fixture, volts: float) -> str:
    """Heat the wires for a second and read the Hall sensor."""
    with fixture.open() as rig:
        driven = Driven(fixture, rig)
        before = driven.last.hall
        after = driven.run(lambda t: {"ctrl": volts}, lambda s: False, _HEAT)[-1].hall
    found = f"{volts:g} V for {_HEAT:g} s: Hall sensor from {before:.4g} to {after:.4g} V"
    remedy = "it does not contract: a higher --move, or its wiring"
    require(abs(after - before) >= 0.02, found, remedy)
    return found


def _speed(track: list[Seen]) -> float:
    """Speed at the end of a track over `_SPAN`, by the rig's own times; counts/s."""
    end = track[-1]
    begin = next((s for s in reversed(track) if end.t - s.t >= _SPAN), track[0])
    return (end.place - begin.place) / (end.t - begin.t) if end.t > begin.t else 0.0


DIRECTION: Checks = (("direction", _direction),)
HEAT: Checks = (("heat", _heated),)
_IN_MOTION: Checks = (*DIRECTION, ("coming to rest", _stopping), ("killed process", _killed))
