"""Pages: templates filled in with everything escaped, pictures inlined."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any, NamedTuple

STYLE = Path(__file__).parent / "page.css"


class Picture(NamedTuple):
    """A drawn figure.

    Attributes
    ----------
    name : str
        Name of its file, without suffix.
    title : str
        Heading.
    caption : str
        What to look at.
    png : bytes
        A PNG file's bytes.
    """

    name: str
    title: str
    caption: str
    png: bytes

    @property
    def uri(self) -> str:
        """The picture inlined."""
        return f"data:image/png;base64,{base64.b64encode(self.png).decode()}"


def filled(template: Path, **values: Any) -> str:
    """A template with its values. All text is escaped; a name it lacks is an error.

    `style` is there for every template: the style sheet that pages share.

    Parameters
    ----------
    template : Path
        File, in Jinja's language.
    **values : Any
        By name.

    Returns
    -------
    str
        The text.
    """
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    style = Markup(STYLE.read_text(encoding="utf-8"))  # our own file, not a person's text
    text = template.read_text(encoding="utf-8")
    return environment.from_string(text).render(style=style, **values)
