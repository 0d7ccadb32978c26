"""From cells and links to places on the page: boxes, wires, labels, frames."""

from __future__ import annotations

import itertools
from collections.abc import Hashable, Sequence
from typing import NamedTuple

from macromicro.drawing import _routing
from macromicro.drawing._labels import Rect, placed, sign_rect, stroke
from macromicro.drawing._routing import LANES, Cell, Link
from macromicro.drawing._symbols import LINE, width

Point = tuple[float, float]

PITCH = 11.0  # between parallel wires
ASIDE = 16.0  # from a wire to the column or row beside it
FRAME = 9.0  # from a frame to what it holds
HEAD = 20.0  # of a frame, for its label
EDGE = 5.0


class Thing(NamedTuple):
    name: str  # name of the box
    cell: Cell  # column and row
    w: float  # width, units
    h: float  # height, units


class Line(NamedTuple):
    link: Link  # between which cells
    label: str = ""  # "" for none
    sign: str = ""  # at its end, "" for none
    dashed: bool = False  # whether it is an event, no quantity


class Frame(NamedTuple):
    label: str  # written at its top
    names: tuple[str, ...]  # names of what it holds


class Path(NamedTuple):
    source: str  # name of the box where it begins
    target: str  # name of the box where it ends
    points: tuple[Point, ...]  # corners, from border to border, units
    dashed: bool  # whether it is an event, no quantity


class Words(NamedTuple):
    text: str  # with markup
    rect: Rect  # the room it takes


class Layout(NamedTuple):
    view: Rect  # the room of all of it
    boxes: dict[str, Rect]  # by name
    paths: list[Path]  # wires
    words: list[Words]  # labels and signs
    frames: list[tuple[str, Rect]]  # with labels
    dots: list[Point]  # where wires of one net part


class _Axis(NamedTuple):
    """Places along x or y: `centres` and `sizes` of columns or rows, and of the used lanes."""

    centres: list[float]
    sizes: list[float]
    lanes: dict[int, float]

    def at(self, lattice: int) -> float:
        cell, lane = divmod(lattice, LANES + 1)
        return self.centres[cell] if lane == LANES else self.lanes[lattice]


def laid_out(
    things: Sequence[Thing],
    lines: Sequence[Line],
    frames: Sequence[Frame] = (),
    gap: float = 26.0,
    *,
    chart: bool = False,
) -> Layout:
    size = (1 + max(t.cell[0] for t in things), 1 + max(t.cell[1] for t in things))
    corners = _routing.routes(size, [t.cell for t in things], [line.link for line in lines])
    at = {t.cell: t for t in things}
    spans = [_span(frame, things) for frame in frames]
    axes = []
    for axis in (0, 1):
        used = {p[axis] for path in corners for p in path if p[axis] % (LANES + 1) != LANES}
        sizes = [0.0] * size[axis]
        for t in things:
            k = t.cell[axis]
            sizes[k] = max(sizes[k], (t.w, t.h)[axis])
        least = [0.0, *([gap] * (size[axis] - 1)), 0.0]
        if axis == 0:
            _widen(least, lines, at, sizes, used)
        aside = gap if chart and axis == 0 else ASIDE
        rims = [(s[axis], _extra(axis)) for s in spans]
        axes.append(_axis(sizes, used, least, rims, aside))
    boxes = {
        t.name: Rect.about(axes[0].centres[t.cell[0]], axes[1].centres[t.cell[1]], t.w, t.h)
        for t in things
    }
    paths = [_path(line, path, at, boxes, axes) for line, path in zip(lines, corners, strict=True)]
    held = [(f.label, _surround(s, axes)) for f, s in zip(frames, spans, strict=True)]
    marks = [] if chart else _dots(lines, paths)
    solid = [*boxes.values(), *(Rect.about(x, y, 8.0, 8.0) for x, y in marks)]
    words = _words(lines, paths, solid, held, chart)
    rects = [*boxes.values(), *(r for _, r in held), *(w.rect for w in words)]
    rects += [stroke(a, b, 1.0) for p in paths for a, b in itertools.pairwise(p.points)]
    return Layout(Rect.around(rects).grown(EDGE), boxes, paths, words, held, marks)


def _extra(axis: int) -> tuple[float, float]:
    return (FRAME, FRAME) if axis == 0 else (FRAME + HEAD, FRAME)


def _span(frame: Frame, things: Sequence[Thing]) -> tuple[tuple[int, int], tuple[int, int]]:
    cells = [t.cell for t in things if t.name in frame.names]
    (x0, x1), (y0, y1) = ((min(v), max(v)) for v in zip(*cells, strict=True))
    return (x0, x1), (y0, y1)


def _widen(
    least: list[float],
    lines: Sequence[Line],
    at: dict[Cell, Thing],
    sizes: list[float],
    used: set[int],
) -> None:
    """Widen gaps between neighbouring columns for the labels of their wires."""
    for line in lines:
        (a, row), (b, other) = line.link.source, line.link.target
        if not line.label or row != other or abs(a - b) != 1:
            continue
        k = max(a, b)
        lanes = sum(1 for i in used if i // (LANES + 1) == k)
        free = sum(0.5 * (sizes[c] - at[(c, row)].w) for c in (a, b))
        need = width(line.label) + 12.0 + PITCH * lanes + (16.0 if line.sign else 8.0)
        least[k] = max(least[k], need - free)


def _axis(
    sizes: list[float],
    used: set[int],
    least: list[float],
    spans: list[tuple[tuple[int, int], tuple[float, float]]],
    aside: float,
) -> _Axis:
    """Places of cells and lanes, one gap after the other."""
    centres: list[float] = []
    lanes: dict[int, float] = {}
    place = 0.0
    for k in range(len(sizes) + 1):
        before = max((e[1] for (_, last), e in spans if last == k - 1), default=0.0)
        after = max((e[0] for (first, _), e in spans if first == k), default=0.0)
        mine = sorted(i for i in used if i // (LANES + 1) == k)
        inner = PITCH * (len(mine) - 1)
        free = max(least[k], inner + 2.0 * aside if mine else 0.0)
        for n, i in enumerate(mine):
            lanes[i] = place + before + 0.5 * (free - inner) + PITCH * n
        place += before + free + after
        if k < len(sizes):
            centres.append(place + 0.5 * sizes[k])
            place += sizes[k]
    return _Axis(centres, sizes, lanes)


def _path(
    line: Line,
    corners: Sequence[_routing.Vertex],
    at: dict[Cell, Thing],
    boxes: dict[str, Rect],
    axes: Sequence[_Axis],
) -> Path:
    points = [(axes[0].at(x), axes[1].at(y)) for x, y in corners]
    source, target = at[line.link.source].name, at[line.link.target].name
    points[0] = boxes[source].border(points[1])
    points[-1] = boxes[target].border(points[-2])
    return Path(source, target, tuple(points), line.dashed)


def _surround(span: tuple[tuple[int, int], tuple[int, int]], axes: Sequence[_Axis]) -> Rect:
    (x0, x1), (y0, y1) = (
        (a.centres[i] - 0.5 * a.sizes[i], a.centres[j] + 0.5 * a.sizes[j])
        for a, (i, j) in zip(axes, span, strict=True)
    )
    return Rect(x0 - FRAME, y0 - FRAME - HEAD, x1 + FRAME, y1 + FRAME)


def _words(
    lines: Sequence[Line],
    paths: Sequence[Path],
    boxes: Sequence[Rect],
    frames: Sequence[tuple[str, Rect]],
    chart: bool,
) -> list[Words]:
    """Signs at their arrowheads, then labels without overlaps."""
    made = [
        Words(line.sign, sign_rect(path.points[-2], path.points[-1]))
        for line, path in zip(lines, paths, strict=True)
        if line.sign
    ]
    taken = [*boxes, *(w.rect for w in made)]
    taken += [
        Rect(r.left, r.top, r.left + 12.0 + width(label), r.top + LINE) for label, r in frames
    ]
    for path in paths:
        taken += [stroke(a, b, 1.5) for a, b in itertools.pairwise(path.points)]
    for _, r in frames:
        taken += [
            r.grown(1.0)._replace(right=r.left + 1.0),
            r.grown(1.0)._replace(left=r.right - 1),
        ]
        taken += [
            r.grown(1.0)._replace(bottom=r.top + 1.0),
            r.grown(1.0)._replace(top=r.bottom - 1),
        ]
    for line, path in zip(lines, paths, strict=True):
        if line.label:
            made.append(Words(line.label, placed(path.points, width(line.label), taken, chart)))
            taken.append(made[-1].rect)
    return made


def _dots(lines: Sequence[Line], paths: Sequence[Path]) -> list[Point]:
    """Where wires of one net part: at least three strokes meet."""
    nets: dict[Hashable, list[Path]] = {}
    for line, path in zip(lines, paths, strict=True):
        nets.setdefault(line.link.net, []).append(path)
    dots = []
    for net in nets.values():
        strokes = [s for p in net for s in itertools.pairwise(p.points)]
        for point in dict.fromkeys(q for p in net for q in p.points[1:-1]):
            ways = {way for a, b in strokes for way in _ways(point, a, b)}
            if len(ways) > 2:
                dots.append(point)
    return dots


def _ways(p: Point, a: Point, b: Point) -> set[tuple[int, int]]:
    """Directions in which the stroke from a to b leaves p, if it touches p."""
    if not stroke(a, b, 0.01).holds(p):
        return set()
    return {
        ((q[0] > p[0] + 0.01) - (q[0] < p[0] - 0.01), (q[1] > p[1] + 0.01) - (q[1] < p[1] - 0.01))
        for q in (a, b)
        if abs(q[0] - p[0]) + abs(q[1] - p[1]) > 0.02
    }
