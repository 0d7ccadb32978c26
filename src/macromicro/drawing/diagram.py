"""Block diagrams as SVG from a small description: a grid of names, blocks, and wires.

For example::

    Diagram(
        "Proportional control",
        "r (e) K G y",
        {"K": block("K_p"), "G": block("1//s + 1")},
        "r > e > K > G > y; G >- e",
    )
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

from macromicro.drawing import _plan
from macromicro.drawing._canvas import BLOCK, SIGNAL, SUM, Shape, drawing, size
from macromicro.drawing._plan import Frame, Layout, Line, Thing
from macromicro.drawing._routing import Cell, Link
from macromicro.drawing._symbols import MINUS

_ARROW = re.compile(r"(~?)>([-+]?)(?:\[([^\]]*)\])?")
_MARKS = {"<": "W", "↓": "S", "↑": "N"}
_OPPOSITE = {"E": "W", "W": "E", "S": "N", "N": "S"}
_SIGNS = {"-": MINUS, "+": "+", "": "+"}


class Diagram(NamedTuple):
    """A block diagram; texts as in `symbols`."""

    title: str  # title of the picture
    # rows of names, one a line, "." for an empty cell. "(e)" is a sum; a name in `blocks` is that
    # block; every other name is a signal, written as it stands. A mark before a name turns its
    # flow: "<" leftwards, "↓" down, "↑" up
    grid: str
    blocks: Mapping[str, Shape]  # by name
    # chains "r > e > D" separated by ";". ">-" ends at a sum with a minus, "~>" is an event, drawn
    # dashed; ">[V']" has a label, without spaces. Wires from one source share their beginning
    wires: str
    frames: tuple[Frame, ...] = ()  # around some of the blocks


class _Placed(NamedTuple):
    cell: Cell
    flow: str  # the side at which it leaves
    shape: Shape


def block(*lines: str, icon: str = "") -> Shape:
    return Shape(BLOCK, lines, icon)


def saturation(*lines: str) -> Shape:
    return block(*lines, icon="saturation")


def dead_zone(*lines: str) -> Shape:
    return block(*lines, icon="dead zone")


def relay(*lines: str) -> Shape:
    return block(*lines, icon="relay")


def quantiser(*lines: str) -> Shape:
    return block(*lines, icon="quantiser")


def framed(label: str, names: str) -> Frame:
    """A dashed frame around blocks."""
    return Frame(label, tuple(names.split()))


def svg(diagram: Diagram) -> str:
    shapes = {name: p.shape for name, p in _cells(diagram).items()}
    return drawing(diagram.title, layout(diagram), shapes)


def layout(diagram: Diagram) -> Layout:
    cells = _cells(diagram)
    things = [Thing(name, p.cell, *size(p.shape)) for name, p in cells.items()]
    return _plan.laid_out(things, _lines(diagram, cells), diagram.frames)


def _cells(diagram: Diagram) -> dict[str, _Placed]:
    """The content of cells, by name."""
    found: dict[str, _Placed] = {}
    for row, text in enumerate(diagram.grid.strip().splitlines()):
        for column, token in enumerate(text.split()):
            if token == ".":
                continue
            name, flow = token.lstrip("<↓↑"), _MARKS.get(token[0], "E")
            if name.startswith("("):
                name, shape = name[1:-1], Shape(SUM)
            else:
                shape = diagram.blocks.get(name) or Shape(SIGNAL, (name,))
            if name in found:
                raise ValueError(f"{diagram.title}: two cells called {name}")
            found[name] = _Placed((column, row), flow, shape)
    missing = set(diagram.blocks) - set(found)
    if missing:
        raise ValueError(f"{diagram.title}: not in the grid: {sorted(missing)}")
    return found


def _lines(diagram: Diagram, cells: Mapping[str, _Placed]) -> list[Line]:
    """The wires with the sides at which they may leave and enter."""
    entered: set[str] = set()
    lines = []
    for chain in diagram.wires.split(";"):
        source, *rest = chain.split()
        for arrow, target in zip(rest[::2], rest[1::2], strict=True):
            parts = _ARROW.fullmatch(arrow)
            unknown = {source, target} - set(cells)
            if parts is None or unknown:
                raise ValueError(f"{diagram.title}: cannot read wire {source} {arrow} {target}")
            event, goal = bool(parts[1]), cells[target]
            lines.append(
                Line(
                    Link(
                        cells[source].cell,
                        goal.cell,
                        _exits(cells[source], event),
                        _entries(goal, target in entered, event),
                        (source, event),
                    ),
                    parts[3] or "",
                    _SIGNS[parts[2]] if goal.shape.outline == SUM else "",
                    event,
                )
            )
            if not event:
                entered.add(target)
            source = target
    return lines


def _exits(p: _Placed, event: bool) -> str:
    """Signals leave along the flow; events at any side but the entry's."""
    return "".join(s for s in "ESNW" if s != _OPPOSITE[p.flow]) if event else p.flow


def _entries(p: _Placed, entered: bool, event: bool) -> str:
    """A sum is entered at any side but its exit's; a block from behind.

    Events and further wires enter a block from the side.
    """
    if p.shape.outline == SUM:
        return "".join(s for s in "WSNE" if s != p.flow)
    aside = "NS" if p.flow in "EW" else "WE"
    return aside if entered or event else _OPPOSITE[p.flow]
