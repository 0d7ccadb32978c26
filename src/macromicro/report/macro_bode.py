"""Bode plot of the macro-stage's linear model (4.4) under a law."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

import macromicro
from macromicro.arrays import Array
from macromicro.drawing.style import BLACK, RED, finish, new
from macromicro.errors import InputError, ProblemError
from macromicro.machines.loops import Complex, Margins, margins
from macromicro.models.macro import Linear
from macromicro.report.bode import describe
from macromicro.settings import Settings
from macromicro.tuning import loops

LAWS = ("pid", "pd-initial", "pd-tuned")  # those that are polynomials in z
LOW, HIGH = 5e-5, 0.45  # of the loop's frequency


class Found(NamedTuple):
    law: str
    frequency: Array
    loop: Complex
    margins: Margins

    def lines(self) -> list[str]:
        return [
            describe(f"macro-stage, linear model (4.4) under {self.law}", self.margins),
            "not measured: the carriage moves at 0.1 m/s or more and ends its travel within 2 s",
        ]

    def content(self) -> dict[str, Any]:
        loop = self.loop
        return {
            "machine": Settings().machine(),
            "law": self.law,
            "version": macromicro.__version__,
            "margins": {"model": self.margins._asdict()},
            "frequency_hz": self.frequency.tolist(),
            "model_loop": {"gain": np.abs(loop), "phase_deg": np.degrees(np.angle(loop))},
        }

    def draw(self) -> Any:
        figure, axes = new(5.0, 2, sharex=True)
        gain, phase = axes[:, 0]
        gain.loglog(self.frequency, np.abs(self.loop), color=RED)
        phase.semilogx(self.frequency, np.degrees(np.unwrap(np.angle(self.loop))), color=RED)
        gain.axhline(1.0, color=BLACK, linewidth=0.8, linestyle=":")
        phase.axhline(-180.0, color=BLACK, linewidth=0.8, linestyle=":")
        finish(gain, f"Open loop, (4.4) under {self.law}", "", "gain")
        finish(phase, "", "frequency [Hz]", "phase [deg]")
        return figure


def find(settings: Settings, low: float | None, high: float | None, count: int) -> Found:
    law, dt = settings.controller.macro_law, Linear().dt
    if law not in LAWS:
        raise InputError("controller.macro_law", law, f"one of {', '.join(LAWS)}")
    first, last = (LOW / dt if low is None else low), (HIGH / dt if high is None else high)
    if not 0.0 < first < last <= HIGH / dt:
        remedy = f"Let them rise from above 0 to at most {HIGH / dt:g} Hz."
        raise ProblemError("frequencies", f"they go from {first:g} to {last:g} Hz", remedy)
    frequency = np.geomspace(first, last, count)

    def at(f: Array) -> Complex:
        return loops.macro_response(settings.controller, f)

    exact = loops.macro_margins(settings.controller)
    if exact.stable:
        size = 1.0 / exact.peak_s
        own = Margins(exact.crossover / (2.0 * np.pi), exact.phase, exact.gain, size, True)
    else:
        fine = np.geomspace(LOW / dt, HIGH / dt, 4000)
        own = margins(fine, at(fine))._replace(stable=False)
    return Found(law, frequency, at(frequency), own)
