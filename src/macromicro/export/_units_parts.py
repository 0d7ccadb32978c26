"""Units without a machine: filters, hysteresis."""

from __future__ import annotations

from typing import Any

import numpy as np

from macromicro.control import cascade
from macromicro.control import deadzone as inverse
from macromicro.control import notch as filters
from macromicro.control.stage_law import Sample
from macromicro.export.units import Entry, Made, Unit
from macromicro.hysteresis import invert, memory, prandtl
from macromicro.machines import piezo, piezo_sheets
from macromicro.plant import bench


def parts(settings: Any) -> Made:
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
            Entry("maximum", invert.maximum_for, (table, 0.0, 0.0)),
        )
        words = "Preisach model of the actuator's alloy, forward and inverse"
        return Unit("preisach", words, entries, {"table": table}, first)

    def plays() -> Unit:

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
