"""Every channel of the rig, and its columns in a recording (Appendix C).

The way into the recording is traced: a marked period is written with the loop's own `note`.
"""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
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

_FACTS: dict[str, dict[str, str]] = tomllib.loads(
    Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
)
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
    safe: str
    ways: tuple[Way, ...]
    hardware: str = "not in the thesis"
    range: str = ""
    step: str = ""


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
    traced, values = ways(), _values(settings)
    rows = []
    for part, fields in (("sample", Sample._fields[1:]), ("outputs", Outputs._fields)):
        for name in fields:
            facts = _FACTS.get(name, {})
            words = {what: text.format(**values) for what, text in facts.items()}
            own = tuple(w for w in traced if (w.part, w.field) == (part, name))
            out = part == "outputs"
            safe = f"{getattr(SAFE, name):g}" if out else ""
            rows.append(Channel(name, "out" if out else "in", safe, own, **words))
    return rows


def _values(settings: Settings) -> dict[str, object]:
    """The values of the placeholders in `channels.toml`."""
    sensors, board, driver = settings.sensors, settings.bench.amplifier, settings.bench.driver
    return {
        "sensors": sensors,
        "board": board,
        "driver": driver,
        "sign_bit": sensors.encoder.bits - 1,
        "pitch_um": 1e6 * sensors.encoder.pitch,
        "hall_mv": 1e3 * sensors.converter.full_scale / 2.0**sensors.converter.bits,
        "laser_nm": 1e9 * sensors.laser.resolution,
        "extend_on": 1e3 * driver.extend_on,  # mm
        "contract_on": 1e3 * driver.contract_on,
        "contract_off": 1e3 * driver.contract_off,
        "analog": f"D/A of {board.bits:g} bits, PWM amplifier of {board.supply:g} V,",
        "motor_duty": 100.0 * board.motor_duty,  # %
        "ctrl_duty": 100.0 * board.ctrl_duty,
        "motor": min(settings.guard.motor, board.full_scale),  # V
        "ctrl": min(settings.guard.ctrl, board.full_scale),
        "output_mv": 2e3 * board.full_scale / 2.0**board.bits,
    }


class Wiring(NamedTuple):
    channels: list[Channel]
    ways: list[Way]


def collect(lab: Lab) -> Wiring:
    return Wiring(channels(lab.settings), ways())


def channel_table(data: Wiring) -> Drawn:
    rows: list[tuple[str, ...]] = []
    for c in data.channels:
        recorded = ", ".join(f"{w.column.name} [{w.column.unit}]{_times(w)}" for w in c.ways)
        unit = c.ways[0].unit
        rows.append((c.name, c.direction, unit, c.hardware, c.range, c.step, c.safe, recorded))
    headings = ("channel", "direction", "unit", "hardware", "range", "step", "safe", "recorded as")
    return caption("Table C.1", Grid(headings, rows))


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
