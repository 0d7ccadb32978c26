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

from macromicro.drawing import plan
from macromicro.drawing.canvas import BLOCK, HEXAGON, ROUND, Shape, drawing, size
from macromicro.drawing.plan import Layout, Line, Thing
from macromicro.drawing.routing import Cell, Link
from macromicro.drawing.symbols import width

NEXT = ""
_WIDEST = 230.0  # of a line of text
_GAP = 34.0


class Step(NamedTuple):
    """One step of a flow chart.

    Attributes
    ----------
    outline : str
        ROUND, BLOCK or HEXAGON.
    text : str
        What is written in it.
    name : str
        For jumps to it; "" for none.
    exits : tuple[tuple[str, str], ...]
        Label and name of the step that follows, NEXT for the one below; none for an end.
    aside : bool
        Whether it stands to the right of the step before it.
    """

    outline: str
    text: str
    name: str
    exits: tuple[tuple[str, str], ...]
    aside: bool = False


class Flow(NamedTuple):
    """Steps from the first to the last; each leads to the next unless it says otherwise.

    Attributes
    ----------
    title : str
        Title of the picture.
    steps : tuple[Step, ...]
        In order.
    """

    title: str
    steps: tuple[Step, ...]


def start(text: str, name: str = "") -> Step:
    """Where it begins.

    Parameters
    ----------
    text : str
        What is written in it.
    name : str, optional
        For jumps to it.

    Returns
    -------
    Step
        The step.
    """
    return Step(ROUND, text, name, (("", NEXT),))


def do(text: str, name: str = "", then: str = NEXT, *, aside: bool = False) -> Step:
    """An action.

    Parameters
    ----------
    text : str
        What is written in it.
    name : str, optional
        For jumps to it.
    then : str, optional
        The step after it.
    aside : bool, optional
        Whether it stands to the right of the step before it.

    Returns
    -------
    Step
        The step.
    """
    return Step(BLOCK, text, name, (("", then),), aside)


def ask(text: str, name: str = "", *, yes: str = NEXT, no: str = NEXT, aside: bool = False) -> Step:
    """A decision.

    Parameters
    ----------
    text : str
        What is written in it.
    name : str, optional
        For jumps to it.
    yes, no : str, optional
        The steps where they lead.
    aside : bool, optional
        Whether it stands to the right of the step before it.

    Returns
    -------
    Step
        The step.
    """
    return Step(HEXAGON, text, name, (("yes", yes), ("no", no)), aside)


def end(text: str, name: str = "", *, aside: bool = False) -> Step:
    """Where it ends.

    Parameters
    ----------
    text : str
        What is written in it.
    name : str, optional
        For jumps to it.
    aside : bool, optional
        Whether it stands to the right of the step before it.

    Returns
    -------
    Step
        The step.
    """
    return Step(ROUND, text, name, (), aside)


def svg(flow: Flow) -> str:
    """A chart as SVG.

    Parameters
    ----------
    flow : Flow
        Its description.

    Returns
    -------
    str
        SVG text.

    Raises
    ------
    ValueError
        A jump to a step that does not exist.
    """
    shapes = {str(k): _shape(step) for k, step in enumerate(flow.steps)}
    return drawing(flow.title, layout(flow), shapes)


def layout(flow: Flow) -> Layout:
    """Where everything of a chart stands.

    Parameters
    ----------
    flow : Flow
        Its description.

    Returns
    -------
    Layout
        Boxes are named by the number of their step, from 0.

    Raises
    ------
    ValueError
        A jump to a step that does not exist.
    """
    cells = _cells(flow)
    sizes = [size(_shape(step)) for step in flow.steps]
    widest = [0.0, 0.0]
    for (wide, _), (column, _) in zip(sizes, cells, strict=True):
        widest[column] = max(widest[column], wide)
    things = [
        Thing(str(k), cell, widest[cell[0]], high)
        for k, (cell, (_, high)) in enumerate(zip(cells, sizes, strict=True))
    ]
    return plan.laid_out(things, _lines(flow, cells), gap=_GAP, chart=True)


def targets(flow: Flow, k: int) -> list[int]:
    """Numbers of the steps that may follow a step.

    Parameters
    ----------
    flow : Flow
        Its description.
    k : int
        Number of the step, from 0.

    Returns
    -------
    list[int]
        In the order of its exits.

    Raises
    ------
    ValueError
        One does not exist.
    """
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
    """A text in as few lines as it fits, these as short as can be.

    No-break spaces are kept; a word that is too wide has a line of its own.

    Parameters
    ----------
    text : str
        To be broken.
    widest : float, optional
        Units.

    Returns
    -------
    tuple[str, ...]
        Lines.
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
    """Words into lines, each filled as far as it goes."""
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
    """Column 0 downwards; what is aside in column 1, beside the step before it."""
    cells: list[Cell] = []
    row = -1
    for step in flow.steps:
        row += not step.aside
        cells.append((int(step.aside), row))
    return cells


def _lines(flow: Flow, cells: list[Cell]) -> list[Line]:
    """The wires; those to one step may join."""
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
