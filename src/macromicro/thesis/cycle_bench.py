"""The cycle bench of Appendix D: actuator, bias spring and encoder; 5 V, 23 degC, no flexure."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.kernel import kernel
from macromicro.plant import amplifier, encoder, micro
from macromicro.plant.amplifier import Amplifier
from macromicro.plant.bench import Bench
from macromicro.plant.driver import Driver
from macromicro.plant.encoder import Encoder
from macromicro.plant.flexure import GRAM_FORCE, Bias
from macromicro.plant.micro import Micro, MicroState
from macromicro.plant.phase import Phase
from macromicro.plant.thermal import Thermal
from macromicro.plant.wire import Load, Wire
from macromicro.rig.fixtures import CycleSample
from macromicro.rig.session import Fixture


class CycleBench(NamedTuple):
    """The fixture: the same actuator with another supply, spring and sensor."""

    amplifier: Amplifier = Amplifier()
    driver: Driver = Driver(supply=5.0)
    # It stands free in the air, not boxed in on the carriage.
    thermal: Thermal = Thermal(
        ambient=23.0, plate_resistance=0.125 * 150.0, body_resistance=0.05 * 150.0
    )
    phase: Phase = Phase()
    wire: Wire = Wire()
    bias: Bias = Bias(preload=60.0 * GRAM_FORCE)
    encoder: Encoder = Encoder(pitch=17e-6)


# Where the values come from that are not those of the two-stage bench, or stand for another
# part: `Par` has the sources of the other bench's.
_A = "calibrated to A1-A3"
OWN_SOURCES = {
    "driver.supply": "Appendix D",
    "thermal.ambient": "Appendix D",
    "thermal.plate_resistance": _A,
    "thermal.body_resistance": _A,
    "bias.preload": _A,
    "bias.rate": "bench assumption: the spring of the two-stage bench",
    "encoder.pitch": "Appendix D",
}


def with_bench(bench: Bench) -> CycleBench:
    """The fixture with the actuator, driver and spring of a bench; `OWN_SOURCES` stay its own."""
    own = CycleBench()
    return CycleBench(
        bench.amplifier,
        bench.driver._replace(supply=own.driver.supply),
        bench.thermal._replace(
            ambient=own.thermal.ambient,
            plate_resistance=own.thermal.plate_resistance,
            body_resistance=own.thermal.body_resistance,
        ),
        bench.phase,
        bench.wire,
        bench.bias._replace(preload=own.bias.preload),
        own.encoder,
    )


class CyclePlant(NamedTuple):
    amplifier: Amplifier
    micro: Micro
    encoder: Encoder


CycleBed = CyclePlant | Fixture


class CycleState(NamedTuple):
    micro: Annotated[MicroState, Meaning("actuator")]
    ctrl: Annotated[float, Meaning("latched D/A voltage, not yet in effect", "V")]


def prepare(spec: CycleBench) -> CyclePlant:
    load = Load(spec.bias.preload, spec.bias.rate, spec.bias.platform)
    return CyclePlant(
        spec.amplifier,
        micro.prepare(spec.driver, spec.thermal, spec.wire, spec.phase, load),
        spec.encoder,
    )


def initial(p: CyclePlant) -> CycleState:
    """At rest, at room temperature, extended."""
    return CycleState(micro.cold(p.micro, p.micro.thermal.ambient), 0.0)


@kernel
def measure(p: CyclePlant, s: CycleState, t: float) -> CycleSample:
    x = s.micro.wire.x
    return CycleSample(
        t,
        encoder.count(p.encoder, x + 0.25 * p.encoder.pitch),
        1.0 if x <= p.micro.driver.extend_on else 0.0,
        s.micro.cut,
    )


@kernel
def advance(
    p: CyclePlant,
    s: CycleState,
    ctrl: Annotated[float, Meaning("D/A voltage latched now", "V")],
    fan: Annotated[float, Meaning("0 or 1")],
    dt: float,
) -> CycleState:
    level = amplifier.ctrl_level(p.amplifier, s.ctrl)
    fine = micro.advance(p.micro, s.micro, level, fan, 0.0, dt)
    return CycleState(fine, max(amplifier.convert(p.amplifier, ctrl), 0.0))
