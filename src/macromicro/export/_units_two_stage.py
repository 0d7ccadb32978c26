"""Units of the thesis' machine: laws, supervisor, guard, the bench and parts of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from macromicro import hall_table, programme, simulate, types
from macromicro.control import outside, pi, supervisor
from macromicro.control import settings as control_settings
from macromicro.control.macro import LAWS
from macromicro.export.units import Entry, Made, Unit, law_of
from macromicro.nominal import PERIOD
from macromicro.plant import bench, carriage
from macromicro.programme import travel
from macromicro.rig import guard, sensing
from macromicro.rig.board import control as board

TWO_STAGE = "two_stage"
_SAMPLE = types.Sample(*[0.0] * len(types.Sample._fields))
_COMMAND = types.Command(*[0.0] * len(types.Command._fields))


def _laws(spec: Any, name: str) -> Made:
    """The macro-stage's laws: those of the error alone, and those of the contract of laws."""

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

    def named_unit(law_name: str) -> Callable[[], Unit]:
        def made() -> Unit:
            law = outside.find(law_name, "law")
            found = (each for each in (spec.own, spec.fine) if outside.of(each) == law_name)
            gains = next(found, law.gains())
            return law_of(f"{name}.{law_name}", law, gains, PERIOD)

        return made

    found = {f"{name}.{law.field}": law_unit(law) for law in LAWS}
    return found | {f"{name}.{law}": named_unit(law) for law in (*outside.SHIPPED, *outside.FINE)}


def two_stage(settings: Any) -> Made:
    spec, name = settings.controller, TWO_STAGE

    def micro_unit() -> Unit:
        if outside.of(spec.fine) == spec.micro_law:
            return law_of(f"{name}.micro", outside.having(spec.fine), spec.fine, PERIOD)
        gains = getattr(spec, spec.micro_law.replace("-", "_"))
        entry = Entry("step", pi.step, (gains, 0.0, 0.0, 0.0))
        words = f"law {spec.micro_law} of the micro-stage"
        return Unit(f"{name}.micro", words, (entry,), {"gains": gains}, memory=("integral",))

    def supervisor_unit() -> Unit:
        pitch = settings.sensors.encoder.pitch
        prepared = control_settings.prepare(spec, table=hall_table.of_bench(settings), pitch=pitch)
        limits = travel.limits(settings.travel, pitch)
        plan = simulate.plan(programme.load(programme.find("thesis"), limits))
        first = supervisor.begin(0.0, prepared)
        entry = Entry("step", supervisor.step, (prepared, plan, first, _SAMPLE, 0.0))
        words = "the macro-then-micro supervisor with both laws, and the programme of the thesis"
        return Unit(f"{name}.supervisor", words, (entry,), {"params": prepared, "plan": plan},
                    first)  # fmt: skip

    def guard_unit() -> Unit:
        params, first = guard.prepare(settings.guard, hall_table.of_bench(settings)), guard.fresh()
        arguments = (params, first, _SAMPLE, _COMMAND, types.SAFE, 0.0)
        entry = Entry("step", guard.step, arguments)
        return Unit(f"{name}.guard", "guard of both stages", (entry,), {"params": params}, first)

    def board_unit() -> Unit:
        params = board.prepare(
            settings.guard,
            hall_table.of_bench(settings),
            spec.pd_tuned,
            spec.pi_antiwindup,
            control_settings.prepare(spec).macro.dead_zone,
        )
        first = guard.fresh()
        order = board.Order(False, 0.0, 0.0, False, False, 0.0, 0.0, 0.0, False, False, False)
        entries = (
            Entry("drive", board.drive, (params, board.REST, 0.0, 0.0, order, 0.0)),
            Entry("judge", guard.step, (params.guard, first, _SAMPLE, _COMMAND, types.SAFE, 0.0)),
            Entry("temperature", guard.temperature, (params.guard.limits, first)),
            Entry("spike", sensing.spike, (params.guard.limits,)),
        )
        given = {"params": params, "guard": params.guard, "rest": board.REST}
        words = "a period of the microcontroller board (docs/firmware.md)"
        return Unit(f"{name}.board", words, entries, given, first)

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

    return _laws(spec, name) | {
        f"{name}.micro": micro_unit,
        f"{name}.supervisor": supervisor_unit,
        f"{name}.guard": guard_unit,
        f"{name}.board": board_unit,
        f"{name}.plant": plant_unit,
        f"{name}.macro": macro_unit,
    }
