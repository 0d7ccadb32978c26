"""Every channel of the rig, and its columns in a recording (Appendix C).

The way into the recording is traced: a marked period is written with the loop's own `note`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from macromicro import nominal
from macromicro.columns import Column
from macromicro.control import supervisor
from macromicro.drawing.exhibit import Drawn, Grid
from macromicro.plant.bench import Truth
from macromicro.recorded import COLUMNS, ROWS, inside, note
from macromicro.rig import guard
from macromicro.settings import Settings
from macromicro.thesis.contents import caption
from macromicro.thesis.procedure import Lab
from macromicro.types import SAFE, Command, Outputs, Sample
from macromicro.units import quantity

MARK = 0.5  # a number that phases and faults, which are whole, are not


class Way(NamedTuple):
    """A field that reaches a column of the recording: column = factor * field."""

    part: str
    field: str
    column: Column
    factor: float

    @property
    def unit(self) -> str:
        """The field's unit: the column's if the factor is 1, else SI."""
        if self.factor == 1.0:
            return self.column.unit
        unit = {"mm": "m", "um": "m", "mm/s": "m/s"}[self.column.unit]
        if not math.isclose(quantity(f"{self.factor:g} {self.column.unit}", unit, "unit"), 1.0):
            raise ValueError(f"{self.column.name}: {self.factor:g} {self.column.unit} per {unit}")
        return unit


class Channel(NamedTuple):
    """A channel of the rig; hardware, range, step and safe state in words, "" where unknown."""

    name: str
    direction: str  # "in" or "out"
    hardware: str
    range: str
    step: str
    safe: str
    ways: tuple[Way, ...]


def ways() -> list[Way]:
    parts: tuple[tuple[str, type[Any]], ...] = (
        ("sample", Sample),
        ("outputs", Outputs),
        ("command", Command),
        ("bench truth", Truth),
    )
    plain = _marked_column({})
    found = []
    for part, kind in parts:
        for field in kind._fields:
            change = _marked_column({part: field}) - plain
            for row in np.flatnonzero(change):
                found.append(Way(part, field, COLUMNS[row], float(change[row]) / MARK))
    return found


def _marked_column(marked: dict[str, str]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """One period's column with a mark in one field, zero in all others."""

    def made(part: str, kind: type[Any]) -> Any:
        return kind(*[MARK if marked.get(part) == field else 0.0 for field in kind._fields])

    block = np.empty((ROWS, 1))
    note(
        block,
        0,
        made("sample", Sample),
        made("command", Command),
        made("outputs", Outputs),
        inside(supervisor.begin(0.0), guard.fresh(), nominal.AMBIENT),
        made("bench truth", Truth),
    )
    found: np.ndarray[Any, np.dtype[np.float64]] = np.nan_to_num(block[:, 0])
    return found


def channels(settings: Settings) -> list[Channel]:
    traced = ways()
    facts = {**_inputs(settings), **_outputs(settings)}
    rows = []
    for part, fields in (("sample", Sample._fields[1:]), ("outputs", Outputs._fields)):
        for name in fields:
            hardware, span, step = facts.get(name, ("not in the thesis", "", ""))
            own = tuple(w for w in traced if (w.part, w.field) == (part, name))
            out = part == "outputs"
            safe = f"{getattr(SAFE, name):g}" if out else ""
            rows.append(Channel(name, "out" if out else "in", hardware, span, step, safe, own))
    return rows


def _inputs(settings: Settings) -> dict[str, tuple[str, str, str]]:
    """Hardware, range and step of each field of `Sample` except the time."""
    encoder, converter = settings.sensors.encoder, settings.sensors.converter
    driver, laser = settings.bench.driver, settings.sensors.laser
    volts = converter.full_scale / 2.0**converter.bits
    return {
        "encoder": (
            f"optical encoder of the carriage, {encoder.bits:g}-bit counter",
            f"±2^{encoder.bits - 1:g} counts",
            f"1 count, {1e6 * encoder.pitch:.2f} um",
        ),
        "hall": (
            f"Hall sensor, A/D of {converter.bits:g} bits and sign",
            f"±{converter.full_scale:g} V",
            f"{1e3 * volts:.4f} mV",
        ),
        "laser": ("laser interferometer", "since its reset", f"{1e9 * laser.resolution:g} nm"),
        "extend": (
            "EXTEND of the actuator, digital input",
            f"1 up to {1e3 * driver.extend_on:g} mm",
            "",
        ),
        "contract": (
            "CONTRACT of the actuator, digital input; it cuts the wires' current itself",
            f"1 from {1e3 * driver.contract_on:g} to below {1e3 * driver.contract_off:g} mm",
            "",
        ),
    }


def _outputs(settings: Settings) -> dict[str, tuple[str, str, str]]:
    """Hardware, range and step of each field of `Outputs`."""
    board, limits = settings.bench.amplifier, settings.guard
    step = f"{2e3 * board.full_scale / 2.0**board.bits:.4f} mV"
    analog = f"D/A of {board.bits:g} bits, PWM amplifier of {board.supply:g} V,"

    def duty(most: float) -> str:
        return f"{analog} {100.0 * most:g} % duty at {board.full_scale:g} V"

    return {
        "motor": (
            f"{duty(board.motor_duty)}: motor of the carriage",
            f"±{min(limits.motor, board.full_scale):g} V",
            step,
        ),
        "ctrl": (
            f"{duty(board.ctrl_duty)}: CTRL of the actuator, "
            f"whose supply is {settings.bench.driver.supply:g} V",
            f"0 to {min(limits.ctrl, board.full_scale):g} V",
            step,
        ),
        "fan": ("cooling fan, digital output", "0 or 1", ""),
        "laser_reset": ("reset of the laser, digital output", "0 or 1", ""),
    }


class Wiring(NamedTuple):
    channels: list[Channel]
    ways: list[Way]


def collect(lab: Lab) -> Wiring:
    return Wiring(channels(lab.settings), ways())


def channel_table(data: Wiring) -> Drawn:
    rows: list[tuple[str, ...]] = [
        (
            c.name,
            c.direction,
            c.ways[0].unit,
            c.hardware,
            c.range,
            c.step,
            c.safe,
            ", ".join(f"{w.column.name} [{w.column.unit}]{_times(w)}" for w in c.ways),
        )
        for c in data.channels
    ]
    return caption(
        "Table C.1",
        Grid(
            ("channel", "direction", "unit", "hardware", "range", "step", "safe", "recorded as"),
            rows,
        ),
    )


def signals(data: Wiring) -> Drawn:
    sources = {w.column.name: f"{w.part}: {w.field}{_times(w)}" for w in data.ways}
    columns: list[tuple[str, ...]] = [
        (c.name, c.unit, c.meaning, sources.get(c.name, "state of controller or guard"))
        for c in COLUMNS
    ]
    return caption("Table C.2", Grid(("column", "unit", "meaning", "source"), columns))


def _times(way: Way) -> str:
    """The factor into the recording's unit, if it is not 1."""
    return "" if way.factor == 1.0 else f" * {way.factor:g}"
