"""Commissioning of a shape-memory wire."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.arrays import Array
from macromicro.commission import _wire_drives as drives
from macromicro.commission import _wire_fit, margins
from macromicro.commission._settings import as_file, texts
from macromicro.commission._wire_drives import CURVES, PULSES, RAMP, WARMTH, Warmth
from macromicro.commission._wire_fit import (
    MODEL_ERRORS,
    Curves,
    Heat,
    Wire,
    average_blocks,
    branch,
    curves,
    simulate,
    spread,
    steepest,
)
from macromicro.commission.margins import DRAWS, SEED, Robust
from macromicro.commission.procedure import SIMULATED, Drawn, Estimate, Kind, Robustness, Step, Work
from macromicro.commission.stand import Record
from macromicro.drawing.style import BLACK, BLUE, RED, finish, line, new
from macromicro.machines import loops, wire_sheets
from macromicro.machines.loops import Complex
from macromicro.machines.wire import DEFAULT

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# Positions do not show the data-sheet values of the machine `wire`, so the file assumes a usual
# alloy, a diameter, and a temperature scale that starts at that alloy's transformation; travel,
# loop and times are the identified ones.

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


def fit(work: Work) -> Wire:
    records = [*work[RAMP], *work[PULSES]]
    # A reading that stands still is uncertain by its steps all the same.
    noise = math.hypot(work[WARMTH].noise, work.stand.pitch / math.sqrt(12.0))
    return _wire_fit.fit_wire(records, work.stand.dt, drives.way_of(work), noise)


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
    values = texts(figures, plain)
    # What moves and gains follow from is what was found, not the alloy's latent heat.
    tree = as_file(values, name="wire")[1]
    speed = min(found.up * (effort - p.end), found.down * p.last)
    quick = min(wire_sheets.SLOWER * speed, tree.motion.velocity)
    # Between its branches, after a turn, a wire moves by a part of what it does along them: with
    # the gain that suits a branch the loop crosses the hysteresis too slowly.
    quicker = _wire_fit.answer(work[CURVES][0], p, stand.dt)
    gain = quicker * wire_sheets.bandwidth(tree) / found.up
    return {**values, "motion.velocity": f'"{quick!r} m/s"', "controller.kp": f'"{gain!r} V/m"'}


def home(work: Work, found: Wire) -> None:
    drives.cool(work.stand, drives.least_motion(work), work)


_FAR_BELOW = 1e-3  # of the slowest pole but that at 0
_LEAST = 0.05  # of a parameter: no draw is below it


def plant(p: Heat, settings: Any, frequency: Array) -> Complex:
    """Response along the steepest branch at its steepest point, with driver lag, hold and delay."""
    s = np.asarray(2j * math.pi * np.asarray(frequency), np.complex128)
    slope, behind = steepest(p), p.share / (1.0 - p.share)
    around = behind / (p.slow * s + 1.0 + behind)
    heat = (1.0 - p.share) / ((p.tau + p.latent * slope) * s + 1.0 - around)
    given = loops.hold_and_delay(s, settings.timing) / (1.0 + settings.driver.lag * s)
    found: Complex = p.way * slope * heat * given
    return found


def drawn_models(found: Wire, number: int, seed: int = SEED) -> Iterator[tuple[Heat, float]]:
    random = np.random.Generator(np.random.PCG64(seed))
    values = np.array(found.heat)
    for row in random.multivariate_normal(values, found.spread.covariance, number, method="svd"):
        p = Heat(*np.where(values > 0.0, np.maximum(row, _LEAST * values), row).tolist())
        p = p._replace(share=min(p.share, 1.0 - _LEAST))
        up, down = found.heat.end - found.heat.start, found.heat.first - found.heat.last
        p = p._replace(
            end=max(p.end, p.start + _LEAST * up), first=max(p.first, p.last + _LEAST * down)
        )
        yield p, 1.0 + MODEL_ERRORS["up"] * random.standard_normal()


def robust_loop(settings: Any, found: Wire) -> Robust:
    p, dt = settings.controller, settings.timing.period
    heat = found.heat
    slowest = min(1.0 / (heat.slow + heat.tau), p.ki / p.kp) / (2.0 * math.pi)
    frequency = loops.grid(dt, _FAR_BELOW * slowest)
    control = loops.pi(p, frequency, dt)
    every = (
        more * control * plant(one, settings, frequency) for one, more in drawn_models(found, DRAWS)
    )
    whole = control * plant(heat, settings, frequency)
    return margins.robust(frequency, whole, every)


def robustness(settings: Any, found: Wire) -> Robustness:
    return margins.as_robustness(robust_loop(settings, found), "a sensor with less noise")


_DRIFT = 0.15  # of the loop's width: ways down that lie apart by more are doubtful
_POOR = 0.04  # of the way: the model leaves that much
MEANINGS = {
    "way": ("full contraction", "m"),
    "up": ("speed of contraction per effort", "m/(V s)"),
    "tau": ("time constant of its heat", "s"),
    "start": ("effort at which contraction begins", "V"),
    "end": ("effort for full contraction", "V"),
    "first": ("effort at which extension begins", "V"),
    "last": ("effort for full extension", "V"),
}


def estimates(found: Wire) -> dict[str, Estimate]:
    made = {}
    for name, (meaning, unit) in MEANINGS.items():
        value = found.up if name == "up" else getattr(found.heat, name)
        made[name] = Estimate(meaning, float(value), found.half_width(name), unit)
    return made


def rows(work: Work) -> list[tuple[str, ...]]:
    warmth, ramp = work["warmth"], work["ramp"][0]
    return [
        ("noise of the reading", f"{warmth.noise * 1e6:.3g}", "", "um rms"),
        ("first contraction at", f"{warmth.effort:.3g}", "", "V, rising slowly"),
        ("contracted at", f"{ramp.u.max():.3g}", "", "V, rising slowly"),
    ]


def doubts(work: Work, model: Wire) -> list[str]:
    p, said = model.heat, []
    if model.rms > _POOR * p.way:
        said.append(
            f"The model leaves a residual of {model.rms / p.way:.1%} of the travel. Check for "
            "moving air or an obstacle."
        )
    if p.end > 0.9 * work.options.effort:
        said.append(
            f"{p.end:.3g} V keep it contracted, and the limit is {work.options.effort:.3g} V: "
            "it contracts slowly at its end. Allow a larger --effort."
        )
    width = 0.5 * (p.start + p.end - p.first - p.last)
    apart = spread(_curves(work, model))
    if apart > _DRIFT * width:
        said.append(
            f"The cooling branches of the first-order curves lie {apart:.2g} V apart, with a "
            f"loop of {width:.3g} V: the heat balance does not hold along them. Check for "
            "moving air."
        )
    if math.isclose(p.first, p.last, rel_tol=0.02):
        said.append(
            "It extends within a very small range of heat. Check whether its load is too large."
        )
    return said


def records(every: Sequence[Record], found: Wire, dt: float) -> Figure:
    figure, axes = new(5.0, 2, len(every))
    for k, one in enumerate(every):
        thin = average_blocks(one, dt)
        line(axes[0, k], thin.t, thin.x * 1e3, BLUE, "measured")
        free = simulate(found.heat, thin, found.begin[k])
        line(axes[0, k], thin.t, free * 1e3, RED, "model", linestyle="--")
        line(axes[1, k], thin.t, thin.u, RED, "")
        finish(axes[0, k], "pulses" if k else "slow ramp", "", "" if k else "[mm]", legend=not k)
        finish(axes[1, k], "effort", "time [s]", "" if k else "[V]")
    return figure


def loop(heat: Heat) -> Figure:
    """The model's contraction over steady effort, both ways."""
    figure, axes = new(2.8, 1)
    h, warming, cooling = _branches(heat)
    line(axes[0, 0], h, warming * 1e3, RED, "warming")
    line(axes[0, 0], h, cooling * 1e3, BLUE, "cooling")
    finish(axes[0, 0], "Loop", "steady effort [V]", "contraction [mm]", legend=True)
    return figure


def _branches(heat: Heat) -> tuple[Array, Array, Array]:
    """Heats, and the model's contraction there while it warms and while it cools."""
    h = np.linspace(0.0, 1.1 * heat.end, 200)
    up = [branch((k - heat.start) / (heat.end - heat.start), heat.warming) for k in h]
    down = [branch((k - heat.last) / (heat.first - heat.last), heat.cooling) for k in h]
    return h, heat.way * np.array(up), heat.way * np.array(down)


def first_order(found: Curves, heat: Heat) -> Figure:
    """Contraction over heat along first-order curves, and the model's branches."""
    figure, axes = new(3.2, 1)
    ax = axes[0, 0]
    h, x = found.first
    line(ax, h, x * 1e3, BLACK, "first warming")
    for k, one in enumerate(found.every):
        line(ax, one.heat, one.x * 1e3, BLUE, "" if k else "down, and up again")
    at, *both = _branches(heat)
    for way, name in zip(both, ("model", ""), strict=True):
        line(ax, at, way * 1e3, RED, name, linestyle="--")
    finish(ax, "First-order curves", "heat [V]", "contraction [mm]", legend=True)
    return figure


def _curves(work: Work, model: Wire) -> Curves:
    return curves(work["curves"][0], model.heat, work.stand.dt)


FIGURES = {
    "records": Drawn(
        "Heating and cooling",
        "The slow ramp and the pulses with the model's free simulation.",
        lambda work, model: records([*work["ramp"], *work["pulses"]], model, work.stand.dt),
    ),
    "loop": Drawn(
        "Hysteresis",
        "The model's contraction over steady effort.",
        lambda work, model: loop(model.heat),
    ),
    "curves": Drawn(
        "First-order curves",
        "Contraction over the heat, which the model's heat balance gives from effort and "
        "measured contraction, with the model's branches.",
        lambda work, model: first_order(_curves(work, model), model.heat),
    ),
}


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
    note=f"Heat is in volts of steady effort. {SIMULATED}",
    prepare=_ready,
    model=fit,
    settings=settings,
    head=(
        "Diameter, resistance, current and temperatures below are those of an equivalent "
        "wire;\ntravel, loop, times and efforts are the identified ones."
    ),
    homing="The wire cools until it rests; it takes this position as 0",
    home=home,
    rows=rows,
    estimates=estimates,
    doubts=doubts,
    figures=FIGURES,
    margins=robustness,
    one_way=True,
)
