"""Exhibits: a numbered figure, diagram or table, with its caption and the claims it shows."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

from macromicro.drawing.files import DEFAULT, PNG, SVG, encoded

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TABLE = "table"


class Grid(NamedTuple):
    """A table.

    Attributes
    ----------
    headings : tuple[str, ...]
        Headings of the columns.
    rows : list[tuple[str, ...]]
        Texts, each as long as `headings`.
    """

    headings: tuple[str, ...]
    rows: list[tuple[str, ...]]


class Drawn(NamedTuple):
    """What a procedure shows.

    Attributes
    ----------
    number : str
        The thesis' own, such as "4.8", "D.9", "Table 2.1", or "(2.1)" for what an equation says.
    title : str
        Heading.
    caption : str
        What to look at.
    body : Figure | str | Grid
        A matplotlib figure, a diagram as SVG text, or a `Grid`.
    claims : tuple[str, ...]
        Ids of the claims that it shows.
    """

    number: str
    title: str
    caption: str
    body: Figure | str | Grid
    claims: tuple[str, ...] = ()


class Exhibit(NamedTuple):
    """The same in a form that passes between processes.

    Attributes
    ----------
    number : str
        As of `Drawn`.
    title : str
        Heading.
    caption : str
        What to look at.
    claims : tuple[str, ...]
        Ids.
    kind : str
        PNG, SVG or TABLE.
    data : bytes | str | Grid
        A PNG file's bytes, SVG text, or a `Grid`.
    files : dict[str, bytes]
        Of a figure: the files that are wanted, by format.
    """

    number: str
    title: str
    caption: str
    claims: tuple[str, ...]
    kind: str
    data: bytes | str | Grid
    files: dict[str, bytes] = {}  # noqa: RUF012 - nobody changes it

    @property
    def label(self) -> str:
        """As it is cited: "Figure 4.8", "Table 2.1", "Equation (2.1)"."""
        return label(self.number)

    @property
    def name(self) -> str:
        """For file names and anchors: "figure-4-8", "table-2-1"."""
        return re.sub(r"[^a-z0-9]+", "-", self.label.lower()).strip("-")


def label(number: str) -> str:
    """How an exhibit is cited.

    Parameters
    ----------
    number : str
        Its number.

    Returns
    -------
    str
        "Figure 4.8", "Equation (2.1)", "Table 2.1".
    """
    if number.startswith("Table"):
        return number
    return f"{'Equation' if number.startswith('(') else 'Figure'} {number}"


def rendered(drawn: Drawn, kinds: Iterable[str] = DEFAULT) -> Exhibit:
    """What a procedure shows, with its body as bytes or text.

    Parameters
    ----------
    drawn : Drawn
        As drawn.
    kinds : iterable of str, optional
        Formats of the files of a figure; diagrams are SVG in any case.

    Returns
    -------
    Exhibit
        To be passed on.
    """
    body = drawn.body
    head = (drawn.number, drawn.title, drawn.caption, drawn.claims)
    if isinstance(body, Grid):
        return Exhibit(*head, TABLE, body)
    if isinstance(body, str):
        return Exhibit(*head, SVG, body)
    shown = encoded(body)
    files = {kind: shown if kind == PNG else encoded(body, kind) for kind in kinds}
    return Exhibit(*head, PNG, shown, files)
