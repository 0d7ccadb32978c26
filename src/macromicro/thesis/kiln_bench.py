"""The kiln of Section 5.2.1 (Figure 5.3): the actuator lifts 30 g while the air is heated."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro import nominal
from macromicro.columns import Meaning
from macromicro.hysteresis import Everett
from macromicro.kernel import kernel
from macromicro.plant import encoder, micro, wire
from macromicro.plant.bench import Bench
from macromicro.plant.encoder import Encoder
from macromicro.plant.flexure import GRAM_FORCE
from macromicro.plant.phase import Phase
from macromicro.plant.phase import table as phase_table
from macromicro.plant.wire import Load, Wire, WireState
from macromicro.rig.fixtures import KILN_PITCH, KilnSample
from macromicro.rig.session import Fixture
from macromicro.schema.par import Par


class Oven(NamedTuple):
    """Kiln, thermocouple and weight. The thesis gives the set-up, not its time constants."""

    ambient: Annotated[float, Par("degC", "room temperature", "Section 5.2.2", lo=-40, hi=80)] = (
        nominal.AMBIENT
    )
    power: Annotated[
        float, Par("K/s", "rise of the air with the heater on, cold", positive=True)
    ] = 0.35
    loss_time: Annotated[float, Par("s", "time constant of the kiln's loss", positive=True)] = 480.0
    wire_lag: Annotated[
        float, Par("s", "lag of the wires behind the air (still air)", positive=True)
    ] = 5.0
    gradient: Annotated[
        float, Par("1", "share of the air's excess missing below the top plate", lo=0.0, hi=0.2)
    ] = 0.004
    thermocouple_lag: Annotated[float, Par("s", "lag of the thermocouple", positive=True)] = 4.0
    thermocouple_noise: Annotated[
        float, Par("K", "noise of the thermocouple (standard deviation)", lo=0.0)
    ] = 0.12
    spike: Annotated[
        float, Par("K", "typical height of an interference spike", "calibrated to S1", lo=0.0)
    ] = 9.0
    spike_rate: Annotated[
        float,
        Par(
            "Hz", "interference spikes per second", "bench assumption (Figure 5.5)", lo=0.0, hi=0.5
        ),
    ] = 0.02
    weight: Annotated[float, Par("N", "weight on the actuator", "Section 5.2.1", lo=0.0)] = (
        30.0 * GRAM_FORCE
    )


class KilnBench(NamedTuple):
    """The fixture: the same wires in hot air."""

    oven: Oven = Oven()
    phase: Phase = Phase()
    wire: Wire = Wire()
    encoder: Encoder = Encoder(pitch=KILN_PITCH)


# Where the values come from that are not those of the two-stage bench.
OWN_SOURCES = {"encoder.pitch": "Section 5.2.1"}


def with_bench(bench: Bench) -> KilnBench:
    """The kiln in the room of a bench, with that bench's wires in it."""
    own = KilnBench()
    oven = own.oven._replace(ambient=bench.thermal.ambient)
    return KilnBench(oven, bench.phase, bench.wire, own.encoder)


class KilnPlant(NamedTuple):
    oven: Oven
    wire: Wire
    table: Everett
    load: Load
    encoder: Encoder


Kiln = KilnPlant | Fixture


class KilnState(NamedTuple):
    air: Annotated[float, Meaning("", "degC")]
    thermocouple: Annotated[float, Meaning("", "degC")]
    spike: Annotated[float, Meaning("interference", "K")]
    left: Annotated[float, Meaning("how long that still lasts", "s")]
    wire: Annotated[WireState, Meaning("the wires")]


def prepare(spec: KilnBench) -> KilnPlant:
    return KilnPlant(
        spec.oven,
        spec.wire,
        phase_table(spec.phase),
        Load(spec.oven.weight, 0.0, 0.0),
        spec.encoder,
    )


def initial(p: KilnPlant) -> KilnState:
    """Cold kiln, actuator extended."""
    t = float(p.oven.ambient)
    return KilnState(t, t, 0.0, 0.0, micro.cold_wire(p.wire, p.load, p.table, t))


class KilnNoise(NamedTuple):
    thermocouple: Annotated[float, Meaning("draw for the thermocouple's noise")] = 0.0
    onset: Annotated[float, Meaning("draw for the onset of a spike")] = 0.0
    height: Annotated[float, Meaning("draw for the height of that spike")] = 0.0


KILN_NOISES = len(KilnNoise._fields)


@kernel
def drawn(noise: npt.NDArray[np.float64], k: int) -> KilnNoise:
    return KilnNoise(noise[k, 0], noise[k, 1], noise[k, 2])


@kernel
def measure(p: KilnPlant, s: KilnState, t: float, draw: KilnNoise) -> KilnSample:
    """What the fixture shows."""
    shown = s.thermocouple + s.spike + p.oven.thermocouple_noise * draw.thermocouple
    return KilnSample(t, shown, encoder.count(p.encoder, s.wire.x + 0.5 * p.encoder.pitch))


@kernel
def advance(
    p: KilnPlant,
    s: KilnState,
    heater: Annotated[float, Meaning("relay of the heater, 0 or 1")],
    draw: KilnNoise,
    dt: float,
) -> KilnState:
    """The fixture after one control period."""
    oven = p.oven
    air = s.air + dt * (oven.power * heater - (s.air - oven.ambient) / oven.loss_time)
    couple = s.thermocouple + (air - s.thermocouple) * (1.0 - math.exp(-dt / oven.thermocouple_lag))
    there = air - oven.gradient * (air - oven.ambient)
    hot = s.wire.temperature + (there - s.wire.temperature) * (1.0 - math.exp(-dt / oven.wire_lag))
    # A spike begins when a uniform number, made from the draw, falls below rate * dt.
    spike, left, height = s.spike, s.left - dt, draw.height
    if left <= 0.0:
        spike, left = 0.0, 0.0
        if 0.5 * math.erfc(draw.onset / math.sqrt(2.0)) < oven.spike_rate * dt:
            spike = oven.spike * (0.7 + 0.4 * abs(height)) * (1.0 if height > 0.0 else -1.0)
            left = 1.0 + abs(height)
    return KilnState(air, couple, spike, left, wire.tempered(p.wire, p.load, p.table, s.wire, hot))
