"""Signs at sums stand clear of wires and arrowheads, as they are drawn."""

from __future__ import annotations

import itertools
import re
from xml.etree import ElementTree

import pytest

from macromicro.drawing import diagram
from macromicro.drawing._labels import Rect, sign_rect
from macromicro.drawing._symbols import MINUS
from macromicro.drawing.diagram import Diagram, block

SVG = "{http://www.w3.org/2000/svg}"
NUMBER = re.compile(r"-?[0-9.]+")
# A sum that is entered from all four sides, and one from the right.
CROSS = Diagram(
    "Signs",
    """
    .  ↓a  .   .
    b  (e) G   y
    .  ↑c  .   .
    .  A <(d)  .
    """,
    {"G": block("G"), "A": block("A")},
    "b > e > G > y; a >- e; c >+ e; y >+ d > A; G >- d",
)


def inked(svg: str) -> list[Rect]:
    """Straight pieces of wires and arrowheads, as rectangles."""
    found = []
    for path in ElementTree.fromstring(svg).iter(f"{SVG}path"):
        values = [float(v) for v in NUMBER.findall(path.attrib["d"])]
        points = list(zip(values[::2], values[1::2], strict=True))
        if path.attrib["d"].endswith("Z"):
            xs, ys = zip(*points, strict=True)
            found.append(Rect(min(xs), min(ys), max(xs), max(ys)))
        else:
            for (a, b), (c, d) in itertools.pairwise(points):
                found.append(Rect(min(a, c), min(b, d), max(a, c), max(b, d)).grown(0.7))
    return found


def test_a_sign_touches_no_wire_and_no_arrowhead() -> None:
    """A plus fills 9 by 9 units above its base line's lowest unit."""
    svg = diagram.svg(CROSS)
    signs = [
        Rect.about(float(e.attrib["x"]), float(e.attrib["y"]) - 5.0, 9.0, 9.0)
        for e in ElementTree.fromstring(svg).iter(f"{SVG}text")
        if "".join(e.itertext()) in ("+", MINUS)
    ]
    ink = inked(svg)
    assert len(signs) == 5 and len(ink) > 10
    for sign in signs:
        assert not any(sign.overlaps(each) for each in ink), sign


@pytest.mark.parametrize("before", [(-20.0, 0.0), (20.0, 0.0), (0.0, -20.0), (0.0, 20.0)])
def test_a_sign_stands_by_the_end_of_its_wire(before: tuple[float, float]) -> None:
    rect = sign_rect(before, (0.0, 0.0))
    assert not rect.holds((0.0, 0.0)) and not rect.holds(before)
    assert max(map(abs, rect.centre)) <= 12.0
