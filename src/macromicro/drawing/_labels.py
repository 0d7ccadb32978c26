"""Rectangles of a drawing, and free places for labels beside wires."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

Point = tuple[float, float]

HEIGHT = 15.0  # room for a line, subscripts included
_STEP = 6.0


class Rect(NamedTuple):
    left: float  # smallest x
    top: float  # smallest y; y grows downwards
    right: float  # largest x
    bottom: float  # largest y

    @classmethod
    def about(cls, x: float, y: float, w: float, h: float) -> Rect:
        return cls(x - 0.5 * w, y - 0.5 * h, x + 0.5 * w, y + 0.5 * h)

    @classmethod
    def around(cls, rects: Sequence[Rect]) -> Rect:
        return cls(
            min(r.left for r in rects),
            min(r.top for r in rects),
            max(r.right for r in rects),
            max(r.bottom for r in rects),
        )

    @property
    def centre(self) -> Point:
        return 0.5 * (self.left + self.right), 0.5 * (self.top + self.bottom)

    @property
    def w(self) -> float:
        return self.right - self.left

    @property
    def h(self) -> float:
        return self.bottom - self.top

    def grown(self, by: float) -> Rect:
        return Rect(self.left - by, self.top - by, self.right + by, self.bottom + by)

    def overlaps(self, other: Rect) -> bool:
        return (
            self.left < other.right
            and other.left < self.right
            and self.top < other.bottom
            and other.top < self.bottom
        )

    def holds(self, p: Point) -> bool:
        return self.left <= p[0] <= self.right and self.top <= p[1] <= self.bottom

    def border(self, towards: Point) -> Point:
        """Where an axis-parallel stroke from its centre leaves it."""
        x, y = self.centre
        if abs(towards[1] - y) < 1e-6:
            return (self.right if towards[0] > x else self.left), y
        return x, (self.bottom if towards[1] > y else self.top)


def stroke(a: Point, b: Point, half: float) -> Rect:
    """An axis-parallel stroke as a rectangle."""
    return Rect(min(a[0], b[0]), min(a[1], b[1]), max(a[0], b[0]), max(a[1], b[1])).grown(half)


def sign_rect(before: Point, end: Point) -> Rect:
    """Room for the sign of a wire at a sum, beside the wire and its arrowhead."""
    x, y = end
    if abs(before[1] - y) < 1e-6:
        way = -1.0 if before[0] < x else 1.0
        return Rect.about(x + 7.0 * way, y + 12.0 * way, 10.0, HEIGHT)
    return Rect.about(x + 10.0, y - 8.0 if before[1] < y else y + 12.0, 10.0, HEIGHT)


def placed(points: Sequence[Point], w: float, taken: Sequence[Rect], first: bool = False) -> Rect:
    """Room for a label by a wire, with the fewest overlaps."""
    best, least = Rect(0.0, 0.0, 0.0, 0.0), len(taken) + 1
    for rect in _candidates(points, w, first):
        hits = sum(rect.overlaps(other) for other in taken)
        if hits < least:
            best, least = rect, hits
        if hits == 0:
            break
    return best


def _candidates(points: Sequence[Point], w: float, first: bool) -> Iterator[Rect]:
    """Places above and below horizontal stretches, and beside vertical ones.

    Horizontal ones first, the longest first, from their middles out;
    or in the order of the wire.
    """
    strokes = list(itertools.pairwise(points))
    if not first:
        strokes.sort(key=lambda s: (not _level(s), -math.dist(*s)))
    for a, b in strokes:
        size = w if _level((a, b)) else HEIGHT
        for side in (-1.0, 1.0):
            for share in _places(math.dist(a, b), size, first):
                x, y = a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
                if _level((a, b)):
                    y += side * (0.5 * HEIGHT + 3.0)
                else:
                    x -= side * (0.5 * w + 4.0)
                yield Rect.about(x, y, w, HEIGHT)


def _level(s: tuple[Point, Point]) -> bool:
    return abs(s[0][1] - s[1][1]) < 1e-6


def _places(length: float, size: float, first: bool) -> Iterator[float]:
    """Middles along a stretch, as shares of it, for something of `size`."""
    reach = 0.5 * (length - size)
    if first:
        away = 4.0 - reach
        while away <= reach:
            yield 0.5 + away / length
            away += _STEP
        return
    yield 0.5
    away = _STEP
    while away <= reach:
        yield 0.5 - away / length
        yield 0.5 + away / length
        away += _STEP
