"""Flow charts as SVG from an ordered description with jumps, in the block diagrams' style.

For example::

    Flow("Count to ten", (
        start("k = 0"),
        do("k = k + 1", name="next"),
        ask("k = 10?", no="next"),
        end("done"),
    ))
"""

from __future__ import annotations

from typing import NamedTuple

from macromicro.drawing import _plan
from macromicro.drawing._canvas import BLOCK, HEXAGON, ROUND, Shape, drawing, size
from macromicro.drawing._plan import Layout, Line, Thing
from macromicro.drawing._routing import Cell, Link
from macromicro.drawing._symbols import width

NEXT = ""
_WIDEST = 230.0  # of a line of text
_GAP = 34.0


class Step(NamedTuple):
    outline: str  # ROUND, BLOCK or HEXAGON
    text: str  # what is written in it
    name: str  # for jumps to it; "" for none
    # label and name of the step that follows, NEXT for the one below; none for an end
    exits: tuple[tuple[str, str], ...]
    aside: bool = False  # whether it stands to the right of the step before it


class Flow(NamedTuple):
    """Steps from the first to the last; each leads to the next by default."""

    title: str  # title of the picture
    steps: tuple[Step, ...]  # in order


def start(text: str, name: str = "") -> Step:
    return Step(ROUND, text, name, (("", NEXT),))


def do(text: str, name: str = "", then: str = NEXT, *, aside: bool = False) -> Step:
    return Step(BLOCK, text, name, (("", then),), aside)


def ask(text: str, name: str = "", *, yes: str = NEXT, no: str = NEXT, aside: bool = False) -> Step:
    return Step(HEXAGON, text, name, (("yes", yes), ("no", no)), aside)


def end(text: str, name: str = "", *, aside: bool = False) -> Step:
    return Step(ROUND, text, name, (), aside)


def svg(flow: Flow) -> str:
    shapes = {str(k): _shape(step) for k, step in enumerate(flow.steps)}
    return drawing(flow.title, layout(flow), shapes)


def layout(flow: Flow) -> Layout:
    cells = _cells(flow)
    sizes = [size(_shape(step)) for step in flow.steps]
    widest = [0.0, 0.0]
    for (wide, _), (column, _) in zip(sizes, cells, strict=True):
        widest[column] = max(widest[column], wide)
    things = [
        Thing(str(k), cell, widest[cell[0]], high)
        for k, (cell, (_, high)) in enumerate(zip(cells, sizes, strict=True))
    ]
    return _plan.laid_out(things, _lines(flow, cells), gap=_GAP, chart=True)


def targets(flow: Flow, k: int) -> list[int]:
    """Numbers of the steps that may follow a step."""
    names = {step.name: i for i, step in enumerate(flow.steps) if step.name}
    found = []
    for _, goal in flow.steps[k].exits:
        if goal == NEXT:
            after = [i for i in range(k + 1, len(flow.steps)) if not flow.steps[i].aside]
            found.append(after[0] if after else -1)
        else:
            found.append(names.get(goal, -1))
    if -1 in found:
        raise ValueError(f"{flow.title}: step {flow.steps[k].text!r} leads nowhere")
    return found


def wrapped(text: str, widest: float = _WIDEST) -> tuple[str, ...]:
    """A text in the fewest lines, these as short as possible.

    No-break spaces are kept; a word that is too wide has a line of its own.
    """
    lines = _broken(text, widest)
    while True:
        tighter = _broken(text, _longest(lines) - 0.5)
        if len(tighter) > len(lines) or _longest(tighter) >= _longest(lines):
            return lines
        lines = tighter


def _longest(lines: tuple[str, ...]) -> float:
    return max(width(line) for line in lines)


def _broken(text: str, widest: float) -> tuple[str, ...]:
    lines: list[str] = []
    for word in text.split(" "):
        if lines and width(f"{lines[-1]} {word}") <= widest:
            lines[-1] += f" {word}"
        else:
            lines.append(word)
    return tuple(lines)


def _shape(step: Step) -> Shape:
    return Shape(step.outline, wrapped(step.text))


def _cells(flow: Flow) -> list[Cell]:
    """Column 0 downwards; `aside` steps in column 1, beside the step before them."""
    cells: list[Cell] = []
    row = -1
    for step in flow.steps:
        row += not step.aside
        cells.append((int(step.aside), row))
    return cells


def _lines(flow: Flow, cells: list[Cell]) -> list[Line]:
    lines = []
    for k, step in enumerate(flow.steps):
        for (label, _), goal in zip(step.exits, targets(flow, k), strict=True):
            (x, y), (u, v) = cells[k], cells[goal]
            if x == u and v == y + 1:
                out, into = "S", "N"
            elif v == y:
                out, into = ("E", "W") if u > x else ("W", "E")
            else:
                out, into = "EW" if len(step.exits) > 1 else "SEW", "NEW"
            lines.append(Line(Link(cells[k], cells[goal], out, into, goal), label))
    return lines
