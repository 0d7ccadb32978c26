"""A piezo stage: amplifier, hysteretic and creeping stack, flexure guide, position sensor.

    volts -> amplifier -> Prandtl-Ishlinskii, wider with the rate -> creep -> second order -> sensor

Hysteresis and creep of the stack act before the mechanics, as Croft, Shed and Devasia (2001)
place them. The hysteresis' weights follow from what makers print, the stroke over a voltage span
and the width of that loop, and from a shape that is a bench assumption.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.arrays import Array
from macromicro.hysteresis import prandtl
from macromicro.hysteresis.prandtl import Plays, Prandtl
from macromicro.hysteresis.prandtl_loop import Loop, shaped
from macromicro.kernel import kernel
from macromicro.plant import creep, gauge, high_voltage
from macromicro.plant.creep import Creep, CreepTable
from macromicro.plant.gauge import Gauge
from macromicro.plant.high_voltage import HighVoltage
from macromicro.schema.par import Par


class Stack(NamedTuple):
    """The ceramic as makers print it: how far it moves for a voltage, and how wide its loop is."""

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
    """The flexure guide with its lever, the platform and what stands on it, as makers print it."""

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
    """What no data sheet prints, and by how much one stage differs from its sheet."""

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


class PiezoBench(NamedTuple):
    """A piezo stage as a person writes it down."""

    amplifier: HighVoltage = HighVoltage()
    stack: Stack = Stack()
    creep: Creep = Creep()
    guide: Guide = Guide()
    hidden: Hidden = Hidden()
    warming: Warming = Warming()
    sensor: Gauge = Gauge()
    delay: Annotated[
        float, Par("s", "from a reading until its effort acts", shown="ms", lo=0.0)
    ] = 0.0
    steps: Annotated[int, Par("", "physics steps per control period", lo=1, hi=1000)] = 4


class PiezoPlant(NamedTuple):
    """The stage as the kernels take it.

    Attributes
    ----------
    amplifier : HighVoltage
        The amplifier.
    hysteresis : Prandtl
        From V to m.
    creep : CreepTable
        The creep.
    omega : float
        Resonance with the load, rad/s.
    damping : float
        Its damping ratio.
    rate_lag : float
        Lag of the rate that widens the loop, s.
    warming : Warming
        Slow drift.
    sensor : Gauge
        The sensor.
    delay : float
        From a reading until its effort acts, s; at most a control period.
    steps : int
        Steps per control period.
    """

    amplifier: HighVoltage
    hysteresis: Prandtl
    creep: CreepTable
    omega: float
    damping: float
    rate_lag: float
    warming: Warming
    sensor: Gauge
    delay: float
    steps: int


class PiezoState(NamedTuple):
    """State of the stage.

    Attributes
    ----------
    effort : float
        V at the D/A that acts until the next one does.
    volts : float
        At the stack, V.
    plays : Plays
        Of the hysteresis, V.
    rate : float
        Of the voltage, lagged, V/s.
    lags : ndarray, shape (k,)
        Of the creep, m.
    x : float
        Position of the platform, m.
    v : float
        Its speed, m/s.
    drift : float
        By the temperature, m.
    """

    effort: float
    volts: float
    plays: Plays
    rate: float
    lags: Array
    x: float
    v: float
    drift: float


def loop(spec: Stack, hidden: Hidden) -> Prandtl:
    """The operator whose loop over `span` has the stroke and the width of this stage.

    Parameters
    ----------
    spec : Stack
        The stack as printed.
    hidden : Hidden
        What is not printed.

    Returns
    -------
    Prandtl
        Output in m, input in V.

    Raises
    ------
    InputError
        A loop too wide for the spread of its weights.
    """
    stroke = hidden.stronger * spec.stroke
    size = Loop(stroke, spec.hysteresis * stroke)
    return shaped(size, spec.span, hidden.spread, hidden.plays, hidden.widening)


def loaded(spec: Guide) -> float:
    """Printed resonance with the load: f0 sqrt(m / (m + load)), with m = k / (2 pi f0)^2.

    Parameters
    ----------
    spec : Guide
        The guide.

    Returns
    -------
    float
        Hz.
    """
    own = spec.stiffness / (2.0 * math.pi * spec.resonance) ** 2
    return spec.resonance * math.sqrt(own / (own + spec.load))


def prepare(spec: PiezoBench) -> PiezoPlant:
    """Runtime parameters.

    Parameters
    ----------
    spec : PiezoBench
        The stage.

    Returns
    -------
    PiezoPlant
        For the kernels.
    """
    return PiezoPlant(
        spec.amplifier,
        loop(spec.stack, spec.hidden),
        creep.prepare(spec.creep),
        2.0 * math.pi * spec.hidden.detuned * loaded(spec.guide),
        float(spec.hidden.damping),
        float(spec.hidden.rate_lag),
        spec.warming,
        spec.sensor,
        float(spec.delay),
        int(spec.steps),
    )


def initial(p: PiezoPlant) -> PiezoState:
    """At rest at 0 V, without a past.

    Parameters
    ----------
    p : PiezoPlant
        The stage.

    Returns
    -------
    PiezoState
        Its arrays are its own.
    """
    plays = prandtl.relaxed(p.hysteresis)
    return PiezoState(0.0, 0.0, plays, 0.0, creep.fresh(p.creep), 0.0, 0.0, 0.0)


@kernel
def swung(
    omega: float, damping: float, x: float, v: float, rest: float, dt: float
) -> tuple[float, float]:
    """A damped oscillator after one step, exactly, for a place of rest that stays.

    Parameters
    ----------
    omega : float
        Natural frequency, rad/s.
    damping : float
        Damping ratio below 1.
    x : float
        Position, m.
    v : float
        Speed, m/s.
    rest : float
        Where it would come to rest, m.
    dt : float
        Length of the step, s.

    Returns
    -------
    x : float
        New position, m.
    v : float
        New speed, m/s.
    """
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
    """The stage after one control period.

    Parameters
    ----------
    p : PiezoPlant
        The stage.
    s : PiezoState
        Its state; the arrays are changed in place.
    effort : float
        V at the D/A; it acts after the delay, the one before it until then.
    dt : float
        Length of the period, s.

    Returns
    -------
    PiezoState
        New state.
    """
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
    """Where the platform is, warmth included.

    Parameters
    ----------
    s : PiezoState
        State of the stage.

    Returns
    -------
    float
        m.
    """
    return s.x + s.drift


@kernel
def measured(p: PiezoPlant, s: PiezoState, draw: float) -> float:
    """What the sensor shows.

    Parameters
    ----------
    p : PiezoPlant
        The stage.
    s : PiezoState
        Its state.
    draw : float
        Standard normal number.

    Returns
    -------
    float
        m.
    """
    return gauge.reading(p.sensor, position(s), draw)
