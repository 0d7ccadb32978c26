"""Pages from templates, with everything escaped and pictures inlined."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from macromicro.drawing import files

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLE = Path(__file__).parent / "page.css"


class Picture(NamedTuple):
    name: str  # name of its file, without suffix
    title: str  # heading
    caption: str  # what to look at
    png: bytes  # A PNG file's bytes

    @property
    def uri(self) -> str:
        return f"data:image/png;base64,{base64.b64encode(self.png).decode()}"


class Drawn(NamedTuple):
    """A figure of a result."""

    name: str  # of its file, without suffix
    # title, caption: for the page
    title: str
    caption: str
    figure: Figure


def pictures(drawn: Iterable[Drawn], folder: Path, kinds: Iterable[str]) -> list[Picture]:
    """Save figures in a folder; what a page shows of them."""
    return [
        Picture(d.name, d.title, d.caption, files.save(d.figure, folder, d.name, kinds))
        for d in drawn
    ]


def filled(template: Path, **values: Any) -> str:
    """A template with its values, all escaped; a missing name is an error.

    `style`, the shared style sheet, is always defined.
    """
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    style = Markup(STYLE.read_text(encoding="utf-8"))  # our own file, not a person's text
    text = template.read_text(encoding="utf-8")
    return environment.from_string(text).render(style=style, **values)
