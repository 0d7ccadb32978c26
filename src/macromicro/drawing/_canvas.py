"""A layout as SVG: one style for block diagrams and flow charts.

The only id is the title's. Strokes and text are in `currentColor`, blocks filled with the
page's variable `--paper`.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple
from xml.sax.saxutils import escape

from macromicro.drawing._icons import HEIGHT, WIDTH, icon_elements
from macromicro.drawing._labels import Rect, stroke
from macromicro.drawing._plan import Layout, Path, Point
from macromicro.drawing._symbols import FONT, height, line_elements, plain, text_element, width

BLOCK, SUM, SIGNAL, ROUND, HEXAGON = "block", "sum", "signal", "round", "hexagon"
RADIUS = 10.0  # of a sum
_HEAD = 8.0
_PAD_X, _PAD_Y = 9.0, 8.0
_POINT = 16.0  # of a hexagon, to either side


class Shape(NamedTuple):
    outline: str  # BLOCK, SUM, SIGNAL, ROUND or HEXAGON
    lines: tuple[str, ...] = ()  # lines of text
    icon: str = ""  # A key of ``icons.ICONS``, or ""


def size(shape: Shape) -> tuple[float, float]:
    wide = max((width(line) for line in shape.lines), default=0.0)
    high = sum(height(line) for line in shape.lines)
    if shape.outline == SUM:
        return 2.0 * RADIUS, 2.0 * RADIUS
    if shape.outline == SIGNAL:
        return wide + 6.0, high
    if shape.icon:
        wide, high = max(wide, WIDTH), high + HEIGHT + (3.0 if shape.lines else 0.0)
    side = _POINT if shape.outline == HEXAGON else 0.0
    return max(wide + 2.0 * (_PAD_X + side), 34.0), max(high + 2.0 * _PAD_Y, 34.0)


def drawing(title: str, layout: Layout, shapes: Mapping[str, Shape]) -> str:
    parts = []
    for label, rect in layout.frames:
        parts += _frame(label, rect)
    for k, path in enumerate(layout.paths):
        same = [p for p in layout.paths[:k] if (p.source, p.dashed) == (path.source, path.dashed)]
        strokes = [s for p in same for s in itertools.pairwise(p.points)]
        parts += _wire(path._replace(points=_unshared(path.points, strokes)))
    for x, y in layout.dots:
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.8" fill="currentColor"/>')
    for name, rect in layout.boxes.items():
        parts += _box(rect, shapes[name])
    for text, rect in layout.words:
        parts.append(text_element(rect.centre[0], rect.bottom - 4.0, text))
    view = layout.view
    key = re.sub(r"[^a-z0-9]+", "-", plain(title).lower()).strip("-") + "-title"
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" role="img" '
        f'aria-labelledby="{key}" '
        f'viewBox="{view.left:.1f} {view.top:.1f} {view.w:.1f} {view.h:.1f}" '
        f'style="display:block;width:100%;max-width:{math.ceil(view.w)}px;height:auto;'
        'margin:0 auto">'
        f'<title id="{key}">{escape(plain(title))}</title>'
        '<g fill="none" stroke="currentColor" stroke-width="1.3" stroke-linejoin="round">'
        + "".join(_inked(part) for part in parts)
        + "</g></svg>\n"
    )


def _inked(part: str) -> str:
    style = f'<text font-family="system-ui, sans-serif" font-size="{FONT:g}" '
    return part.replace("<text ", style + 'fill="currentColor" stroke="none" ')


def _frame(label: str, r: Rect) -> list[str]:
    return [
        f'<rect x="{r.left:.1f}" y="{r.top:.1f}" width="{r.w:.1f}" height="{r.h:.1f}" rx="6" '
        'stroke-dasharray="5 4" opacity="0.7"/>',
        text_element(r.left + 8.0, r.top + 15.0, label, "start"),
    ]


def _unshared(
    points: tuple[Point, ...], strokes: Sequence[tuple[Point, Point]]
) -> tuple[Point, ...]:
    """The part of `points` after other strokes, which would look bolder if drawn twice."""
    rest = list(points)
    while len(rest) > 1:
        reached = rest[0]
        for a, b in strokes:
            if stroke(a, b, 0.01).holds(rest[0]):
                ends = (p for p in (a, b) if stroke(rest[0], rest[1], 0.01).holds(p))
                reached = max((reached, *ends), key=lambda p: math.dist(rest[0], p))
                if stroke(a, b, 0.01).holds(rest[1]):
                    reached = rest[1]
        if reached == rest[0]:
            break
        rest[0] = reached
        if math.dist(rest[0], rest[1]) < 0.01:
            del rest[0]
    return tuple(rest)


def _wire(path: Path) -> list[str]:
    """The polyline, ending inside its arrowhead, and the arrowhead."""
    *points, end = path.points
    before = points[-1]
    far = math.dist(before, end)
    ux, uy = (end[0] - before[0]) / far, (end[1] - before[1]) / far
    tail = (end[0] - _HEAD * ux, end[1] - _HEAD * uy)
    wings = [(tail[0] - s * 4.0 * uy, tail[1] + s * 4.0 * ux) for s in (1.0, -1.0)]
    dash = ' stroke-dasharray="4 3"' if path.dashed else ""
    return [
        f'<path d="{_polyline([*points, tail])}"{dash}/>',
        f'<path d="{_polyline([end, *wings])}Z" fill="currentColor" stroke="none"/>',
    ]


def _polyline(points: Sequence[Point]) -> str:
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points)


def _outline(r: Rect, outline: str) -> str:
    fill = 'style="fill:var(--paper, none)"'
    x, y = r.centre
    if outline == SUM:
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{RADIUS:g}" {fill}/>'
    if outline == HEXAGON:
        side = [(r.left, y), (r.left + _POINT, r.top), (r.right - _POINT, r.top), (r.right, y)]
        side += [(r.right - _POINT, r.bottom), (r.left + _POINT, r.bottom)]
        return f'<path d="{_polyline(side)}Z" {fill}/>'
    radius = 0.5 * min(r.h, 40.0) if outline == ROUND else 3.0
    return (
        f'<rect x="{r.left:.1f}" y="{r.top:.1f}" width="{r.w:.1f}" height="{r.h:.1f}" '
        f'rx="{radius:g}" {fill}/>'
    )


def _box(r: Rect, shape: Shape) -> list[str]:
    parts = [] if shape.outline == SIGNAL else [_outline(r, shape.outline)]
    x, y = r.centre
    high = sum(height(line) for line in shape.lines)
    if shape.icon:
        high += HEIGHT + (3.0 if shape.lines else 0.0)
    top = y - 0.5 * high
    if shape.icon:
        parts += icon_elements(shape.icon, x, top + 0.5 * HEIGHT)
        top += HEIGHT + 3.0
    for line in shape.lines:
        parts += line_elements(x, top, line)
        top += height(line)
    return parts
