"""An axis with switches along its way, an index pulse, and a drive with enable and fault lines."""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.arrays import Array
from macromicro.kernel import kernel
from macromicro.plant import axis, drive_lines, encoder, switches
from macromicro.plant.axis import Axis
from macromicro.plant.drive_lines import Drive, Wiring
from macromicro.plant.switches import Contact, Index, Switch
from macromicro.types import Lines

NOISES = axis.NOISES + 3


class Equipped(NamedTuple):
    """Runtime parameters.

    Attributes
    ----------
    axis : Axis
        What moves.
    low, high, home : Switch
        Along its way.
    pulses : Index
        Of its encoder.
    wiring : Wiring
        Of its drive.
    """

    axis: Axis
    low: Switch
    high: Switch
    home: Switch
    pulses: Index
    wiring: Wiring


class State(NamedTuple):
    """State of an axis with lines.

    Attributes
    ----------
    axis : axis.State
        What moves.
    low, high, home : Contact
        The switches.
    pulse : float
        Place of the index pulse that came in the last period, m as the encoder has it, or NaN.
    drive : Drive
        The drive.
    """

    axis: axis.State
    low: Contact
    high: Contact
    home: Contact
    pulse: float
    drive: Drive


def at_rest(p: Equipped) -> State:
    """The axis standing at 0, its drive on and cold.

    Parameters
    ----------
    p : Equipped
        Parameters.

    Returns
    -------
    State
        Its switches as they are there.
    """
    body, free = axis.at_rest(p.axis), Contact(0.0, 0.0)
    x = axis.place(p.axis, body)
    low, high, home = (switches.moved(each, free, x, 0.0) for each in (p.low, p.high, p.home))
    return State(body, low, high, home, math.nan, Drive(1.0, p.wiring.rise, 0.0, 0.0))


@kernel
def measured(p: Equipped, s: State, noise: Array, k: int) -> float:
    """As `axis.measured`.

    Parameters
    ----------
    p : Equipped
        Parameters.
    s : State
        State.
    noise : ndarray, shape (periods, NOISES)
        Standard normal draws.
    k : int
        Their row.

    Returns
    -------
    float
        Counts.
    """
    return axis.measured(p.axis, s.axis, noise, k)


@kernel
def lines(p: Equipped, s: State) -> Lines:
    """What its lines say.

    Parameters
    ----------
    p : Equipped
        Parameters.
    s : State
        State.

    Returns
    -------
    Lines
        Of what there is none, as `types.QUIET`. The counter is read by the pulse itself: an index
        pulse has the same count each time.
    """
    reading = p.axis.reading.encoder
    index = math.nan
    if not math.isnan(s.pulse):
        index = encoder.count(reading, s.pulse + 0.5 * reading.pitch)
    enabled = 1.0
    if p.wiring.enable == 1 and not drive_lines.ready(p.wiring, s.drive):
        enabled = 0.0
    return Lines(s.low.on, s.high.on, s.home.on, index, s.drive.fault, enabled)


@kernel
def asked(p: Equipped, s: State, enable: float) -> State:
    """The state with the drive's enable input on or off.

    Parameters
    ----------
    p : Equipped
        Parameters.
    s : State
        State.
    enable : float
        0 or 1.

    Returns
    -------
    State
        The same otherwise.
    """
    drive = Drive(enable, s.drive.on, s.drive.heat, s.drive.fault)
    return State(s.axis, s.low, s.high, s.home, s.pulse, drive)


@kernel
def advance(p: Equipped, s: State, effort: float, noise: Array, k: int, dt: float) -> State:
    """As `axis.advance`; a drive that is off gives 0 V.

    Parameters
    ----------
    p : Equipped
        Parameters.
    s : State
        State.
    effort : float
        V at the D/A's input.
    noise : ndarray, shape (periods, NOISES)
        Standard normal draws; the last three are the switches'.
    k : int
        Their row.
    dt : float
        Control period, s.

    Returns
    -------
    State
        New state.
    """
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
    """As `axis.truth`.

    Parameters
    ----------
    p : Equipped
        Parameters.
    s : State
        State.

    Returns
    -------
    axis.Truth
        SI.
    """
    return axis.truth(p.axis, s.axis)
