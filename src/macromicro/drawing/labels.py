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
    """A rectangle, in units.

    Attributes
    ----------
    left : float
        Smallest x.
    top : float
        Smallest y; y grows downwards.
    right : float
        Largest x.
    bottom : float
        Largest y.
    """

    left: float
    top: float
    right: float
    bottom: float

    @classmethod
    def about(cls, x: float, y: float, w: float, h: float) -> Rect:
        """The rectangle of some size about a centre.

        Parameters
        ----------
        x, y : float
            Centre.
        w, h : float
            Width and height.

        Returns
        -------
        Rect
            The rectangle.
        """
        return cls(x - 0.5 * w, y - 0.5 * h, x + 0.5 * w, y + 0.5 * h)

    @classmethod
    def around(cls, rects: Sequence[Rect]) -> Rect:
        """The least that holds several.

        Parameters
        ----------
        rects : Sequence[Rect]
            One or more.

        Returns
        -------
        Rect
            The rectangle.
        """
        return cls(
            min(r.left for r in rects),
            min(r.top for r in rects),
            max(r.right for r in rects),
            max(r.bottom for r in rects),
        )

    @property
    def centre(self) -> Point:
        """Its middle."""
        return 0.5 * (self.left + self.right), 0.5 * (self.top + self.bottom)

    @property
    def w(self) -> float:
        """Its width."""
        return self.right - self.left

    @property
    def h(self) -> float:
        """Its height."""
        return self.bottom - self.top

    def grown(self, by: float) -> Rect:
        """Larger on every side.

        Parameters
        ----------
        by : float
            By how much.

        Returns
        -------
        Rect
            The rectangle.
        """
        return Rect(self.left - by, self.top - by, self.right + by, self.bottom + by)

    def overlaps(self, other: Rect) -> bool:
        """Whether two share more than a border.

        Parameters
        ----------
        other : Rect
            The other.

        Returns
        -------
        bool
            True if so.
        """
        return (
            self.left < other.right
            and other.left < self.right
            and self.top < other.bottom
            and other.top < self.bottom
        )

    def holds(self, p: Point) -> bool:
        """Whether a point is in it or on its border.

        Parameters
        ----------
        p : Point
            The point.

        Returns
        -------
        bool
            True if so.
        """
        return self.left <= p[0] <= self.right and self.top <= p[1] <= self.bottom

    def border(self, towards: Point) -> Point:
        """Where a stroke along x or y from its middle leaves it.

        Parameters
        ----------
        towards : Point
            Where the stroke goes.

        Returns
        -------
        Point
            On the border.
        """
        x, y = self.centre
        if abs(towards[1] - y) < 1e-6:
            return (self.right if towards[0] > x else self.left), y
        return x, (self.bottom if towards[1] > y else self.top)


def stroke(a: Point, b: Point, half: float) -> Rect:
    """A stroke along x or y as a rectangle.

    Parameters
    ----------
    a, b : Point
        Its ends.
    half : float
        To either side.

    Returns
    -------
    Rect
        The rectangle.
    """
    return Rect(min(a[0], b[0]), min(a[1], b[1]), max(a[0], b[0]), max(a[1], b[1])).grown(half)


def sign_rect(before: Point, end: Point) -> Rect:
    """Room for the sign of a wire that ends at a sum: beside the wire, clear of it and of its
    arrowhead.

    Parameters
    ----------
    before : Point
        Where the wire comes from.
    end : Point
        Its end.

    Returns
    -------
    Rect
        The rectangle.
    """
    x, y = end
    if abs(before[1] - y) < 1e-6:
        way = -1.0 if before[0] < x else 1.0
        return Rect.about(x + 7.0 * way, y + 12.0 * way, 10.0, HEIGHT)
    return Rect.about(x + 10.0, y - 8.0 if before[1] < y else y + 12.0, 10.0, HEIGHT)


def placed(points: Sequence[Point], w: float, taken: Sequence[Rect], first: bool = False) -> Rect:
    """Room for a label by a wire, where it overlaps nothing that is taken; if there is none, where
    it overlaps the fewest.

    Parameters
    ----------
    points : Sequence[Point]
        Points of the wire.
    w : float
        Width of the label.
    taken : Sequence[Rect]
        Rectangles.
    first : bool, optional
        Whether it stands as near to the wire's beginning as can be.

    Returns
    -------
    Rect
        The rectangle.
    """
    best, least = Rect(0.0, 0.0, 0.0, 0.0), len(taken) + 1
    for rect in _candidates(points, w, first):
        hits = sum(rect.overlaps(other) for other in taken)
        if hits < least:
            best, least = rect, hits
        if hits == 0:
            break
    return best


def _candidates(points: Sequence[Point], w: float, first: bool) -> Iterator[Rect]:
    """Above and below level stretches, beside upright ones.

    Level ones before upright ones, the longest first, from their middles out; or all as
    the wire goes.
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
    """Middles along a stretch, in parts of it, for something of `size`."""
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
