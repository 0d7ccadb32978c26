"""The machine `wire`: a shape-memory wire against a spring, on a flexure guide, from its sheet."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from macromicro.arrays import Array
from macromicro.columns import Meaning, Quantity
from macromicro.control import stage_pi
from macromicro.control.stage_pi import StagePi
from macromicro.kernel import kernel
from macromicro.machines import _stability, wire_sheets
from macromicro.machines.guarding import Limits
from macromicro.machines.parts import Motion, Timing, Travel
from macromicro.machines.sequence import Arrival
from macromicro.machines.signals import Sample
from macromicro.machines.stage import Kind
from macromicro.machines.tree import Problem, derive_all, machine_tree
from macromicro.plant import gauge, micro
from macromicro.plant.driver import Driver
from macromicro.plant.flexure import Flexure
from macromicro.plant.gauge import Gauge
from macromicro.plant.micro import Micro, MicroState
from macromicro.plant.phase import Phase
from macromicro.plant.thermal import Thermal
from macromicro.plant.wire import Load
from macromicro.plant.wire import Wire as Alloy
from macromicro.schema.par import Par

NAME = "wire"
TITLE = "a shape-memory wire against a spring"
_TABLE = "Dynalloy, F1140, table of Flexinol wires"
_GRAPH = "Dynalloy, F1140, temperature against strain at 172 MPa, 90 degC wire"
_CHOICE = "machine choice"


class Pulses(NamedTuple):
    """A switched current source; its mean heat is proportional to the effort."""

    current: Annotated[float, Par("A", "current while on", _CHOICE, positive=True)] = 1.05
    full_scale: Annotated[
        float, Par("V", "effort at which it is always on", _CHOICE, positive=True)
    ] = 10.0
    lag: Annotated[float, Par("s", "lag of the mean", _CHOICE, shown="ms", lo=0.0)] = 2e-3


class Sheet(NamedTuple):
    """The wire's data sheet."""

    diameter: Annotated[float, Par("m", "diameter", _TABLE, shown="mm", positive=True)] = 0.25e-3
    length: Annotated[float, Par("m", "length", _CHOICE, shown="mm", positive=True)] = 0.1
    resistance: Annotated[
        float, Par("ohm/m", "electrical resistance per length", _TABLE, positive=True)
    ] = 18.5
    pull: Annotated[float, Par("N", "heating pull force", _TABLE, positive=True)] = 8.74
    stretch: Annotated[float, Par("N", "cooling deformation force", _TABLE, lo=0.0)] = 3.49
    cooling: Annotated[float, Par("s", "cooling time in still air", _TABLE, positive=True)] = 4.5
    strain: Annotated[
        float,
        Par("1", "contraction of the length", "Dynalloy: 4 % for many cycles", lo=0.001, hi=0.08),
    ] = 0.04
    heat_start: Annotated[float, Par("degC", "austenite start", _GRAPH)] = 88.0
    heat_end: Annotated[float, Par("degC", "austenite finish", _GRAPH)] = 98.0
    cool_start: Annotated[float, Par("degC", "martensite start", _GRAPH)] = 72.0
    cool_end: Annotated[float, Par("degC", "martensite finish", _GRAPH)] = 62.0


class Spring(NamedTuple):
    """Bias spring and moving mass."""

    preload: Annotated[float, Par("N", "pull at full extension", _CHOICE, lo=0.0)] = 3.7
    rate: Annotated[float, Par("N/m", "spring rate", _CHOICE, lo=0.0)] = 500.0
    mass: Annotated[float, Par("kg", "moving mass", _CHOICE, shown="g", lo=0.0)] = 0.05


class Air(NamedTuple):
    ambient: Annotated[float, Par("degC", "room temperature", _CHOICE, lo=-40, hi=80)] = 22.0
    printed: Annotated[
        float, Par("degC", "room in which the cooling time was measured", lo=-40, hi=80)
    ] = 22.0


class Hidden(NamedTuple):
    """Deviations of a wire and its mounting from the sheet."""

    capacity: Annotated[float, Par("1", "true heat capacity over the alloy's", positive=True)] = 1.1
    latent: Annotated[float, Par("1", "true latent heat over the alloy's", positive=True)] = 0.9
    cooling: Annotated[
        float, Par("1", "true resistance to the air over the derived one", positive=True)
    ] = 1.1
    fold: Annotated[
        float, Par("K", "temperature in which the heating density falls e-fold", positive=True)
    ] = 6.0
    scatter: Annotated[float, Par("K", "scatter of the cooling thresholds", positive=True)] = 4.0


def _problems(tree: Any) -> list[Problem]:
    return wire_sheets.problems(tree) or _stability.problems(tree, _stability.wire)


@machine_tree(stage_pi.LAW, wire_sheets.RULES, _problems)
class WireStage(NamedTuple):
    """Settings of ``machine = "wire"``; `DEFAULT` has derived values filled in."""

    driver: Pulses = Pulses()
    wire: Sheet = Sheet()
    bias: Spring = Spring()
    flexure: Flexure = Flexure()
    air: Air = Air()
    hidden: Hidden = Hidden()
    encoder: Gauge = Gauge(0.5e-6, -2e-3, 10e-3, 0.5e-6)
    timing: Timing = Timing(1e-3, 0.0, 1)
    travel: Travel = Travel(0.0, 3e-3)
    motion: Motion = Motion()
    arrival: Arrival = Arrival(5e-6, 0.1, 10.0)
    controller: StagePi = StagePi()
    guard: Limits = Limits(silent=50e-3)


class Truth(NamedTuple):
    """True quantities of the simulated stage."""

    position: Annotated[
        float, Quantity("mm", "true contraction", column="true_position", scale=1e3)
    ]
    temperature: Annotated[float, Quantity("degC", "temperature of the wire")]
    austenite: Annotated[float, Quantity("1", "share of austenite")]
    power: Annotated[float, Quantity("W", "heat into the wire")]


class WirePlant(NamedTuple):
    micro: Annotated[Micro, Meaning("driver, heat, wire, relays and load")]
    sensor: Annotated[Gauge, Meaning("the sensor")]


def prepare(tree: Any) -> WirePlant:
    sheet, hidden = tree.wire, tree.hidden
    found, section, stroke = (
        wire_sheets.heats(tree),
        wire_sheets.area(tree),
        wire_sheets.stroke(tree),
    )
    stop = 1.5 * stroke  # nothing stands in its way
    full = tree.driver.full_scale
    driver = Driver(
        4.0, (0.0, full), (0.0, wire_sheets.power(tree)), tree.driver.lag, stop, stop, 0.0
    )
    capacity, ohms = hidden.capacity * found.capacity, hidden.cooling * found.resistance
    # As in the thesis' ladder (5.6): most of the resistance is at the wire, the rest behind 45 and
    # 1768 times its heat capacity.
    thermal = Thermal(
        tree.air.ambient,
        capacity, 0.75 * ohms,
        45.0 * capacity, 0.2 * ohms,
        1768.0 * capacity, 0.05 * ohms,
    )  # fmt: skip
    alloy = Alloy(
        stroke, stop, sheet.length, section, wire_sheets.MARTENSITE, wire_sheets.AUSTENITE,
        hidden.latent * found.latent, 1.0 / (wire_sheets.STIFFENING * section), sheet.pull,
    )  # fmt: skip
    slope = (sheet.cool_start - sheet.cool_end) / (sheet.heat_end - sheet.heat_start)
    offset = sheet.cool_start - min(slope, 1.0) * sheet.heat_end
    phase = Phase(
        sheet.heat_start, sheet.heat_end, hidden.fold, offset, min(slope, 1.0), hidden.scatter,
        sheet.cool_end, 2.0,
    )  # fmt: skip
    load = Load(tree.bias.preload, wire_sheets.rate(tree), tree.bias.mass)
    return WirePlant(micro.prepare(driver, thermal, alloy, phase, load), tree.encoder)


def initial(p: WirePlant) -> MicroState:
    """Cold and extended, never heated before."""
    return micro.cold(p.micro, p.micro.thermal.ambient)


@kernel
def measure(p: WirePlant, s: MicroState, t: float, noise: Array, k: int) -> Sample:
    return Sample(t, gauge.reading(p.sensor, s.wire.x, noise[k, 0]))


@kernel
def advance(
    p: WirePlant,
    s: MicroState,
    effort: Annotated[float, Meaning("at the D/A", "V")],
    noise: Array,
    k: int,
    dt: float,
) -> MicroState:
    return micro.advance(p.micro, s, effort, 0.0, 0.0, dt)


@kernel
def show(p: WirePlant, s: MicroState) -> Truth:
    return Truth(s.wire.x, s.wire.temperature, s.wire.austenite, s.power)


DEFAULT: Any = derive_all(WireStage())
KIND = Kind(NAME, 1, Truth, prepare, initial, measure, advance, show)
LAW = stage_pi.LAW
