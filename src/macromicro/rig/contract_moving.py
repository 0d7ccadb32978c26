"""Checks of a rig in motion: directions, coming to rest, a killed process."""

from __future__ import annotations

import math
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import NamedTuple

from macromicro.conformance import Checks, Finding, failed, performed, require
from macromicro.rig._driven import LONGEST
from macromicro.rig._strokes import Driven, Seen
from macromicro.rig.session import Fixture, Session

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


def said(fixture: Fixture, volts: float) -> list[str]:
    """What `check` will do, for the operator."""
    if not fixture.has("encoder"):
        return [f"{fixture.name}: CTRL {volts:g} V for {_HEAT:g} s"]
    return [
        f"{fixture.name}: motor {volts:g} V, then {-volts:g} V, each until {WAY:g} counts or for "
        f"{_STROKE:g} s;",
        f"  then {volts:g} V in a process that is killed in motion, {_DEAD:g} s without control.",
        "  Put the stage in the middle of its travel, a hand at the emergency stop.",
    ]


def check(fixture: Fixture, volts: float) -> Iterator[Finding]:
    """Move a rig and check it."""
    if not fixture.has("encoder"):
        yield from performed(HEAT, fixture, volts)
        return
    try:
        with fixture.open() as rig:
            there = stroke(fixture, rig, volts)
            back = stroke(fixture, rig, -volts)
    except Exception as error:
        yield failed("motion", error, "fix what the message names, then run this again")
        return
    yield from performed(_CHECKS, fixture, volts, there, back, first=("direction",))


def stroke(fixture: Fixture, rig: Session, volts: float) -> Stroke:
    """One stroke, and until it rests."""
    driven = Driven(fixture, rig)
    first = driven.last
    track = driven.run(
        lambda t: {"motor": volts}, lambda s: abs(s.place - first.place) >= WAY, _STROKE
    )
    end = moved = track[-1]

    def still(s: Seen) -> bool:
        nonlocal moved
        moved = s if s.place != moved.place else moved
        return s.t - moved.t >= _STILL

    last = driven.run(lambda t: {}, still, _REST)[-1]
    rested = moved.t - end.t if still(last) else math.nan
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
_CHECKS: Checks = (*DIRECTION, ("coming to rest", _stopping), ("killed process", _killed))
