"""Text of diagrams: sub- and superscripts as SVG, and an upper bound of its width.

Markup: "T_d", "K_{aw}", "z^2", "z^{-1}"; "V'" has a prime, "5~V" a no-break space, "z - 1" and
"-1" a minus. A line "b//z + a" is a fraction.
"""

from __future__ import annotations

import re
from typing import NamedTuple
from xml.sax.saxutils import escape

FONT = 14.0
SMALL = 10.5
LINE = 18.0  # from one base line to the next
FRACTION = "//"
MINUS, PRIME, SPACE = "\N{MINUS SIGN}", "\N{PRIME}", "\N{NO-BREAK SPACE}"
_NEGATIVE = re.compile(r"(?<![^\s({])-(?=[\s\d])")
_SCRIPT = re.compile(r"([_^])(?:\{([^}]*)\}|(\w))")
# Widths in parts of the font size, of DejaVu Sans: of the usual faces the widest.
_NARROW, _WIDE = 0.42, 0.90
_DEFAULT, _CAPITAL, _DIGIT = 0.64, 0.73, 0.64


class Run(NamedTuple):
    text: str  # without markup
    size: float  # font size, units
    shift: float  # how far below the base line, units


def runs(text: str) -> list[Run]:
    parts: list[Run] = []
    text = _NEGATIVE.sub(MINUS, text.replace("~", SPACE)).replace("'", PRIME)
    at = 0
    for found in _SCRIPT.finditer(text):
        if found.start() > at:
            parts.append(Run(text[at : found.start()], FONT, 0.0))
        shift = 4.0 if found[1] == "_" else -5.0
        parts.append(Run(found[2] if found[2] is not None else found[3], SMALL, shift))
        at = found.end()
    if at < len(text):
        parts.append(Run(text[at:], FONT, 0.0))
    return parts


def plain(text: str) -> str:
    """A text without markup, for screen readers."""
    return "".join(run.text for run in runs(text)).replace(FRACTION, " ")


def width(text: str) -> float:
    """Upper bound of the width of a text; of a fraction, of its wider half."""
    if FRACTION in text:
        return max(width(part) for part in text.split(FRACTION)) + 6.0
    return sum(run.size * _advance(c) for run in runs(text) for c in run.text)


def _advance(c: str) -> float:
    if c in "iljtfrI.,:;|()[]/ " or c in (PRIME, SPACE):
        return _NARROW
    if c in "mwMWQ%@ΦΘΣ" or c in "+±=<>≤≥→" or c == MINUS:
        return _WIDE
    if c.isdigit():
        return _DIGIT
    return _CAPITAL if c.isupper() else _DEFAULT


def height(text: str) -> float:
    return 2.0 * LINE + 4.0 if FRACTION in text else LINE


def text_element(x: float, y: float, text: str, anchor: str = "middle") -> str:
    spans, offset = [], 0.0
    for run in runs(text):
        move = run.shift - offset
        offset = run.shift
        attributes = f' dy="{move:g}"' if move else ""
        attributes += f' font-size="{run.size:g}"' if run.size != FONT else ""
        body = escape(run.text)
        spans.append(f"<tspan{attributes}>{body}</tspan>" if attributes else body)
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{"".join(spans)}</text>'


def line_elements(x: float, top: float, text: str) -> list[str]:
    """SVG of one line, a fraction or not."""
    if FRACTION not in text:
        return [text_element(x, top + 0.74 * LINE, text)]
    over, under = text.split(FRACTION)
    half = 0.5 * width(text)
    bar = top + LINE + 1.0
    return [
        text_element(x, top + 0.74 * LINE - 1.0, over),
        f'<path d="M{x - half:.1f} {bar:.1f}H{x + half:.1f}"/>',
        text_element(x, bar + 0.78 * LINE + 1.0, under),
    ]
