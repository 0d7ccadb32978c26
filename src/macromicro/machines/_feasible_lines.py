"""Impossible settings of switches, index pulses and drive lines of an axis."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from macromicro import place as places
from macromicro.machines import _wiring, homing, pace, sheets
from macromicro.machines.parts import CAM, HOME, INDEX, LOW_LIMIT, MARK, NONE, STOP, TURN
from macromicro.machines.tree import Checked
from macromicro.plant.power import LINE
from macromicro.plant.transmission import LINEAR


def check_lines(tree: Any) -> Iterator[Checked]:
    yield from _limits(tree)
    yield from _home(tree)
    yield from _index(tree)
    yield from _homing(tree)
    yield from _drive(tree)


def _limits(tree: Any) -> Iterator[Checked]:
    """Limit switches between targets and end stops."""
    there, s, travel = _wiring.lines(tree), tree.switches, tree.travel
    low, high = sheets.ends(tree)
    told = places.of(tree).told
    free = s.hysteresis + 4.0 * s.repeatability
    if "limit_low" in there:
        most = travel.low - free
        yield (
            s.low < low,
            "switches.low",
            s.low,
            "{load.stop_low} or more: the end stop keeps the stage from it",
        )
        yield (
            s.low > most,
            "switches.low",
            s.low,
            f"at most {told(most)}: it is to have let go at {{travel.low}}, the lowest target",
        )
    if "limit_high" in there:
        least = travel.high + free
        yield (
            s.high > high,
            "switches.high",
            s.high,
            "at most {load.stop_high}: the end stop keeps the stage from it",
        )
        yield (
            s.high < least,
            "switches.high",
            s.high,
            f"{told(least)} or more: it is to have let go at {{travel.high}}, the highest target",
        )


def _home(tree: Any) -> Iterator[Checked]:
    """A home switch within the travel, wide enough to be seen."""
    there, s = _wiring.lines(tree), tree.switches
    told = places.of(tree).told
    if "home" not in there:
        return
    low, high = sheets.ends(tree)
    low = s.low if "limit_low" in there else low
    high = s.high if "limit_high" in there else high
    width = s.home_width if s.home == CAM else 0.0
    free = s.hysteresis + 4.0 * s.repeatability
    least, most = low + free + width, high - free - homing.back(tree)
    yield (
        not least < s.home_place < most,
        "switches.home_place",
        s.home_place,
        f"above {told(least)} and below {told(most)}, where the stage can pass it "
        "between its limit switches or end stops",
    )
    if s.home == CAM:
        seen = 3.0 * homing.speed(tree) * pace.period(tree) + free
        yield (
            width < seen,
            "switches.home_width",
            s.home_width,
            f"{told(seen, digits=4)} or more, to be seen at the speed of the search",
        )


def _index(tree: Any) -> Iterator[Checked]:
    """Index pulses far enough apart."""
    encoder, told, (low, high) = tree.encoder, places.of(tree).told, sheets.ends(tree)
    if encoder.index_pulse == NONE:
        return
    turns = encoder.at != "load" and tree.drive.kind != LINEAR
    yield (
        encoder.index_pulse == TURN and not turns,
        "encoder.index_pulse",
        encoder.index_pulse,
        f"{MARK}: only an encoder on a motor that turns has a pulse per turn",
    )
    yield (
        not low < encoder.index_place < high,
        "encoder.index_place",
        encoder.index_place,
        "between {load.stop_low} and {load.stop_high}, the end stops",
    )
    if INDEX not in tree.homing.on or tree.homing.on == INDEX:
        return
    edge, margin = homing.edge(tree), homing.margin(tree)
    if encoder.index_pulse == MARK:
        yield (
            encoder.index_place < edge + margin,
            "encoder.index_place",
            encoder.index_place,
            f"{told(edge + margin)} or more: homing takes the pulse above the switch",
        )
        return
    apart = _wiring.spacing(tree)
    yield (
        turns and apart < 4.0 * margin,
        "encoder.index_pulse",
        encoder.index_pulse,
        f"pulses {told(4.0 * margin, digits=4)} apart or more, four times what the edge of the "
        f"switch is uncertain by; a turn is {told(apart, digits=4)}: a switch with less scatter, "
        "or another homing.on",
    )
    if not turns:
        return
    above = homing.pulse(tree) - edge
    near = min(above, apart - above)
    yield (
        near < margin,
        "encoder.index_place",
        encoder.index_place,
        f"pulses {told(margin, digits=4)} or more from the edge of the switch at {told(edge)}, "
        f"which is uncertain by that; the nearest is {told(near, digits=4)} from it: move the "
        "switch",
    )


def _homing(tree: Any) -> Iterator[Checked]:
    """Homing on an existing signal."""
    there, on = _wiring.lines(tree), tree.homing.on
    if on == STOP:
        return
    parts = on.split("+")
    for name, line, remedy in (
        (LOW_LIMIT, "limit_low", 'switches.limits = "low" or "both"'),
        (HOME, "home", 'switches.home = "below" or "cam"'),
        (INDEX, "index_count", 'encoder.index_pulse = "turn" or "mark"'),
    ):
        yield (
            name in parts and line not in there,
            "homing.on",
            on,
            f"what the axis has, or {remedy}",
        )
    yield (
        on == INDEX and tree.encoder.index_pulse == TURN,
        "homing.on",
        on,
        f'"{HOME}+{INDEX}" or "{LOW_LIMIT}+{INDEX}": each turn has a pulse, which of them it is '
        "tells a switch",
    )


def _drive(tree: Any) -> Iterator[Checked]:
    """A drive that carries the static load."""
    amplifier = tree.amplifier
    if amplifier.fault != LINE:
        return
    yield (
        amplifier.continuous >= amplifier.current,
        "amplifier.continuous",
        amplifier.continuous,
        "below {amplifier.current}, or it never trips",
    )
    takes = sheets.breakaway_force(tree) / (sheets.constant(tree) * tree.drive.efficiency)
    yield (
        amplifier.continuous <= takes,
        "amplifier.continuous",
        amplifier.continuous,
        f"above {takes:.4g} A, what friction and weight alone need",
    )
