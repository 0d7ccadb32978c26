"""The guided first power-up of a rig: its steps, each of which asks for confirmation."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

from macromicro.conformance import Finding, failure
from macromicro.rig import _strokes
from macromicro.rig._strokes import ENOUGH, HAND, LIMITS, LONGEST, STILL, Driven
from macromicro.rig.session import Fixture

CTRL = 1.7  # V, for `HEATED`: the virtual wire then contracts by some tenths of a millimetre
HEATED = 1.0  # s
_COOLING = 5.0  # s
_SWUNG = 0.5  # V that the Hall sensor must change by, pushed by hand
_SHOWN = 0.02  # V that it must change by, heated
_NOISE = 0.02  # V, standard deviation at rest
_ENDS = (0.02, 4.98)  # V, of a sensor and converter of 0 to 5 V


class Limits(NamedTuple):
    """Limits of the drive, chosen by the operator."""

    motor: float  # at most, V
    ctrl: float = CTRL  # V, for one second


class Known(NamedTuple):
    """Results of earlier steps."""

    upward: float = math.nan  # V that the stage breaks away at
    downward: float = math.nan  # NaN as long as that is not known
    sense: bool = False  # whether a hand showed that counts rise towards the upper end


Done = tuple[Finding, Known]


class Step(NamedTuple):
    name: str
    needs: tuple[str, ...]
    by_hand: bool  # whether a person moves something
    said: Callable[[Limits, Known], list[str]]
    go: Callable[[Driven, Limits, Known], Done]
    ready: Callable[[Known], bool] = lambda known: True  # whether what it needs to know is known


def of(fixture: Fixture) -> list[Step]:
    """The steps that a rig has the channels for."""
    return [step for step in _STEPS if fixture.has(*step.needs)]


def _encoder(driven: Driven, limits: Limits, known: Known) -> Done:
    first = driven.look().place
    last = driven.run(lambda t: {}, lambda s: abs(s.place - first) >= ENOUGH, HAND)[-1].place
    moved = last - first
    if moved >= ENOUGH:
        found = f"counts rise towards the upper end: {moved:+.0f}"
        return Finding("encoder", True, found), known._replace(sense=True)
    if moved <= -ENOUGH:
        remedy = "swap its channels A and B, then start again"
        found = f"counts fall towards the upper end: {moved:+.0f}"
        return Finding("encoder", False, found, remedy), known
    remedy = (
        "its supply, ground and both channels: with one channel alone it counts to and fro in place"
    )
    return Finding("encoder", False, f"{moved:+.0f} counts in {HAND:g} s", remedy), known


def _direction(driven: Driven, limits: Limits, known: Known) -> Done:
    up, there = _strokes.breakaway(driven, 1.0, limits.motor)
    driven.rest(0.5)
    down, back = _strokes.breakaway(driven, -1.0, limits.motor)
    driven.rest(0.5)
    found = f"at {up:.2g} V {there:+.0f} counts, at {down:.2g} V {back:+.0f} counts"
    if abs(there) < 2.0 and abs(back) < 2.0:
        remedy = "the amplifier's supply and enable line, the motor's wires; or a higher --move"
        return Finding("direction", False, f"it does not move: {found}", remedy), known
    if there < 0.0 < back:
        remedy = "swap the motor's wires" + ("" if known.sense else ", or A and B")
        found = f"counts fall with a positive voltage: {found}"
        return Finding("direction", False, found, remedy), known
    if not back < 0.0 < there:
        remedy = "a stop, a stage that sticks, or half of an amplifier; or a higher --move"
        return Finding("direction", False, f"it moves one way only: {found}", remedy), known
    found = f"counts rise with the motor's voltage: it breaks away at {up:.2g} V and {down:.2g} V"
    return Finding("direction", True, found), known._replace(upward=up, downward=down)


def _pushing(breakaway: float, limits: Limits) -> float:
    """A voltage with margin for higher friction."""
    volts = min(1.3 * abs(breakaway) + 0.2, limits.motor)
    return math.copysign(volts, breakaway)


def _ends(driven: Driven, limits: Limits, known: Known) -> Done:
    before = driven.look()
    if before.tripped:
        remedy = "a switch that is free must close its contact: its wire, or NC instead of NO"
        found = f"{', '.join(before.tripped)} tripped in the middle of the travel"
        return Finding("ends", False, found, remedy), known
    down, up = _pushing(known.downward, limits), _pushing(known.upward, limits)
    low = _strokes.to_end(driven, down)
    driven.rest(0.5)
    high = _strokes.to_end(driven, up)
    driven.rest(0.5)
    if low is None or high is None:
        found = f"no end in {LONGEST:g} s at {(down if low is None else up):.2g} V"
        return Finding("ends", False, found, "a higher --move; then the encoder's wires"), known
    _strokes.to_place(driven, down, 0.5 * (low.place + high.place))
    lines = [n for n in LIMITS if n in driven.fixture.channels]
    return _judge(low, high, lines), known


def _judge(low: _strokes.Seen, high: _strokes.Seen, lines: list[str]) -> Finding:
    way = (
        f"{high.place - low.place:.0f} counts from {low.place:.0f} to {high.place:.0f}; "
        "is that the travel?"
    )
    if not lines:
        remedy = ""
        return Finding("ends", True, f"it stands after {way} No limit switches", remedy)
    at = {"limit_low": low.tripped, "limit_high": high.tripped}
    if "limit_high" in low.tripped or "limit_low" in high.tripped:
        told = f"{', '.join(low.tripped) or 'none'} at the lower end, " + (
            f"{', '.join(high.tripped) or 'none'} at the upper end"
        )
        return Finding("ends", False, told, "swap the two switches, or their wires")
    silent = [name for name in lines if name not in at[name]]
    if silent:
        found = f"{', '.join(silent)} did not trip before the stage stood; {way}"
        return Finding("ends", False, found, "the switch's place, or its wire to the input")
    return Finding("ends", True, f"{' and '.join(lines)} tripped, each at its end; {way}")


def _hall(driven: Driven, limits: Limits, known: Known) -> Done:
    seen = [s.hall for s in driven.rest(0.5)]
    mean = sum(seen) / len(seen)
    noise = math.sqrt(sum((v - mean) ** 2 for v in seen) / len(seen))
    if math.isnan(mean) or not noise <= _NOISE:
        found = f"{mean:.3g} V with a noise of {1e3 * noise:.2g} mV"
        return Finding(
            "Hall sensor", False, found, "its supply, ground, and a shielded wire"
        ), known
    track = driven.run(lambda t: {}, lambda s: False, HAND)
    low, high = min(s.hall for s in track), max(s.hall for s in track)
    found = f"{low:.3g} to {high:.3g} V pushed by hand, noise {1e3 * noise:.2g} mV"
    if high - low < _SWUNG:
        remedy = "the magnets' place and which way round they are, then the sensor's wires"
        return Finding("Hall sensor", False, found, remedy), known
    if low >= 0.0 and (low < _ENDS[0] or high > _ENDS[1]):
        remedy = "it reaches an end of 0 to 5 V: a wider gap, or the magnets moved along the travel"
        return Finding("Hall sensor", False, found, remedy), known
    return Finding("Hall sensor", True, found), known


def _heat(driven: Driven, limits: Limits, known: Known) -> Done:
    before = driven.look().hall
    track = driven.run(lambda t: {"ctrl": limits.ctrl}, lambda s: False, HEATED)
    track += driven.rest(_COOLING)
    peak = max((s.hall for s in track), key=lambda v: abs(v - before))
    found = (
        f"CTRL {limits.ctrl:g} V for {HEATED:g} s: Hall sensor from {before:.3g} to {peak:.3g} V"
    )
    if not abs(peak - before) >= _SHOWN:
        remedy = "the wire's driver, its supply, the crimps; then a higher --heat"
        return Finding("heat", False, f"it does not contract; {found}", remedy), known
    left = abs(track[-1].hall - before) / abs(peak - before)
    found = f"{found}, {100.0 * left:.0f} % of it left after {_COOLING:g} s"
    if left > 0.5:
        remedy = "it must cool with the driver off: is the driver off at 0 V? Is the spring tight?"
        return Finding("heat", False, found, remedy), known
    return Finding("heat", True, f"the wire contracts and lets go; {found}"), known


_STEPS = (
    Step("encoder", ("encoder",), True, lambda limits, known: [
        "encoder: all outputs stay off. Push the stage by hand towards the end that will be the",
        f"  upper one, {ENOUGH:g} counts or more, within {HAND:g} s of your answer.",
    ], _encoder),
    Step("direction", ("encoder",), False, lambda limits, known: [
        "direction: the motor's voltage rises from 0 by 1 V each second until the stage has moved",
        f"  {_strokes.BREAK:g} counts, to {limits.motor:g} V at most; then the same with the other",
        "  sign. Put the stage in the middle of its travel, a hand at the switch of the supply.",
    ], _direction),
    Step("ends", ("encoder",), False, lambda limits, known: [
        f"ends: the motor at {_pushing(known.downward, limits):.2g} V, until a limit switch trips",
        f"  or the stage stands for {STILL:g} s, {LONGEST:g} s at most; then at "
        f"{_pushing(known.upward, limits):.2g} V to the other end,",
        "  and back to the middle. It moves over its whole travel: keep your fingers away.",
    ], _ends, lambda known: not math.isnan(known.upward)),
    Step("Hall sensor", ("hall",), True, lambda limits, known: [
        "Hall sensor: all outputs stay off. Let it stand for half a second, then push the platform",
        f"  gently by hand through its travel and back, for {HAND:g} s.",
    ], _hall),
    Step("heat", ("hall",), False, lambda limits, known: [
        f"heat: CTRL {limits.ctrl:g} V for {HEATED:g} s, then {_COOLING:g} s off. The wire gets",
        "  hot: do not touch it. Nothing may hold the platform.",
    ], _heat),
)  # fmt: skip


GO, SKIP, END = "go", "skip", "end"
Ask = Callable[[Step, list[str]], str]


def walk(fixture: Fixture, limits: Limits, ask: Ask) -> Iterator[Finding]:
    """Walk through the steps that a rig has the channels for; it is closed between the steps."""
    known, found = Known(), []
    skipped, without = [], []
    ended = False
    for step in of(fixture):
        if not step.ready(known):
            without.append(step.name)
            continue
        answer = SKIP if ended else ask(step, step.said(limits, known))
        ended = ended or answer == END
        if answer != GO:
            skipped.append(step.name)
            continue
        each, known = _walk_step(fixture, step, limits, known)
        found.append(each)
        yield each
    yield _sum(found, skipped, without)


def _walk_step(fixture: Fixture, step: Step, limits: Limits, known: Known) -> Done:
    try:
        with fixture.open() as rig:
            return step.go(Driven(fixture, rig), limits, known)
    except Exception as error:
        remedy = "fix what the message names, then begin again"
        return failure(step.name, error, remedy), known


def _sum(found: list[Finding], skipped: list[str], without: list[str]) -> Finding:
    right = [each.what for each in found if each.passed]
    wrong = [each.what for each in found if not each.passed]
    parts = [f"right: {', '.join(right)}" if right else "nothing was found right"]
    for words, names in (("not right", wrong), ("skipped", skipped)):
        parts += [f"{words}: {', '.join(names)}"] if names else []
    parts += [f"not looked at without a direction: {', '.join(without)}"] if without else []
    remedy = "" if not wrong else f"start with {wrong[0]}: later steps may depend on it"
    if not wrong and not right:
        remedy = "nothing was looked at: answer y where the rig may do what is said"
    return Finding("walk", bool(right) and not wrong, "; ".join(parts), remedy)
