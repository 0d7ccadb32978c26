"""Pages: templates filled in with everything escaped, pictures inlined."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any, NamedTuple


class Picture(NamedTuple):
    """A drawn figure as a PNG file's bytes, with title and caption."""

    name: str
    title: str
    caption: str
    png: bytes

    @property
    def uri(self) -> str:
        """The picture inlined."""
        return f"data:image/png;base64,{base64.b64encode(self.png).decode()}"


def filled(template: Path, **values: Any) -> str:
    """The template with its values. All text is escaped; a name it lacks is an error."""
    from jinja2 import Environment, StrictUndefined

    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.from_string(template.read_text(encoding="utf-8")).render(**values)
