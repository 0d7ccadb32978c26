"""Titles, captions and claims of the thesis' figures and tables: data, `figures.toml`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from macromicro.drawing.captions import captions, worded
from macromicro.drawing.exhibit import Drawn, Grid

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CAPTIONS = captions(Path(__file__).with_name("figures.toml"))


def captioned(number: str, body: Figure | Grid, /, **values: object) -> Drawn:
    """The figure or table of a number, with its caption; KeyError for an unknown one.

    `values` fill the placeholders of the caption.
    """
    title, caption, claims = CAPTIONS[number]
    return Drawn(title, worded(caption, **values), body, claims)
