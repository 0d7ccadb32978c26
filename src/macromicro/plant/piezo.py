"""A piezo stage: amplifier, hysteretic and creeping stack, flexure guide, position sensor.

    volts -> amplifier -> Prandtl-Ishlinskii, wider with the rate -> creep -> second order -> sensor

Structure: Croft, Shed and Devasia (2001). The shape of the hysteresis is a bench assumption.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

from macromicro.arrays import Array
from macromicro.columns import Meaning
from macromicro.hysteresis import prandtl
from macromicro.hysteresis.prandtl import Plays, Prandtl
from macromicro.hysteresis.prandtl_loop import Loop, shaped
from macromicro.kernel import kernel
from macromicro.plant import creep, gauge, high_voltage
from macromicro.plant.creep import CreepTable
from macromicro.plant.gauge import Gauge
from macromicro.plant.high_voltage import HighVoltage
from macromicro.schema.par import Par


class Stack(NamedTuple):
    """The ceramic by its data sheet: stroke over voltage and width of its loop."""

    stroke: Annotated[
        float,
        Par("m", "stroke over `span`, slowly", "PI P-621.1: 120 um", shown="um", positive=True),
    ] = 120e-6
    span: Annotated[
        float, Par("V", "voltage for that stroke", "PI: -20 to 120 V", positive=True)
    ] = 140.0
    hysteresis: Annotated[
        float,
        Par(
            "1",
            "width of that loop in its middle, of the stroke",
            "PI, Piezo University: 10 to 15 %",
            lo=0.0,
            hi=0.4,
        ),
    ] = 0.13


class Guide(NamedTuple):
    """The flexure guide with lever, platform and load, by its data sheet."""

    resonance: Annotated[
        float, Par("Hz", "resonance without a load", "PI P-621.1CD: 800 Hz", positive=True)
    ] = 800.0
    stiffness: Annotated[
        float,
        Par(
            "N/m", "stiffness in the direction of motion", "PI P-621.1CD: 0.35 N/um", positive=True
        ),
    ] = 0.35e6
    load: Annotated[float, Par("kg", "mass on the platform", shown="g", lo=0.0)] = 0.02


class Hidden(NamedTuple):
    """Deviations from the data sheet, and what none prints."""

    stronger: Annotated[
        float, Par("1", "true stroke over the printed one", "PI: +-20 %", lo=0.5, hi=2.0)
    ] = 1.04
    detuned: Annotated[
        float, Par("1", "true resonance over the printed one", "PI: +-20 %", lo=0.5, hi=2.0)
    ] = 0.95
    damping: Annotated[float, Par("1", "damping ratio of the resonance", lo=1e-4, hi=0.99)] = 0.02
    spread: Annotated[
        float,
        Par("1", "thresholds over which the weights fall to 1/e, of the span", positive=True),
    ] = 0.15
    plays: Annotated[int, Par("", "play operators", lo=2, hi=64)] = 24
    widening: Annotated[
        float,
        Par(
            "s",
            "growth of the thresholds with the rate of the voltage",
            "bench assumption: 6 V more at 100 Hz over the span",
            shown="ms",
            lo=0.0,
            hi=1.0,
        ),
    ] = 0.15e-3
    rate_lag: Annotated[
        float,
        Par("s", "lag of that growth, so that a staircase counts as a ramp", shown="ms", lo=0.0),
    ] = 1.0e-3


class Warming(NamedTuple):
    """A slow change of temperature, which lengthens the stage as a first-order lag."""

    expansion: Annotated[float, Par("m/K", "drift of the position per kelvin")] = 40e-9
    change: Annotated[float, Par("K", "change of temperature, from the start on")] = 0.0
    time: Annotated[float, Par("s", "time constant of that change", positive=True)] = 600.0


class PiezoPlant(NamedTuple):
    amplifier: Annotated[HighVoltage, Meaning("the amplifier")]
    hysteresis: Annotated[Prandtl, Meaning("from V to m")]
    creep: Annotated[CreepTable, Meaning("the creep")]
    omega: Annotated[float, Meaning("resonance with the load", "rad/s")]
    damping: Annotated[float, Meaning("its damping ratio")]
    rate_lag: Annotated[float, Meaning("lag of the rate that widens the loop", "s")]
    warming: Annotated[Warming, Meaning("slow drift")]
    sensor: Annotated[Gauge, Meaning("the sensor")]
    delay: Annotated[
        float, Meaning("from a reading until its effort acts; at most a control period", "s")
    ]
    steps: Annotated[int, Meaning("steps per control period")]


class PiezoState(NamedTuple):
    effort: Annotated[float, Meaning("V at the D/A that acts until the next one does", "V")]
    volts: Annotated[float, Meaning("at the stack", "V")]
    plays: Annotated[Plays, Meaning("of the hysteresis", "V")]
    rate: Annotated[float, Meaning("of the voltage, lagged", "V/s")]
    lags: Annotated[Array, Meaning("of the creep", "m")]
    x: Annotated[float, Meaning("position of the platform", "m")]
    v: Annotated[float, Meaning("its speed", "m/s")]
    drift: Annotated[float, Meaning("by the temperature", "m")]


def loop(spec: Stack, hidden: Hidden) -> Prandtl:
    """The hysteresis operator with the stage's stroke and loop width over `span`."""
    stroke = hidden.stronger * spec.stroke
    size = Loop(stroke, spec.hysteresis * stroke)
    return shaped(size, spec.span, hidden.spread, hidden.plays, hidden.widening)


def loaded_resonance(spec: Guide) -> float:
    """Printed resonance with the load: f0 sqrt(m / (m + load)), with m = k / (2 pi f0)^2."""
    own = spec.stiffness / (2.0 * math.pi * spec.resonance) ** 2
    return spec.resonance * math.sqrt(own / (own + spec.load))


def prepare(tree: Any) -> PiezoPlant:
    return PiezoPlant(
        tree.amplifier,
        loop(tree.stack, tree.hidden),
        creep.prepare(tree.creep),
        2.0 * math.pi * tree.hidden.detuned * loaded_resonance(tree.guide),
        tree.hidden.damping,
        tree.hidden.rate_lag,
        tree.warming,
        tree.encoder,
        tree.timing.delay,
        tree.timing.steps,
    )


def initial(p: PiezoPlant) -> PiezoState:
    """At rest at 0 V, without a past."""
    plays = prandtl.relaxed(p.hysteresis)
    return PiezoState(0.0, 0.0, plays, 0.0, creep.fresh(p.creep), 0.0, 0.0, 0.0)


@kernel
def swung(
    omega: float, damping: float, x: float, v: float, rest: float, dt: float
) -> tuple[Annotated[float, Meaning(name="x")], Annotated[float, Meaning(name="v")]]:
    """A damped oscillator after one step, exactly, for a constant rest position."""
    sigma = damping * omega
    swing = omega * math.sqrt(1.0 - damping * damping)
    decay = math.exp(-sigma * dt)
    c, s = math.cos(swing * dt), math.sin(swing * dt) / swing
    d = x - rest
    return (
        rest + decay * (d * (c + sigma * s) + v * s),
        decay * (v * (c - sigma * s) - d * omega * omega * s),
    )


@kernel
def advance(p: PiezoPlant, s: PiezoState, effort: float, dt: float) -> PiezoState:
    h = dt / p.steps
    asked = high_voltage.convert(p.amplifier, effort)
    before = high_voltage.convert(p.amplifier, s.effort)
    volts, plays, rate, x, v = s.volts, s.plays, s.rate, s.x, s.v
    keep = math.exp(-h / p.rate_lag) if p.rate_lag > 0.0 else 0.0
    for j in range(p.steps):
        now = before if (j + 0.5) * h < p.delay else asked
        volts = high_voltage.driven(p.amplifier, volts, now, h)
        rate = keep * rate + (1.0 - keep) * (volts - plays.u) / h
        plays, free = prandtl.advance(p.hysteresis, plays, volts, rate)
        rest = creep.advance(p.creep, s.lags, free, h)
        x, v = swung(p.omega, p.damping, x, v, rest, h)
    goal = p.warming.expansion * p.warming.change
    drift = goal + (s.drift - goal) * math.exp(-dt / p.warming.time)
    return PiezoState(effort, volts, plays, rate, s.lags, x, v, drift)


@kernel
def position(s: PiezoState) -> float:
    """Position of the platform, with thermal drift."""
    return s.x + s.drift


@kernel
def measured(p: PiezoPlant, s: PiezoState, draw: float) -> float:
    return gauge.reading(p.sensor, position(s), draw)
