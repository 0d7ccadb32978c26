"""Exhibits: a numbered figure, diagram or table, with its caption and its claims."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

from macromicro.drawing.files import DEFAULT, PNG, SVG, encode

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TABLE = "table"


class Grid(NamedTuple):
    headings: tuple[str, ...]  # headings of the columns
    rows: list[tuple[str, ...]]  # texts, each as long as `headings`


class Drawn(NamedTuple):
    title: str  # heading
    caption: str  # what to look at
    body: Figure | str | Grid  # A matplotlib figure, a diagram as SVG text, or a `Grid`
    claims: tuple[str, ...] = ()  # ids of the claims that it shows


class Exhibit(NamedTuple):
    """The same in a form that passes between processes."""

    # the thesis' own, such as "4.8", "D.9", "Table 2.1", or "(2.1)" for what an equation says
    number: str
    title: str  # heading
    caption: str  # what to look at
    claims: tuple[str, ...]  # ids
    kind: str  # PNG, SVG or TABLE
    data: bytes | str | Grid  # A PNG file's bytes, SVG text, or a `Grid`
    # of a figure: the files that are wanted, by format
    files: dict[str, bytes] = {}  # noqa: RUF012 - nobody changes it

    @property
    def label(self) -> str:
        """As cited: "Figure 4.8", "Table 2.1", "Equation (2.1)"."""
        return label(self.number)

    @property
    def name(self) -> str:
        """For file names and anchors: "figure-4-8", "table-2-1"."""
        return re.sub(r"[^a-z0-9]+", "-", self.label.lower()).strip("-")


def label(number: str) -> str:
    if number.startswith("Table"):
        return number
    return f"{'Equation' if number.startswith('(') else 'Figure'} {number}"


def render(number: str, drawn: Drawn, kinds: Iterable[str] = DEFAULT) -> Exhibit:
    body = drawn.body
    head = (number, drawn.title, drawn.caption, drawn.claims)
    if isinstance(body, Grid):
        return Exhibit(*head, TABLE, body)
    if isinstance(body, str):
        return Exhibit(*head, SVG, body)
    shown = encode(body)
    files = {kind: shown if kind == PNG else encode(body, kind) for kind in kinds}
    return Exhibit(*head, PNG, shown, files)
