"""The machine `piezo`: a piezo stage with a flexure guide, from its data sheet."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, NamedTuple, Self

from macromicro.arrays import Array
from macromicro.columns import Quantity
from macromicro.control import integral
from macromicro.control.integral import Integral
from macromicro.errors import InputError
from macromicro.kernel import kernel
from macromicro.machines import piezo_sheets
from macromicro.machines.axis import settled
from macromicro.machines.feasible import Problem
from macromicro.machines.guarding import Limits
from macromicro.machines.parts import Motion, Timing, Travel
from macromicro.machines.sequence import Arrival
from macromicro.machines.signals import Sample
from macromicro.machines.stage import Kind
from macromicro.plant import piezo
from macromicro.plant.creep import Creep
from macromicro.plant.gauge import Gauge
from macromicro.plant.high_voltage import HighVoltage
from macromicro.plant.piezo import Guide, Hidden, PiezoBench, PiezoPlant, PiezoState, Stack, Warming
from macromicro.schema import access

NAME = "piezo"
TITLE = "a piezo stage"


class Piezo(NamedTuple):
    """The tree behind ``machine = "piezo"``; `DEFAULT` has what is derived filled in."""

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

    def machine(self) -> str:
        """Name of the machine.

        Returns
        -------
        str
            As a settings file names it.
        """
        return NAME

    def derived(self) -> tuple[tuple[str, Callable[[Any], Any]], ...]:
        """What follows from other settings, unless it is set itself.

        Returns
        -------
        tuple[tuple[str, Callable[[Any], Any]], ...]
            Pairs of a path and the rule that computes its value from the tree.
        """
        return piezo_sheets.RULES

    def together(self) -> list[Problem]:
        """What cannot work together.

        Returns
        -------
        list[Problem]
            Path, value, and what is accepted and why; none if all is well.
        """
        try:
            piezo.loop(self.stack, self.hidden)
        except InputError as error:
            return [("stack.hysteresis", self.stack.hysteresis, error.accepted)]
        return piezo_sheets.problems(self)

    def with_(self, changes: str | Mapping[str, object], value: object = None) -> Self:
        """These settings with other values, and with what follows from them.

        Parameters
        ----------
        changes : str | Mapping[str, object]
            Path of a parameter; or several paths with their values.
        value : object, optional
            Of the one path: "20 g", or a plain value where the parameter has no unit.

        Returns
        -------
        Self
            A changed copy.

        Raises
        ------
        InputError
            As of a settings file.
        """
        return access.changed(self, changes, value)


DEFAULT: Piezo = settled(Piezo())


class Truth(NamedTuple):
    """What only the simulated stage knows."""

    position: Annotated[
        float, Quantity("mm", "true position of the platform", column="true_position", scale=1e3)
    ]
    volts: Annotated[float, Quantity("V", "voltage at the stack", column="stack_volts")]


def prepare(tree: Any) -> PiezoPlant:
    """Runtime parameters of the stage.

    Parameters
    ----------
    tree : Any
        Settings.

    Returns
    -------
    PiezoPlant
        For the kernels of `plant.piezo`.
    """
    return piezo.prepare(
        PiezoBench(
            tree.amplifier,
            tree.stack,
            tree.creep,
            tree.guide,
            tree.hidden,
            tree.warming,
            tree.encoder,
            tree.timing.delay,
            tree.timing.steps,
        )
    )


@kernel
def measure(p: PiezoPlant, s: PiezoState, t: float, noise: Array, k: int) -> Sample:
    """What the stage shows.

    Parameters
    ----------
    p : PiezoPlant
        Runtime parameters.
    s : PiezoState
        State.
    t : float
        Now, s.
    noise : ndarray, shape (periods, 1)
        Standard normal draws.
    k : int
        Their row.

    Returns
    -------
    Sample
        Position in m.
    """
    return Sample(t, piezo.measured(p, s, noise[k, 0]))


@kernel
def advance(
    p: PiezoPlant, s: PiezoState, effort: float, noise: Array, k: int, dt: float
) -> PiezoState:
    """The stage after one control period.

    Parameters
    ----------
    p : PiezoPlant
        Runtime parameters.
    s : PiezoState
        State; its arrays are changed in place.
    effort : float
        V at the D/A.
    noise : ndarray, shape (periods, 1)
        Not used here.
    k : int
        Its row.
    dt : float
        Control period, s.

    Returns
    -------
    PiezoState
        New state.
    """
    return piezo.advance(p, s, effort, dt)


@kernel
def show(p: PiezoPlant, s: PiezoState) -> Truth:
    """What is true of the stage.

    Parameters
    ----------
    p : PiezoPlant
        Runtime parameters.
    s : PiezoState
        State.

    Returns
    -------
    Truth
        SI.
    """
    return Truth(piezo.position(s), s.volts)


KIND = Kind(NAME, 1, Truth, prepare, piezo.initial, measure, advance, show)
LAW = integral.LAW
