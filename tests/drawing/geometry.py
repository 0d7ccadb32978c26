"""Checks of a finished layout that hold for every diagram and chart."""

from __future__ import annotations

import itertools
from xml.etree import ElementTree

import pytest

from macromicro.drawing._labels import stroke
from macromicro.drawing._plan import Layout, Words

SVG = "{http://www.w3.org/2000/svg}"


def text_of(svg: str) -> list[str]:
    """The texts of a drawing, its title not among them."""
    root = ElementTree.fromstring(svg)
    return ["".join(e.itertext()) for e in root.iter(f"{SVG}text")]


def ids_of(svg: str) -> list[str]:
    return [e.attrib["id"] for e in ElementTree.fromstring(svg).iter() if "id" in e.attrib]


def check(layout: Layout) -> None:
    """No two boxes, labels or signs overlap; no wire runs through a box or a label, or ends
    beside its box; all lies within the view."""
    boxes = list(layout.boxes.values())
    rects = boxes + [w.rect for w in layout.words]
    for a, b in itertools.combinations(rects, 2):
        assert not a.overlaps(b), (a, b)
    for path in layout.paths:
        for a, b in itertools.pairwise(path.points):
            assert a[0] == pytest.approx(b[0]) or a[1] == pytest.approx(b[1])
            segment = stroke(a, b, 0.0)
            for name, box in layout.boxes.items():
                assert not segment.overlaps(box.grown(-0.01)), (path, name)
            for word in layout.words:
                assert not segment.overlaps(word.rect.grown(-0.01)), (path, word)
        for name, end in ((path.source, path.points[0]), (path.target, path.points[-1])):
            box = layout.boxes[name]
            assert box.grown(0.01).holds(end) and not box.grown(-0.01).holds(end)
        # Room for the arrowhead.
        assert abs(sum(path.points[-1]) - sum(path.points[-2])) >= 10.0
    for rect in rects + [r for _, r in layout.frames]:
        assert layout.view.holds((rect.left, rect.top))
        assert layout.view.holds((rect.right, rect.bottom))


def check_frames(layout: Layout, members: dict[str, tuple[str, ...]]) -> None:
    """A frame holds its own boxes, is clear of all others, and no label is on its border."""
    for label, rect in layout.frames:
        for name, box in layout.boxes.items():
            assert rect.overlaps(box) == (name in members[label])
        for word in layout.words:
            inside = rect.holds(word.rect[:2]) and rect.holds(word.rect[2:])
            assert inside or not rect.overlaps(word.rect)


def nearest(layout: Layout, word: Words) -> str:
    """Name of the box that stands nearest to a label."""
    x, y = word.rect.centre

    def away(name: str) -> float:
        box = layout.boxes[name]
        dx = max(box.left - x, x - box.right, 0.0)
        return dx + max(box.top - y, y - box.bottom, 0.0)

    return min(layout.boxes, key=away)
