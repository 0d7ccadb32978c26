"""Checks of a rig in motion: directions, coming to rest, a killed process."""

from __future__ import annotations

import math
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any, NamedTuple

from macromicro.control.contract import Finding
from macromicro.rig._driven import LONGEST
from macromicro.rig.contract import failed, safe
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
    try:
        if not fixture.has("encoder"):
            yield heated(fixture, volts)
            return
        with fixture.open() as rig:
            there = stroke(fixture, rig, volts)
            back = stroke(fixture, rig, -volts)
    except Exception as error:
        yield failed("motion", error, "fix what the message names, then run this again")
        return
    found = direction(there, back, volts)
    yield found
    if not found.passed:
        return
    yield _stopping(there, back)
    try:
        yield killed(fixture, volts, there)
    except Exception as error:
        yield failed("killed", error, "leave nothing behind that keeps the rig from being opened")


def stroke(fixture: Fixture, rig: Session, volts: float) -> Stroke:
    """One stroke, and until it rests."""
    dt, quiet = fixture.dt, safe(fixture)
    first = rig.read()
    place, track = first.encoder, [(first.t, first.encoder)]
    for _ in range(round(_STROKE / dt)):
        rig.write(quiet._replace(motor=volts))
        rig.wait(dt)
        sample = rig.read()
        place = _known(sample.encoder, place)
        track.append((sample.t, place))
        if abs(place - first.encoder) >= WAY:
            break
    moved, end, rested = place - first.encoder, place, math.nan
    stopped = still = track[-1][0]
    for _ in range(round(_REST / dt)):
        rig.write(quiet)
        rig.wait(dt)
        sample = rig.read()
        before, place = place, _known(sample.encoder, place)
        still = sample.t if place != before else still
        if sample.t - still >= _STILL:
            rested = still - stopped
            break
    return Stroke(moved, _speed(track), place - end, rested)


def killed(fixture: Fixture, volts: float, before: Stroke) -> Finding:
    """Kill a process that drives the rig, and measure how far it went."""
    what = "killed process"
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
    last = seen[-1] if seen else last
    if ended or math.isnan(first):
        found = f"it ended before it could be killed: {rest[1].strip()[-160:] or 'no motion'}"
        return Finding(what, False, found, f"it must move within {LONGEST:g} s at this voltage")
    time.sleep(max(_DEAD - (time.monotonic() - at), 0.0))
    with fixture.open() as rig:
        place = rig.read().encoder
    if not fixture.counted:
        found = (
            "opened again after SIGKILL; how far it went is not known: its counter does not count "
            "on while it is not open (attribute `counted`). Was there a motion after the kill?"
        )
        return Finding(what, True, found)
    gone = place - last
    powered = abs(gone - before.coasted) / max(abs(before.speed), 1.0)
    found = (
        f"{gone:+.0f} counts in the {_DEAD:g} s after SIGKILL, {before.coasted:+.0f} after a stop: "
        f"its outputs stayed on for about {powered:.2g} s"
    )
    if powered <= 0.5 * _DEAD:
        return Finding(what, True, found)
    remedy = (
        "the outputs stay as they were when the process dies: give the amplifier an enable line "
        "that a watchdog of its own drops"
    )
    return Finding(what, False, found, remedy)


def direction(there: Stroke, back: Stroke, volts: float) -> Finding:
    """Whether counts rise with the motor's voltage."""
    found = f"{volts:g} V: {there.moved:+.0f} counts, {-volts:g} V: {back.moved:+.0f} counts"
    if abs(there.moved) < 2.0 and abs(back.moved) < 2.0:
        return Finding(
            "direction", False, found, "it does not move: a higher --move, or its wiring"
        )
    if there.moved < 0.0 < back.moved:
        remedy = "counts must rise with the motor's voltage: turn over one of the two"
        return Finding("direction", False, found, remedy)
    if not back.moved < 0.0 < there.moved:
        remedy = "it moves one way only: a stop, a stage that sticks, or half of an amplifier"
        return Finding("direction", False, found, remedy)
    return Finding("direction", True, found)


def heated(fixture: Fixture, volts: float) -> Finding:
    """Heat the wires for a second and read the Hall sensor."""
    dt, quiet = fixture.dt, safe(fixture)
    with fixture.open() as rig:
        before = rig.read().hall
        for _ in range(round(_HEAT / dt)):
            rig.write(quiet._replace(ctrl=volts))
            rig.wait(dt)
            after = _known(rig.read().hall, before)
    found = f"{volts:g} V for {_HEAT:g} s: Hall sensor from {before:.4g} to {after:.4g} V"
    if abs(after - before) < 0.02:
        return Finding("heat", False, found, "it does not contract: a higher --move, or its wiring")
    return Finding("heat", True, found)


def _stopping(there: Stroke, back: Stroke) -> Finding:
    if any(math.isnan(s.rested) for s in (there, back)):
        found = f"it still moves {_REST:g} s after its outputs were made safe"
        return Finding("coming to rest", False, found, "0 V must be 0 N: look at the offset")
    worst = max(there, back, key=lambda s: abs(s.coasted))
    found = (
        f"{abs(worst.coasted):.0f} counts in {worst.rested:.2g} s from {worst.speed:.4g} counts/s"
    )
    return Finding("coming to rest", True, found)


def _speed(track: list[tuple[float, float]]) -> float:
    """Speed at the end of a track over `_SPAN`, by the rig's own times; counts/s."""
    end, place = track[-1]
    begin, before = next((at for at in reversed(track) if end - at[0] >= _SPAN), track[0])
    return (place - before) / (end - begin) if end > begin else 0.0


def _known(value: Any, before: float) -> float:
    return before if math.isnan(value) else float(value)
