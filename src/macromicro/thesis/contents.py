"""What the thesis contains: `contents.toml`, and the captions of its figures, `figures.toml`."""

from __future__ import annotations

import tomllib
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from macromicro.drawing.captions import captions, fill_words
from macromicro.drawing.exhibit import Drawn, Grid
from macromicro.thesis.claims import Claim, measured_by
from macromicro.thesis.procedure import Procedure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_CONTENTS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
CHAPTERS: dict[str, str] = _CONTENTS["chapters"]
EQUATIONS: dict[str, list[str]] = _CONTENTS["equations"]
KINDS: dict[str, str] = _CONTENTS["kinds"]
NAMES = tuple(_CONTENTS["procedures"])
_DRAWINGS = Path(__file__).with_name("figures.toml")
_FIGURES = tomllib.loads(_DRAWINGS.read_text(encoding="utf-8"))
CAPTIONS = captions(_DRAWINGS)


def caption(number: str, body: Figure | Grid, /, **values: object) -> Drawn:
    """The figure or table of a number, with its caption; KeyError for an unknown one.

    `values` fill the placeholders of the caption.
    """
    title, caption, claims = CAPTIONS[number]
    return Drawn(title, fill_words(caption, **values), body, claims)


def _no_claims(data: Any) -> list[Claim]:
    return []


def find(name: str) -> Procedure:
    """A procedure of the list, with the functions of its module and the claims that name it."""
    row = _CONTENTS["procedures"][name]
    module = import_module(f"{__package__}.{row['module']}")
    drawn = {n: each["draw"] for n, each in _FIGURES.items() if each["procedure"] == name}
    return Procedure(
        name=name,
        title=row["title"],
        sections=tuple(row["sections"]),
        channels=tuple(row.get("channels", ())),
        ids=measured_by(name),
        figures={number: getattr(module, function) for number, function in drawn.items()},
        diagrams=tuple(row.get("diagrams", ())),
        seconds=row["seconds"],
        collect=module.collect,
        claims=getattr(module, "claims", _no_claims),
        arithmetic=getattr(module, "arithmetic", None),
    )
