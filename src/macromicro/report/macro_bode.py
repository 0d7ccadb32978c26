"""Bode plot of the macro-stage's linear model (4.4) under a law."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

import macromicro
from macromicro.arrays import Array
from macromicro.drawing import files as drawings
from macromicro.drawing.style import BLACK, RED, finish, new
from macromicro.errors import InputError, ProblemError
from macromicro.machines.loops import Complex, Margins, margins
from macromicro.models.macro import Linear
from macromicro.report.bode import FIGURE, NUMBERS, said
from macromicro.runs import folder
from macromicro.schema.text import plain, write_text
from macromicro.settings import Settings
from macromicro.tuning import loops

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LAWS = ("pid", "pd-initial", "pd-tuned")  # those that are polynomials in z
LOW, HIGH = 5e-5, 0.45  # of the loop's frequency


class Found(NamedTuple):
    law: str
    frequency: Array
    loop: Complex
    margins: Margins


def found(settings: Settings, low: float | None, high: float | None, count: int) -> Found:
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


def lines(shown: Found) -> list[str]:
    return [
        said(f"macro-stage, linear model (4.4) under {shown.law}", shown.margins),
        "not measured: the carriage moves at 0.1 m/s or more and ends its travel within 2 s",
    ]


def content(shown: Found) -> dict[str, Any]:
    loop = shown.loop
    return {
        "machine": Settings().machine(),
        "law": shown.law,
        "version": macromicro.__version__,
        "margins": {"model": shown.margins._asdict()},
        "frequency_hz": shown.frequency.tolist(),
        "model_loop": {"gain": np.abs(loop), "phase_deg": np.degrees(np.angle(loop))},
    }


def write(out: Path, shown: Found, kinds: Sequence[str]) -> None:
    with folder.staged(out, remove=(NUMBERS, *drawings.names((FIGURE,)))) as place:
        text = json.dumps(plain(content(shown)), indent=2, allow_nan=False)
        write_text(place / NUMBERS, text + "\n")
        if kinds:
            drawings.save(_draw(shown), place, FIGURE, kinds)


def _draw(shown: Found) -> Figure:
    figure, axes = new(5.0, 2, sharex=True)
    gain, phase = axes[:, 0]
    gain.loglog(shown.frequency, np.abs(shown.loop), color=RED)
    phase.semilogx(shown.frequency, np.degrees(np.unwrap(np.angle(shown.loop))), color=RED)
    gain.axhline(1.0, color=BLACK, linewidth=0.8, linestyle=":")
    phase.axhline(-180.0, color=BLACK, linewidth=0.8, linestyle=":")
    finish(gain, f"Open loop, (4.4) under {shown.law}", "", "gain")
    finish(phase, "", "frequency [Hz]", "phase [deg]")
    return figure
