"""An axis with switches, index pulse, and a drive with enable and fault lines."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.arrays import Array
from macromicro.columns import Meaning
from macromicro.kernel import kernel
from macromicro.plant import axis, climate, drive_lines, encoder, switches
from macromicro.plant.axis import Axis
from macromicro.plant.drive_lines import Drive, Wiring
from macromicro.plant.switches import Contact, Index, Switch
from macromicro.types import Lines

NOISES = axis.NOISES + 3


class Equipped(NamedTuple):
    axis: Annotated[Axis, Meaning("what moves")]
    low: Annotated[Switch, Meaning("along the travel")]
    high: Annotated[Switch, Meaning("along the travel")]
    home: Annotated[Switch, Meaning("along the travel")]
    pulses: Annotated[Index, Meaning("of its encoder")]
    wiring: Annotated[Wiring, Meaning("of its drive")]


class State(NamedTuple):
    axis: Annotated[axis.State, Meaning("what moves")]
    low: Annotated[Contact, Meaning("the switches")]
    high: Annotated[Contact, Meaning("the switches")]
    home: Annotated[Contact, Meaning("the switches")]
    pulse: Annotated[
        float,
        Meaning("index pulse that came in the last period, as the encoder has it, or NaN", "m"),
    ]
    drive: Annotated[Drive, Meaning("the drive")]


def at_rest(p: Equipped) -> State:
    """At rest at 0, its drive on and cold."""
    body, free = axis.at_rest(p.axis), Contact(0.0, 0.0)
    x = axis.place(p.axis, body)
    low, high, home = (switches.moved(each, free, x, 0.0) for each in (p.low, p.high, p.home))
    return State(body, low, high, home, math.nan, Drive(1.0, p.wiring.rise, 0.0, 0.0))


@kernel
def measured(p: Equipped, s: State, noise: Array, k: int) -> float:
    return axis.measured(p.axis, s.axis, noise, k)


@kernel
def lines(p: Equipped, s: State) -> Lines:
    reading = p.axis.reading.encoder
    index = math.nan
    if not math.isnan(s.pulse):
        index = encoder.count(reading, s.pulse + 0.5 * reading.pitch)
    enabled = 1.0
    if p.wiring.enable == 1 and not drive_lines.ready(p.wiring, s.drive):
        enabled = 0.0
    degrees = climate.shown(p.axis.climate, s.axis.degrees)
    return Lines(s.low.on, s.high.on, s.home.on, index, s.drive.fault, enabled, degrees)


@kernel
def asked(p: Equipped, s: State, enable: Annotated[float, Meaning("0 or 1")]) -> State:
    """The state with the drive's enable input on or off."""
    drive = Drive(enable, s.drive.on, s.drive.heat, s.drive.fault)
    return State(s.axis, s.low, s.high, s.home, s.pulse, drive)


@kernel
def advance(
    p: Equipped,
    s: State,
    effort: Annotated[float, Meaning("at the D/A", "V")],
    noise: Array,
    k: int,
    dt: float,
) -> State:
    """As `axis.advance`; a disabled drive gives 0 V."""
    given = effort if drive_lines.ready(p.wiring, s.drive) else 0.0
    body = axis.advance(p.axis, s.axis, given, noise, k, dt)
    x = axis.place(p.axis, body)
    before, after = s.axis.xm, body.xm
    if p.axis.reading.at_load == 1:
        before, after = axis.place(p.axis, s.axis), x
    return State(
        body,
        switches.moved(p.low, s.low, x, noise[k, 1]),
        switches.moved(p.high, s.high, x, noise[k, 2]),
        switches.moved(p.home, s.home, x, noise[k, 3]),
        switches.passed(p.pulses, before, after),
        drive_lines.advanced(p.wiring, s.drive, body.i, dt),
    )


@kernel
def truth(p: Equipped, s: State) -> axis.Truth:
    return axis.truth(p.axis, s.axis)
