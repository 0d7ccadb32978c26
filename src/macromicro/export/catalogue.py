"""What can be exported: laws, observers, guards, sequences, hysteresis and plants, by name."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from macromicro.control import cascade, outside, pi, supervisor
from macromicro.control import deadzone as inverse
from macromicro.control import notch as filters
from macromicro.control import settings as control_settings
from macromicro.control.macro import LAWS
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.errors import InputError
from macromicro.export import kinds
from macromicro.export.kinds import REAL, Rows
from macromicro.kernel import is_kernel
from macromicro.schema import plugins
from macromicro.schema.config import load_overrides
from macromicro.schema.text import printable


class Entry(NamedTuple):
    """A function that the user of the exported code calls.

    Attributes
    ----------
    name : str
        In C, behind the unit's.
    function : Callable
        The kernel.
    arguments : tuple[Any, ...]
        An example of each, or its type.
    """

    name: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]


class Unit(NamedTuple):
    """What is exported under one name.

    Attributes
    ----------
    name : str
        Of it.
    title : str
        For people.
    entries : tuple[Entry, ...]
        What is called, in the order of a period.
    given : dict[str, Any]
        Parameters and tables that are written into the code.
    state : Any
        At the start; None for what has none, or makes it in a function of its own.
    period : float
        Control period for the example, s.
    memory : tuple[str, ...]
        Numbers that a function takes and returns anew, where no state holds them.
    """

    name: str
    title: str
    entries: tuple[Entry, ...]
    given: dict[str, Any]
    state: Any = None
    period: float = 1e-3
    memory: tuple[str, ...] = ()


TWO_STAGE = "two_stage"


def _law_of(name: str, law: StageLaw, gains: Any, period: float) -> Unit:
    """A law of one stage, with its gains."""
    sample, target = Sample(0.0, 0.0), Target(0.0, 0.0, 0.0)
    memory = law.start(gains, sample)
    entries = [Entry("step", law.step, (gains, memory, target, sample, 0.0))]
    state = memory
    if is_kernel(law.start):
        entries.insert(0, Entry("start", law.start, (gains, sample)))
        state = None
    return Unit(name, f"law {law.name}", tuple(entries), {"gains": gains}, state, period)


def _stage(machine: Any, settings: Any) -> dict[str, Callable[[], Unit]]:
    """The units of a machine of one stage."""
    from macromicro.machines import guarding, planning, sequence, tree

    kind, law, period = machine.kind, machine.law, float(settings.timing.period)
    name, title = machine.name, machine.title

    def law_unit() -> Unit:
        if not (is_kernel(law.step)):
            accepted = "a law whose step is a kernel, under @kernel (docs/laws.md)"
            raise InputError(f"law {law.name}", "plain Python", accepted)
        return _law_of(f"{name}.law", law, tree.gains(settings), period)

    def guard_unit() -> Unit:
        arguments = (settings.guard, guarding.fresh(), Sample(0.0, 0.0), Target(0.0, 0.0, 0.0), 0.0)
        entry = Entry("step", guarding.step, arguments)
        words = f"guard of {title}"
        return Unit(f"{name}.guard", words, (entry,), {"limits": settings.guard}, arguments[1],
                    period)  # fmt: skip

    def sequence_unit() -> Unit:
        plan = planning.plan(planning.usual(settings), settings)
        rule, first = settings.arrival, sequence.begin()
        entry = Entry("step", sequence.step, (plan, rule, first, Sample(0.0, 0.0)))
        given = {"plan": plan, "arrival": rule}
        words = f"programme and set points of {title}, its usual moves"
        return Unit(f"{name}.sequence", words, (entry,), given, first, period)

    def plant_unit() -> Unit:
        params = kind.prepare(settings)
        state = kind.initial(params)
        noise = Rows(REAL, (None, kind.noises))
        entries = [
            Entry("measure", kind.measure, (params, state, 0.0, noise, 0)),
            Entry("advance", kind.advance, (params, state, 0.0, noise, 0, 0.0)),
            Entry("show", kind.show, (params, state)),
        ]
        if kind.lines:
            entries.append(Entry("sense", kind.sense, (params, state)))
            entries.append(Entry("enable", kind.switch, (params, state, 0.0)))
        given = {"params": params}
        return Unit(f"{name}.plant", f"{title}, simulated", tuple(entries), given, state, period)

    return {
        f"{name}.law": law_unit,
        f"{name}.guard": guard_unit,
        f"{name}.sequence": sequence_unit,
        f"{name}.plant": plant_unit,
    }


def _two_stage(settings: Any) -> dict[str, Callable[[], Unit]]:
    """The units of the thesis' machine."""
    from macromicro import types
    from macromicro.control import calibration
    from macromicro.plant import bench, carriage
    from macromicro.rig import guard

    spec, name = settings.controller, TWO_STAGE

    def law_unit(law: Any) -> Callable[[], Unit]:
        def made() -> Unit:
            gains = getattr(spec, law.field)
            entries = (
                Entry("start", law.start, (0.0,)),
                Entry("step", law.step, (gains, law.start(0.0), 0.0, 0.0)),
            )
            words = f"law {law.name} of the macro-stage, on the error in counts"
            return Unit(f"{name}.{law.field}", words, entries, {"gains": gains})

        return made

    def micro_unit() -> Unit:
        gains = getattr(spec, spec.micro_law.replace("-", "_"))
        entry = Entry("step", pi.step, (gains, 0.0, 0.0, 0.0))
        words = f"law {spec.micro_law} of the micro-stage"
        return Unit(f"{name}.micro", words, (entry,), {"gains": gains}, memory=("integral",))

    def supervisor_unit() -> Unit:
        from macromicro import programme, simulate
        from macromicro.programme import travel

        prepared = control_settings.prepare(spec)
        limits = travel.limits(settings.travel, settings.sensors.encoder.pitch)
        plan = simulate.plan(programme.load(programme.find("thesis"), limits))
        first = supervisor.begin(0.0, prepared.macro)
        sample = types.Sample(*[0.0] * len(types.Sample._fields))
        entry = Entry("step", supervisor.step, (prepared, plan, first, sample, 0.0))
        words = "the macro-then-micro supervisor with both laws, and the programme of the thesis"
        return Unit(f"{name}.supervisor", words, (entry,), {"params": prepared, "plan": plan},
                    first)  # fmt: skip

    def guard_unit() -> Unit:
        params, first = guard.prepare(settings.guard, calibration.shipped()), guard.fresh()
        sample = types.Sample(*[0.0] * len(types.Sample._fields))
        command = types.Command(*[0.0] * len(types.Command._fields))
        arguments = (params, first, sample, command, types.SAFE, 0.0)
        entry = Entry("step", guard.step, arguments)
        return Unit(f"{name}.guard", "guard of both stages", (entry,), {"params": params}, first)

    def plant_unit() -> Unit:
        params = bench.prepare(settings.bench, settings.sensors)
        first, draw = bench.initial(params), bench.Noise()
        entries = (
            Entry("measure", bench.measure, (params, first, 0.0, draw)),
            Entry("advance", bench.advance, (params, first, types.SAFE, draw, 0.0)),
            Entry("show", bench.truth, (params, first)),
        )
        words = "the whole bench of the thesis: macro-stage, micro-stage, sensors"
        return Unit(f"{name}.plant", words, entries, {"params": params}, first)

    def macro_unit() -> Unit:
        params = bench.prepare(settings.bench, settings.sensors)
        arguments = (params.macro, carriage.at_rest(0.0), 0.0, 0.0, params.macro_steps)
        entry = Entry("advance", carriage.advance, arguments)
        given = {"params": params.macro}
        return Unit(f"{name}.macro", "the macro-stage alone, from motor volts", (entry,), given,
                    arguments[1])  # fmt: skip

    laws = {f"{name}.{law.field}": law_unit(law) for law in LAWS}
    return laws | {
        f"{name}.micro": micro_unit,
        f"{name}.supervisor": supervisor_unit,
        f"{name}.guard": guard_unit,
        f"{name}.plant": plant_unit,
        f"{name}.macro": macro_unit,
    }


def _parts(settings: Any) -> dict[str, Callable[[], Unit]]:
    """Units of no machine."""
    from macromicro.hysteresis import invert, memory, prandtl
    from macromicro.plant import bench

    def observer() -> Unit:
        arguments = (100.0, 0.0, 0.0, Sample(0.0, 0.0), 0.0)
        entry = Entry("step", cascade.observed, arguments)
        words = "the correction of a Luenberger observer of place and speed, as the cascade has it"
        return Unit("observer", words, (entry,), {})

    def notch() -> Unit:
        given = filters.Notch(frequency=50.0)
        entry = Entry("step", filters.step, (given, filters.Delays(0.0, 0.0), 0.0, 0.0))
        return Unit(
            "notch", "a notch filter", (entry,), {"params": given}, filters.Delays(0.0, 0.0)
        )

    def dead_zone() -> Unit:
        entry = Entry("step", inverse.inverse, (0.0, 0.0))
        return Unit("dead-zone", "the inverse of a dead zone", (entry,), {})

    def preisach() -> Unit:
        params = bench.prepare(settings.bench, settings.sensors)
        table = params.micro.table
        first = memory.fresh(table, table.lo)
        entries = (
            Entry("advance", memory.advance, (table, first, 0.0)),
            Entry("peek", memory.peek, (table, first, 0.0)),
            Entry("invert", invert.invert, (table, first, 0.0)),
        )
        words = "Preisach model of the actuator's alloy, forward and inverse"
        return Unit("preisach", words, entries, {"table": table}, first)

    def plays() -> Unit:
        from macromicro.machines import piezo, piezo_sheets

        given = piezo_sheets.loop(piezo.DEFAULT)
        first = prandtl.Plays(np.zeros(len(given.thresholds)), 0.0)
        entries = (
            Entry("advance", prandtl.advance, (given, first, 0.0, 0.0)),
            Entry("output", prandtl.output, (given, first)),
        )
        return Unit("prandtl", "Prandtl-Ishlinskii model of the piezo stage", entries,
                    {"table": given}, first)  # fmt: skip

    return {
        "observer": observer,
        "notch": notch,
        "dead-zone": dead_zone,
        "preisach": preisach,
        "prandtl": plays,
    }


def every(config: Path | None = None) -> dict[str, Callable[[], Unit]]:
    """All units of a machine's settings; of all machines as they ship without.

    Raises `InputError` for a file that is no settings file.
    """
    from macromicro.machines import machine as machines
    from macromicro.settings import Settings

    found: dict[str, Callable[[], Unit]] = {}
    if config is not None:
        machine = machines.chosen(config)
        if machine is not None:
            loaded, tree = machines.load(config)
            return _stage(loaded, tree)
        return _two_stage(load_overrides(config, Settings()))
    found |= _two_stage(Settings())
    for machine in machines.MACHINES:
        found |= _stage(machine, machine.settings)
    return found | _parts(Settings())


def unit(what: str, config: Path | None = None) -> Unit:
    """The unit of a name.

    Parameters
    ----------
    what : str
        One of `every`, or "module:law" of the user's.
    config : Path | None, optional
        Settings of a machine.

    Raises `InputError` for any other name.
    """
    units = every(config)
    if what in units:
        return units[what]()
    if outside.is_name(what):
        return _own(what)
    near = difflib.get_close_matches(what, units, 1)
    names = ", ".join(units)
    accepted = f"{near[0]!r}? One of {names}" if near else f"one of {names}"
    raise InputError("WHAT", printable(what), f"{accepted}; or MODULE:LAW, a law of your own")


def _own(what: str) -> Unit:
    """A law or a kernel that the user names."""
    place = plugins.place(what, outside.GROUP)
    assert place is not None  # as `is_name` says
    made = plugins.load(place, "WHAT", "a law or a kernel", lambda it: is_kernel(it) or _law(it))
    name = what.partition(":")[2] or what
    if is_kernel(made):
        return alone(name, made)
    law = outside.find(what, "WHAT")
    if not is_kernel(law.step):
        accepted = "a law whose step is a kernel, under @kernel (docs/laws.md)"
        raise InputError("WHAT", f"{printable(what)}, plain Python", accepted)
    return _law_of(name, law, law.gains(), 1e-3)


def _law(made: Any) -> bool:
    return isinstance(made, StageLaw) or hasattr(made, "step")


def alone(name: str, function: Callable[..., Any]) -> Unit:
    """A kernel whose annotations say all of its types.

    Raises `InputError` for one whose do not.
    """
    hints = kinds.hints_of(function)
    arguments = []
    for parameter in inspect.signature(function).parameters:
        try:
            arguments.append(kinds.of_hint(hints.get(parameter, Any)))
        except kinds.Unlike as error:
            where = f"{function.__module__}.{function.__qualname__}, {parameter}"
            accepted = "float, int, bool, or a NamedTuple of them"
            raise InputError(where, str(error), accepted) from None
    entry = Entry("go", function, tuple(arguments))
    return Unit(name, words_of(function), (entry,), {})


def words_of(function: Callable[..., Any]) -> str:
    """The first line of a kernel's docstring, or its name."""
    text = inspect.getdoc(function) or function.__name__
    return text.partition("\n")[0].rstrip(".")
