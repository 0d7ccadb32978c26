"""Pages from templates, with everything escaped and pictures inlined."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import macromicro
from macromicro.drawing.files import DEFAULT, save

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLE = Path(__file__).parent / "page.css"
CHANGES = Path(__file__).parent / "changes.html.j2"


class PageFigure(NamedTuple):
    name: str  # of its file, without suffix
    title: str  # heading
    caption: str  # what to look at
    figure: Figure  # of matplotlib, belongs to no window


class Picture(NamedTuple):
    """A `PageFigure` as the bytes of its PNG file."""

    name: str
    title: str
    caption: str
    png: bytes

    @property
    def uri(self) -> str:
        return uri(self.png)


def uri(png: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"


def save_figures(
    figures: Iterable[PageFigure], folder: Path, kinds: Sequence[str] = DEFAULT
) -> list[Picture]:
    """Write figures in all `kinds` to a folder; the pictures for its page. Of no kind: none."""
    if not kinds:
        return []
    return [
        Picture(f.name, f.title, f.caption, save(f.figure, folder, f.name, kinds)) for f in figures
    ]


def fill(template: Path, **values: Any) -> str:
    """A template with its values, all escaped; a missing name is an error.

    `style`, the shared style sheet, `version`, that of the package, and `changes`, which lists
    settings, are always defined.
    """
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    style = Markup(STYLE.read_text(encoding="utf-8"))  # our own file, not a person's text
    shared: Any = environment.from_string(CHANGES.read_text(encoding="utf-8")).module
    page = environment.from_string(template.read_text(encoding="utf-8"))
    known = {"style": style, "version": macromicro.__version__, "changes": shared.changes}
    return page.render(**known, **values)
