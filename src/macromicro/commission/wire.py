"""Commissioning of a shape-memory wire."""

# Positions do not show the data-sheet values of the machine `wire`, so the file assumes a usual
# alloy, a diameter, and a temperature scale that starts at that alloy's transformation; travel,
# loop and times are the identified ones.

from __future__ import annotations

import math
from typing import Any

from macromicro.commission import _wire_drives as drives
from macromicro.commission import _wire_fit, _wire_margins, _wire_page
from macromicro.commission._wire_drives import CURVES, PULSES, RAMP, WARMTH, Warmth
from macromicro.commission._wire_fit import Wire
from macromicro.commission.procedure import Kind, Step, Work
from macromicro.machines import wire_sheets
from macromicro.machines.wire import DEFAULT
from macromicro.schema import config

_DIAMETER = 1e-3  # m: so thick that its load shifts no temperature
_PER_LENGTH = 10.0  # ohm/m
_HOTTEST = (
    110.0  # degC at the end of the contraction, at most: where the relays' table ends is near
)
_ROOM = DEFAULT.air.ambient
_NEAR = 1e-3  # of the way: what counts as arrived; below it the loop hunts across the hysteresis
_BEYOND = 0.2  # of the way, that the sensor shows beyond it at least


def _ready(work: Work) -> None:
    work.stand.facing = work[WARMTH].sign


def fitted(work: Work) -> Wire:
    records = [*work[RAMP], *work[PULSES]]
    # A reading that stands still is uncertain by its steps all the same.
    noise = math.hypot(work[WARMTH].noise, work.stand.pitch / math.sqrt(12.0))
    return _wire_fit.fitted(records, work.stand.dt, drives.way_of(work), noise)


def settings(work: Work, found: Wire, home: Any) -> dict[str, str]:
    p, stand, effort = found.heat, work.stand, work.options.effort
    kelvin = min((DEFAULT.wire.heat_start - _ROOM) / p.start, (_HOTTEST - _ROOM) / p.end)
    length = p.way / DEFAULT.wire.strain
    hot, first, last = (_ROOM + kelvin * h for h in (p.end, p.first, p.last))
    mass = wire_sheets.DENSITY * 0.25 * math.pi * _DIAMETER**2 * length
    capacity, latent = mass * wire_sheets.SPECIFIC, mass * wire_sheets.LATENT
    resistance = p.tau / ((1.0 - p.share) * capacity)
    power = kelvin * effort / resistance
    # The cooling time from which the machine's rules find that resistance.
    fall = capacity * math.log((hot - _ROOM) / (last - _ROOM))
    cooling = resistance * (fall + latent / (0.5 * (first + last) - _ROOM))
    figures = {
        "driver.current": (math.sqrt(power / (_PER_LENGTH * length)), "A"),
        "driver.full_scale": (effort, "V"),
        "wire.diameter": (_DIAMETER, "m"),
        "wire.length": (length, "m"),
        "wire.resistance": (_PER_LENGTH, "ohm/m"),
        "wire.cooling": (cooling, "s"),
        "wire.heat_start": (_ROOM + kelvin * p.start, "degC"),
        "wire.heat_end": (hot, "degC"),
        "wire.cool_start": (first, "degC"),
        "wire.cool_end": (last, "degC"),
        "bias.rate": (0.0, "N/m"),
        "air.ambient": (_ROOM, "degC"),
        "air.printed": (_ROOM, "degC"),
        "encoder.pitch": (stand.pitch, "m"),
        "encoder.noise": (work[WARMTH].noise, "m"),
        "encoder.low": (-_BEYOND * p.way, "m"),
        "encoder.high": ((1.0 + _BEYOND) * p.way, "m"),
        "arrival.tolerance": (max(_NEAR * p.way, 4.0 * stand.pitch, 6.0 * work[WARMTH].noise), "m"),
        "timing.period": (stand.dt, "s"),
        "timing.delay": (0.0, "s"),
    }
    plain = {
        "hidden.capacity": 1.0,
        "hidden.cooling": 1.0,
        "hidden.latent": kelvin * p.latent / p.tau * capacity / latent,
    }
    values = {
        **{path: f'"{float(v)!r} {unit}"' for path, (v, unit) in figures.items()},
        **{path: repr(float(v)) for path, v in plain.items()},
    }
    # What moves and gains follow from is what was found, not the alloy's latent heat.
    base: dict[str, Any] = {k: f"{float(v)!r} {unit}" for k, (v, unit) in figures.items()}
    tree = config.overridden(DEFAULT, {**base, **plain}, "the identified machine")
    speed = min(found.up * (effort - p.end), found.down * p.last)
    quick = min(wire_sheets.SLOWER * speed, tree.motion.velocity)
    # Between its branches, after a turn, a wire moves by a part of what it does along them: with
    # the gain that suits a branch the loop crosses the hysteresis too slowly.
    quicker = _wire_fit.answer(work[CURVES][0], p, stand.dt)
    gain = quicker * wire_sheets.bandwidth(tree) / found.up
    return {**values, "motion.velocity": f'"{quick!r} m/s"', "controller.kp": f'"{gain!r} V/m"'}


def home(work: Work, found: Wire) -> None:
    drives.cooled(work.stand, drives.least_motion(work), work)


KIND = Kind(
    name="wire",
    steps=(
        Step(WARMTH, "sign and first contraction", drives.warmth_intent, drives.warmth, Warmth),
        Step(RAMP, "full travel, slowly", drives.ramp_intent, drives.ramp, None),
        Step(PULSES, "heating and cooling", drives.pulses_intent, drives.pulses, None),
        Step(CURVES, "first-order curves", drives.curves_intent, drives.curves, None),
    ),
    turned=(
        "A contraction made the reading fall: reverse the sensor's sign before using this file."
    ),
    note="Heat is in volts of steady effort.",
    prepare=_ready,
    model=fitted,
    settings=settings,
    head=(
        "Diameter, resistance, current and temperatures below are those of an equivalent "
        "wire;\ntravel, loop, times and efforts are the identified ones."
    ),
    homing="The wire cools until it rests; it takes this position as 0",
    home=home,
    rows=_wire_page.rows,
    estimates=_wire_page.estimates,
    doubts=_wire_page.doubts,
    figures=_wire_page.FIGURES,
    margins=_wire_margins.told,
    one_way=True,
)
