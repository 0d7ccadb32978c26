"""Units of a machine of one stage: its law, guard, programme and plant."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from macromicro.control.stage_law import Sample, Target
from macromicro.errors import ProblemError
from macromicro.export.kinds import REAL, Rows
from macromicro.export.units import Entry, Made, Unit, law_of
from macromicro.kernel import is_kernel
from macromicro.machines import guarding, lines, planning, sequence, tree
from macromicro.types import Lines


def of_machine(machine: Any, settings: Any) -> Made:
    kind, law, period = machine.kind, machine.law, float(settings.timing.period)
    name, title = machine.name, machine.title

    def law_unit() -> Unit:
        if not (is_kernel(law.step)):
            accepted = "Make its step a kernel with @kernel (docs/laws.md)."
            raise ProblemError(f"law {law.name}", "plain Python", accepted)
        return law_of(f"{name}.law", law, tree.gains(settings), period)

    def guard_unit() -> Unit:
        arguments = (
            settings.guard,
            guarding.fresh(),
            Sample(0.0, 0.0),
            Target(0.0, 0.0, 0.0, math.inf),
            0.0,
        )
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

    def lines_unit() -> Unit:
        """The guard's check of switches and drive, called before `guard_unit`."""
        quiet, sample = Lines(0.0, 0.0, 0.0, 0.0, 0.0, 1.0), Sample(0.0, 0.0)
        wired, held, watch = lines.wired(settings), lines.Held(), guarding.fresh()
        step = Entry("step", lines.step, (wired, held, watch, quiet, sample, 0.0))
        bound = Entry("bounded", lines.bounded, (settings.guard, wired, held))
        given = {"wired": wired, "limits": settings.guard}
        words = f"guard of the switches and the drive's lines of {title}"
        return Unit(f"{name}.lines", words, (step, bound), given, held, period)

    def plant_of(made: Any, tree_: Any, suffix: str, words: str) -> Callable[[], Unit]:
        return lambda: _plant(f"{name}.{suffix}", words, made, tree_, period)

    units = {
        f"{name}.law": law_unit,
        f"{name}.guard": guard_unit,
        f"{name}.sequence": sequence_unit,
        f"{name}.plant": plant_of(kind, settings, "plant", f"{title}, simulated"),
    }
    if isinstance(settings.guard, guarding.Limits):
        units[f"{name}.lines"] = lines_unit
    if machine.equip is not None and hasattr(settings, "switches") and not kind.lines:
        with_lines = settings.with_({"switches.limits": "both", "switches.home": "cam"})
        words = f"{title}, simulated, with switches"
        units[f"{name}.wired"] = plant_of(machine.equip(with_lines), with_lines, "wired", words)
    return units


def _plant(name: str, words: str, kind: Any, settings: Any, period: float) -> Unit:
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
    return Unit(name, words, tuple(entries), {"params": params}, state, period)
