"""Channels of the rig (Appendix C): Tables C.1 and C.2 in the schematic's place."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from macromicro.columns import COLUMNS
from macromicro.drawing.exhibit import Drawn, Grid
from macromicro.experiments import channels
from macromicro.experiments.channels import Channel, Way
from macromicro.experiments.claim import Claim
from macromicro.experiments.procedure import Lab, Procedure


class Wiring(NamedTuple):
    """The rig's channels, and every field's way into the recording."""

    channels: list[Channel]
    ways: list[Way]


def collect(lab: Lab) -> Wiring:
    """Channels by the settings, and the traced ways."""
    return Wiring(channels.channels(lab.settings), channels.ways())


def claims(data: Wiring) -> list[Claim]:
    """None: an appendix."""
    return []


def draw(data: Wiring) -> Iterator[Drawn]:
    """Tables C.1 and C.2."""
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
    yield Drawn(
        "Table C.1",
        "Channels of the rig",
        "What the electrical schematic becomes: every input and output with its converter as set, "
        "the value at which an output is safe, and the recording's column that it goes to. "
        "Outputs take effect one period after they are written.",
        Grid(
            ("channel", "direction", "unit", "hardware", "range", "step", "safe", "recorded as"),
            rows,
        ),
    )
    sources = {w.column.name: f"{w.part}: {w.field}{_times(w)}" for w in data.ways}
    columns: list[tuple[str, ...]] = [
        (c.name, c.unit, c.meaning, sources.get(c.name, "state of controller or guard"))
        for c in COLUMNS
    ]
    yield Drawn(
        "Table C.2",
        "Signals of a recording",
        "Where each column comes from; bench truth is known to the virtual bench only.",
        Grid(("column", "unit", "meaning", "source"), columns),
    )


def _times(way: Way) -> str:
    """The factor into the recording's unit, where it is not 1."""
    return "" if way.factor == 1.0 else f" * {way.factor:g}"


PROCEDURE = Procedure(
    name="channels",
    title="Channels of the rig",
    sections=("3.3", "Appendix C"),
    channels=(),
    ids=(),
    figures=("Table C.1", "Table C.2"),
    diagrams=("3.1", "3.5"),
    seconds=0.1,
    collect=collect,
    claims=claims,
    draw=draw,
)
