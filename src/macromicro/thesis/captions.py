"""Titles, captions and claims of the thesis' figures and tables: data, `figures.toml`."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from macromicro.drawing.exhibit import Drawn, Grid
from macromicro.thesis.claims import filled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LIST = Path(__file__).with_name("figures.toml")


class Caption(NamedTuple):
    """Title and caption with placeholders; a caption may have several wordings by name."""

    title: str
    caption: str | dict[str, str]
    claims: tuple[str, ...] = ()


CAPTIONS = {
    number: Caption(**{**row, "claims": tuple(row.get("claims", ()))})
    for number, row in tomllib.loads(LIST.read_text(encoding="utf-8")).items()
}


def captioned(number: str, body: Figure | Grid, wording: str = "", /, **values: object) -> Drawn:
    """The figure or table of a number, with its caption; KeyError for an unknown one.

    `values` fill the placeholders of the caption; `wording` names one of several.
    """
    title, caption, claims = CAPTIONS[number]
    text = caption if isinstance(caption, str) else caption[wording]
    return Drawn(title, filled(text, **values), body, claims)
