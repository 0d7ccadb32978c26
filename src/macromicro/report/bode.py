"""A measured frequency response beside the linear model: numbers, table and Bode plot."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

import macromicro
from macromicro.drawing import files as drawings
from macromicro.drawing import phases
from macromicro.drawing.style import BLACK, BLUE, RED, finish, new
from macromicro.machines.loops import Complex, Margins, margins
from macromicro.machines.machine import Machine, as_toml
from macromicro.machines.sweeping import Response
from macromicro.runs import folder
from macromicro.schema.text import plain, write_text

NUMBERS, FIGURE = "response.json", "bode"
_DOT: dict[str, Any] = {"marker": "o", "markersize": 3, "linestyle": "", "color": BLUE}
_SEEN = {**_DOT, "label": "measured"}
_FAINT = {**_DOT, "markerfacecolor": "none", "label": "below half a count"}
FILES = (NUMBERS, *drawings.names((FIGURE,)))


class Shown(Protocol):
    """A response as numbers, lines and a figure."""

    def content(self) -> dict[str, Any]: ...

    def lines(self) -> list[str]: ...

    def draw(self) -> Any: ...


class Found(NamedTuple):
    machine: Machine
    settings: Any
    measured: Response
    plant: Complex  # of the model, m/V
    seed: int  # of the sensor's noise

    @property
    def loop(self) -> Complex:
        return np.asarray(self.plant * self.measured.law, np.complex128)

    @property
    def seen(self) -> npt.NDArray[np.bool_]:
        """Where the sine moves the stage by half a count or more."""
        pitch = float(self.settings.encoder.pitch)
        return np.asarray(self.measured.moved >= 0.5 * pitch, np.bool_)

    @property
    def margins(self) -> tuple[Margins, Margins]:
        frequency = self.measured.frequency
        return margins(frequency, self.measured.loop), margins(frequency, self.loop)

    def content(self) -> dict[str, Any]:
        r = self.measured
        measured, model = self.margins
        base = self.machine.kind.place.base

        def polar(values: Complex) -> dict[str, Any]:
            return {
                "gain": np.abs(values).tolist(),
                "phase_deg": np.degrees(np.angle(values)).tolist(),
            }

        return {
            "machine": self.machine.name,
            "version": macromicro.__version__,
            "seed": self.seed,
            "margins": {"measured": measured._asdict(), "model": model._asdict()},
            "frequency_hz": r.frequency.tolist(),
            f"plant_{base}_per_v": polar(r.plant),
            f"law_v_per_{base}": polar(r.law),
            "loop": polar(r.loop),
            f"model_plant_{base}_per_v": polar(self.plant),
            "settings": as_toml(self.machine, self.settings),
        }

    def lines(self) -> list[str]:
        told = []
        for which, m in zip(("measured", "linear model"), self.margins, strict=True):
            told.append(describe(which, m))
        seen = self.seen
        if seen.any():
            share = np.abs(self.measured.plant / self.plant)[seen]
            at = self.measured.frequency[seen]
            told.append(
                f"plant, measured to model, from {at[0]:.4g} to {at[-1]:.4g} Hz, where a sine "
                f"moves it by half a count or more: gain {share.min():.3g} to {share.max():.3g}"
            )
        return told

    def draw(self) -> Any:
        r = self.measured
        figure, axes = new(6.2, 2, 2, sharex=True)
        pairs = (
            (f"Plant [{self.machine.kind.place.base}/V]", r.plant, self.plant),
            ("Open loop", r.loop, self.loop),
        )
        for column, (title, measured, model) in enumerate(pairs):
            gain, phase = axes[:, column]
            gain.loglog(r.frequency, np.abs(model), color=RED, linestyle="--", label="linear model")
            for rows, style in ((self.seen, _SEEN), (~self.seen, _FAINT)):
                gain.loglog(r.frequency[rows], np.abs(measured)[rows], **style)
            turned = phases.degrees(measured, model)
            phase.semilogx(r.frequency, phases.degrees(model, model), color=RED, linestyle="--")
            for rows, style in ((self.seen, _SEEN), (~self.seen, _FAINT)):
                phase.semilogx(r.frequency[rows], turned[rows], **style)
            finish(gain, title, "", "gain")
            finish(phase, "", "frequency [Hz]", "phase [deg]")
            phase.axhline(-180.0, color=BLACK, linewidth=0.8, linestyle=":")
        axes[0, 1].axhline(1.0, color=BLACK, linewidth=0.8, linestyle=":")
        keys = axes[0, 0].get_legend_handles_labels()
        figure.legend(*keys, loc="lower center", ncols=len(keys[0]), fontsize=7.5, frameon=False)
        figure.subplots_adjust(hspace=0.15, bottom=0.14)
        return figure


def describe(which: str, m: Margins) -> str:
    phase, gain = _number(m.phase, ".1f", " deg"), _number(m.gain, ".3g")
    text = f"{which}: crossover {_number(m.crossover, '.4g', ' Hz')}, phase margin {phase}, "
    text += f"gain margin {gain}, modulus margin {m.modulus:.3g}"
    return text if m.stable else f"{text}; the closed loop is UNSTABLE"


def _number(value: float, form: str, unit: str = "") -> str:
    """A margin; one beyond the measured frequencies is called so."""
    return "outside the measured range" if math.isnan(value) else f"{value:{form}}{unit}"


def write(out: Path, found: Shown, kinds: Sequence[str]) -> None:
    with folder.staging(out, remove=FILES) as place:
        text = json.dumps(plain(found.content()), indent=2, allow_nan=False)
        write_text(place / NUMBERS, text + "\n")
        if kinds:
            drawings.save(found.draw(), place, FIGURE, kinds)
