"""What the thesis contains: `contents.toml`, and the captions of its figures, `figures.toml`."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from macromicro.drawing.captions import captions, worded
from macromicro.drawing.exhibit import Drawn, Grid
from macromicro.thesis.claims import Claim, measured_by
from macromicro.thesis.procedure import Lab, Procedure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_CONTENTS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
CHAPTERS: dict[str, str] = _CONTENTS["chapters"]
EQUATIONS: dict[str, list[str]] = _CONTENTS["equations"]
KINDS: dict[str, str] = _CONTENTS["kinds"]
CAPTIONS = captions(Path(__file__).with_name("figures.toml"))


def captioned(number: str, body: Figure | Grid, /, **values: object) -> Drawn:
    """The figure or table of a number, with its caption; KeyError for an unknown one.

    `values` fill the placeholders of the caption.
    """
    title, caption, claims = CAPTIONS[number]
    return Drawn(title, worded(caption, **values), body, claims)


def _no_claims(data: Any) -> list[Claim]:
    return []


def procedure(
    name: str,
    figures: Mapping[str, Callable[[Any], Drawn]],
    collect: Callable[[Lab], Any],
    claims: Callable[[Any], list[Claim]] = _no_claims,
    arithmetic: Callable[[], list[Claim]] | None = None,
) -> Procedure:
    """A procedure of the list, which measures the claims that name it."""
    row = _CONTENTS["procedures"][name]
    return Procedure(
        name=name,
        title=row["title"],
        sections=tuple(row["sections"]),
        channels=tuple(row.get("channels", ())),
        ids=measured_by(name),
        figures=figures,
        diagrams=tuple(row.get("diagrams", ())),
        seconds=row["seconds"],
        collect=collect,
        claims=claims,
        arithmetic=arithmetic,
    )
