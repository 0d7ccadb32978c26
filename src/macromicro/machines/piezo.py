"""The machine `piezo`: a piezo stage with a flexure guide, from its data sheet."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from macromicro.arrays import Array
from macromicro.columns import Meaning, Quantity
from macromicro.control import integral
from macromicro.control.integral import Integral
from macromicro.errors import InputError
from macromicro.kernel import kernel
from macromicro.machines import _stability, piezo_sheets
from macromicro.machines.guarding import Limits
from macromicro.machines.parts import Motion, Timing, Travel
from macromicro.machines.sequence import Arrival
from macromicro.machines.signals import Sample
from macromicro.machines.stage import Kind
from macromicro.machines.tree import Problem, derive_all, machine_tree
from macromicro.plant import piezo
from macromicro.plant.creep import Creep
from macromicro.plant.gauge import Gauge
from macromicro.plant.high_voltage import HighVoltage
from macromicro.plant.piezo import Guide, Hidden, PiezoPlant, PiezoState, Stack, Warming

NAME = "piezo"
TITLE = "a piezo stage"


def _problems(tree: Any) -> list[Problem]:
    try:
        piezo.loop(tree.stack, tree.hidden)
    except InputError as error:
        return [("stack.hysteresis", tree.stack.hysteresis, error.accepted)]
    return piezo_sheets.problems(tree) or _stability.problems(tree, _stability.piezo)


@machine_tree(integral.LAW, piezo_sheets.RULES, _problems)
class Piezo(NamedTuple):
    """Settings of ``machine = "piezo"``; `DEFAULT` has derived values filled in."""

    amplifier: HighVoltage = HighVoltage()
    stack: Stack = Stack()
    creep: Creep = Creep()
    guide: Guide = Guide()
    hidden: Hidden = Hidden()
    warming: Warming = Warming()
    encoder: Gauge = Gauge()
    timing: Timing = Timing(1e-4, 2e-5, 4)
    travel: Travel = Travel(0.0, 100e-6)
    motion: Motion = Motion()
    arrival: Arrival = Arrival(1e-8, 5e-3, 2.0)
    controller: Integral = Integral()
    guard: Limits = Limits(silent=5e-3)


DEFAULT: Any = derive_all(Piezo())


class Truth(NamedTuple):
    """True quantities of the simulated stage."""

    position: Annotated[
        float, Quantity("mm", "true position of the platform", column="true_position", scale=1e3)
    ]
    volts: Annotated[float, Quantity("V", "voltage at the stack", column="stack_volts")]


@kernel
def measure(p: PiezoPlant, s: PiezoState, t: float, noise: Array, k: int) -> Sample:
    return Sample(t, piezo.measured(p, s, noise[k, 0]))


@kernel
def advance(
    p: PiezoPlant,
    s: PiezoState,
    effort: Annotated[float, Meaning("at the D/A", "V")],
    noise: Array,
    k: int,
    dt: float,
) -> PiezoState:
    return piezo.advance(p, s, effort, dt)


@kernel
def show(p: PiezoPlant, s: PiezoState) -> Truth:
    return Truth(piezo.position(s), s.volts)


KIND = Kind(NAME, 1, Truth, piezo.prepare, piezo.initial, measure, advance, show)
LAW = integral.LAW
