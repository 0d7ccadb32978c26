"""Units of export: of each machine, and filters and hysteresis by themselves."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from macromicro import hall_table, programme, simulate, types
from macromicro.control import cascade, correction, deadzone, notch, outside, pi, supervisor
from macromicro.control import settings as control_settings
from macromicro.control.macro import LAWS
from macromicro.control.stage_law import Sample, Target
from macromicro.export.kinds import REAL, Rows
from macromicro.export.units import Entry, Made, Unit, law_of
from macromicro.hysteresis import invert, memory, prandtl
from macromicro.machines import (
    correcting,
    guarding,
    lines,
    piezo,
    piezo_sheets,
    planning,
    sequence,
    tree,
)
from macromicro.nominal import PERIOD
from macromicro.plant import bench, carriage
from macromicro.programme import travel
from macromicro.rig import guard, sensing
from macromicro.rig.board import control as board
from macromicro.types import Lines

TWO_STAGE = "two_stage"
_SAMPLE = types.Sample(*[0.0] * len(types.Sample._fields))
_COMMAND = types.Command(*[0.0] * len(types.Command._fields))
_AT, _TO = Sample(0.0, 0.0), Target(0.0, 0.0, 0.0, math.inf)


def of_machine(machine: Any, settings: Any) -> Made:
    """Units of a machine of one stage: its law, guard, programme and plant."""
    kind = machine.kind
    found = {
        "law": partial(_stage_law, machine, settings),
        "guard": partial(_stage_guard, machine, settings),
        "sequence": partial(_stage_sequence, machine, settings),
        "plant": partial(_stage_plant, machine, settings, kind, "plant", "simulated"),
    }
    if isinstance(settings.guard, guarding.Limits):
        found["lines"] = partial(_stage_lines, machine, settings)
    if tree.is_corrected(settings):
        found["correction"] = partial(_stage_correction, machine, settings)
    if machine.equip is not None and hasattr(settings, "switches") and not kind.lines:
        with_lines = settings.with_({"switches.limits": "both", "switches.home": "cam"})
        equipped = machine.equip(with_lines)
        words = "simulated, with switches"
        found["wired"] = partial(_stage_plant, machine, with_lines, equipped, "wired", words)
    return {f"{machine.name}.{name}": make for name, make in found.items()}


def _stage_law(machine: Any, settings: Any) -> Unit:
    gains, period = tree.gains(settings), float(settings.timing.period)
    return law_of(f"{machine.name}.law", machine.law, gains, period)


def _stage_guard(machine: Any, settings: Any) -> Unit:
    limits, first = settings.guard, guarding.fresh()
    entry = Entry("step", guarding.step, (limits, first, _AT, _TO, 0.0))
    return _unit(machine, settings, "guard", f"guard of {machine.title}", (entry,),
                 {"limits": limits}, first)  # fmt: skip


def _stage_sequence(machine: Any, settings: Any) -> Unit:
    plan = planning.plan(planning.usual(settings), settings)
    rule, first = settings.arrival, sequence.begin()
    entry = Entry("step", sequence.step, (plan, rule, first, _AT))
    words = f"programme and set points of {machine.title}, its usual moves"
    given = {"plan": plan, "arrival": rule}
    return _unit(machine, settings, "sequence", words, (entry,), given, first)


def _stage_lines(machine: Any, settings: Any) -> Unit:
    """The guard's check of switches and drive, called before the guard."""
    quiet = Lines(0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 20.0)
    wired, held, watch = lines.wiring(settings), lines.Held(), guarding.fresh()
    entries = (
        Entry("step", lines.step, (wired, held, watch, quiet, _AT, 0.0)),
        Entry("bounded", lines.bounded, (settings.guard, wired, held)),
    )
    words = f"guard of the switches and the drive's lines of {machine.title}"
    given = {"wired": wired, "limits": settings.guard}
    return _unit(machine, settings, "lines", words, entries, given, held)


def _stage_correction(machine: Any, settings: Any) -> Unit:
    """Positions at readings, and readings at set points; the law goes on in readings."""
    tables, flank = correcting.tables(settings), correction.Flank()
    alone, degrees = Rows(REAL, (1,)), 20.0  # readings and set points of this stage alone
    entries = (
        Entry("position", correction.position, (tables, flank, 0.0, alone, degrees, 0.0)),
        Entry("aimed", correction.aimed, (tables, flank, _TO, alone, alone, degrees, 0.0)),
        Entry("effort", correction.effort, (tables, flank, _TO, _TO, 0.0, 0.0)),
    )
    words = f"calibration of {machine.title}"
    return _unit(machine, settings, "correction", words, entries, {"tables": tables}, flank)


def _stage_plant(machine: Any, settings: Any, kind: Any, name: str, words: str) -> Unit:
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
        entries.append(Entry("enable", kind.switch, (params, state, 1.0)))
    title = f"{machine.title}, {words}"
    return _unit(machine, settings, name, title, tuple(entries), {"params": params}, state)


def _unit(
    machine: Any, settings: Any, name: str, title: str, entries: tuple[Entry, ...],
    given: dict[str, Any], state: Any,
) -> Unit:  # fmt: skip
    period = float(settings.timing.period)
    return Unit(f"{machine.name}.{name}", title, entries, given, state, period)


def two_stage(settings: Any) -> Made:
    """Units of the thesis' machine: laws, supervisor, guard, the bench and parts of it."""
    found: dict[str, Callable[[Any], Unit]]
    found = {law.field: partial(_law_on_counts, law) for law in LAWS}
    found |= {law: partial(_named_law, law) for law in (*outside.SHIPPED, *outside.FINE)}
    found |= {
        "micro": _micro,
        "supervisor": _supervisor,
        "guard": _guard,
        "board": _board,
        "plant": _bench,
        "macro": _macro,
    }
    return {f"{TWO_STAGE}.{name}": partial(make, settings) for name, make in found.items()}


def _law_on_counts(law: Any, settings: Any) -> Unit:
    gains = getattr(settings.controller, law.field)
    entries = (
        Entry("start", law.start, (0.0,)),
        Entry("step", law.step, (gains, law.start(0.0), 0.0, 0.0)),
    )
    words = f"law {law.name} of the macro-stage, on the error in counts"
    return Unit(f"{TWO_STAGE}.{law.field}", words, entries, {"gains": gains})


def _named_law(name: str, settings: Any) -> Unit:
    law, spec = outside.find(name, "law"), settings.controller
    found = (each for each in (spec.own, spec.fine) if outside.of(each) == name)
    return law_of(f"{TWO_STAGE}.{name}", law, next(found, law.gains()), PERIOD)


def _micro(settings: Any) -> Unit:
    spec, name = settings.controller, f"{TWO_STAGE}.micro"
    if outside.of(spec.fine) == spec.micro_law:
        return law_of(name, outside.law_of_gains(spec.fine), spec.fine, PERIOD)
    gains = getattr(spec, spec.micro_law.replace("-", "_"))
    entry = Entry("step", pi.step, (gains, 0.0, 0.0, 0.0))
    words = f"law {spec.micro_law} of the micro-stage"
    return Unit(name, words, (entry,), {"gains": gains}, memory=("integral",))


def _supervisor(settings: Any) -> Unit:
    table, pitch = hall_table.of_bench(settings), settings.sensors.encoder.pitch
    params = control_settings.prepare(settings.controller, table=table, pitch=pitch)
    limits = travel.limits(settings.travel, pitch)
    plan = simulate.plan(programme.load(programme.find("thesis"), limits))
    first = supervisor.begin(0.0, params)
    entry = Entry("step", supervisor.step, (params, plan, first, _SAMPLE, 0.0))
    words = "the macro-then-micro supervisor with both laws, and the programme of the thesis"
    given = {"params": params, "plan": plan}
    return Unit(f"{TWO_STAGE}.supervisor", words, (entry,), given, first)


def _guard(settings: Any) -> Unit:
    params, first = guard.prepare(settings.guard, hall_table.of_bench(settings)), guard.fresh()
    entry = Entry("step", guard.step, (params, first, _SAMPLE, _COMMAND, types.SAFE, 0.0))
    return Unit(f"{TWO_STAGE}.guard", "guard of both stages", (entry,), {"params": params}, first)


def _board(settings: Any) -> Unit:
    spec, first = settings.controller, guard.fresh()
    params = board.prepare(
        settings.guard,
        hall_table.of_bench(settings),
        spec.pd_tuned,
        spec.pi_antiwindup,
        control_settings.prepare(spec).macro.dead_zone,
    )
    order = board.Order(False, 0.0, 0.0, False, False, 0.0, 0.0, 0.0, False, False, False)
    entries = (
        Entry("drive", board.drive, (params, board.REST, 0.0, 0.0, order, 0.0)),
        Entry("judge", guard.step, (params.guard, first, _SAMPLE, _COMMAND, types.SAFE, 0.0)),
        Entry("temperature", guard.temperature, (params.guard.limits, first)),
        Entry("spike", sensing.spike, (params.guard.limits,)),
    )
    given = {"params": params, "guard": params.guard, "rest": board.REST}
    words = "a period of the microcontroller board (docs/board.md)"
    return Unit(f"{TWO_STAGE}.board", words, entries, given, first)


def _bench(settings: Any) -> Unit:
    params = bench.prepare(settings.bench, settings.sensors)
    first, draw = bench.initial(params), bench.Noise()
    entries = (
        Entry("measure", bench.measure, (params, first, 0.0, draw)),
        Entry("advance", bench.advance, (params, first, types.SAFE, draw, 0.0)),
        Entry("show", bench.truth, (params, first)),
    )
    words = "the whole bench of the thesis: macro-stage, micro-stage, sensors"
    return Unit(f"{TWO_STAGE}.plant", words, entries, {"params": params}, first)


def _macro(settings: Any) -> Unit:
    whole, first = bench.prepare(settings.bench, settings.sensors), carriage.at_rest(0.0)
    entry = Entry("advance", carriage.advance, (whole.macro, first, 0.0, 0.0, whole.macro_steps))
    words = "the macro-stage alone, from motor volts"
    return Unit(f"{TWO_STAGE}.macro", words, (entry,), {"params": whole.macro}, first)


def parts(settings: Any) -> Made:
    """Units without a machine."""
    return {
        "observer": _observer,
        "notch": _notch,
        "dead-zone": _dead_zone,
        "preisach": partial(_preisach, settings),
        "prandtl": _prandtl,
    }


def _observer() -> Unit:
    entry = Entry("step", cascade.observed, (100.0, 0.0, 0.0, _AT, 0.0))
    words = "the correction of a Luenberger observer of place and speed, as the cascade has it"
    return Unit("observer", words, (entry,), {})


def _notch() -> Unit:
    given, first = notch.Notch(frequency=50.0), notch.Delays(0.0, 0.0)
    entry = Entry("step", notch.step, (given, first, 0.0, 0.0))
    return Unit("notch", "a notch filter", (entry,), {"params": given}, first)


def _dead_zone() -> Unit:
    entry = Entry("step", deadzone.inverse, (0.0, 0.0))
    return Unit("dead-zone", "the inverse of a dead zone", (entry,), {})


def _preisach(settings: Any) -> Unit:
    table = bench.prepare(settings.bench, settings.sensors).micro.table
    first = memory.fresh(table, table.lo)
    entries = (
        Entry("advance", memory.advance, (table, first, 0.0)),
        Entry("peek", memory.peek, (table, first, 0.0)),
        Entry("invert", invert.invert, (table, first, 0.0)),
        Entry("maximum", invert.maximum_for, (table, 0.0, 0.0)),
    )
    words = "Preisach model of the actuator's alloy, forward and inverse"
    return Unit("preisach", words, entries, {"table": table}, first)


def _prandtl() -> Unit:
    given = piezo_sheets.loop(piezo.DEFAULT)
    first = prandtl.Plays(np.zeros(len(given.thresholds)), 0.0)
    entries = (
        Entry("advance", prandtl.advance, (given, first, 0.0, 0.0)),
        Entry("output", prandtl.output, (given, first)),
    )
    words = "Prandtl-Ishlinskii model of the piezo stage"
    return Unit("prandtl", words, entries, {"table": given}, first)
