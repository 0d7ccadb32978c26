"""Figures as files; the same figure always gives the same bytes."""

from __future__ import annotations

import io
import sys
from collections.abc import Iterable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from macromicro.errors import InputError
from macromicro.extras import remedy
from macromicro.schema.text import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PNG, SVG, PDF = "png", "svg", "pdf"
FORMATS = (PNG, SVG, PDF)
DEFAULT = (PNG,)
NONE = "none"
EXTRA = "figures"  # brings matplotlib
_SELF = "macromicro"
_NOTES: dict[str, dict[str, str | None]] = {
    PNG: {"Software": _SELF},
    SVG: {"Creator": _SELF, "Date": None},
    PDF: {"Creator": _SELF, "Producer": _SELF, "CreationDate": None},
}


def encode(figure: Figure, kind: str = PNG) -> bytes:
    import matplotlib

    buffer = io.BytesIO()
    # Ids within an SVG are hashes of the salt and the content; a PDF's text stays text.
    with matplotlib.rc_context({"svg.hashsalt": _SELF, "pdf.fonttype": 42}):
        figure.savefig(buffer, format=kind, metadata=_NOTES[kind])
    return buffer.getvalue()


def save(figure: Figure, folder: Path, name: str, kinds: Iterable[str] = DEFAULT) -> bytes:
    shown = encode(figure)
    for kind in kinds:
        data = shown if kind == PNG else encode(figure, kind)
        (folder / f"{name}.{kind}").write_bytes(data)
    return shown


def names(figures: Iterable[str]) -> tuple[str, ...]:
    return tuple(f"{name}.{kind}" for name in figures for kind in FORMATS)


def formats(text: str | Sequence[str], where: str = "--figures") -> tuple[str, ...]:
    """The formats that are asked for; none, with a note, where matplotlib is not installed."""
    words = text.split(",") if isinstance(text, str) else text
    found = tuple(dict.fromkeys(word.strip().lower().removeprefix(".") for word in words))
    if found == (NONE,):
        return ()
    for word in found:
        if word not in FORMATS:
            accepted = f"{', '.join(FORMATS)}, several with commas such as svg,pdf, or {NONE}"
            raise InputError(where, printable(word or text), accepted)
    if found and find_spec("matplotlib") is None:
        print(f"macromicro: no figures without matplotlib: {remedy(EXTRA)}", file=sys.stderr)
        return ()
    return found
