"""Orthogonal wires between the cells of a grid, around all other cells.

The plane is a lattice of the centre lines of the columns and rows of cells, and `LANES` lines in
every gap between and outside them. A cell stands on the crossing of two centre lines; a wire
leaves and enters it along these.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Hashable, Iterable, Sequence
from typing import NamedTuple

LANES = 3
Vertex = tuple[int, int]
Cell = tuple[int, int]
SIDES: dict[str, Vertex] = {"E": (1, 0), "W": (-1, 0), "S": (0, 1), "N": (0, -1)}
_BEND, _CROSSING, _CENTRE = 5.0, 14.0, 2.5
_SHARED = 0.2  # price of a stretch that another wire of the same net has already


class Link(NamedTuple):
    source: Cell  # column and row
    target: Cell  # column and row
    out: str  # sides by which it may leave, such as "ES"
    into: str  # sides by which it may enter
    net: Hashable  # wires of one net may share stretches


class _Trail(NamedTuple):
    at: Vertex
    before: _Trail | None


class _Laid:
    """Laid nets by edge, and by vertex whether straight on (0 along x, 1 along y)."""

    def __init__(self, occupied: Iterable[Cell], size: tuple[int, int]) -> None:
        self.blocked = {vertex(c) for c in occupied}
        self.limits = (line(size[0]), line(size[1]))
        self.edges: dict[frozenset[Vertex], Hashable] = {}
        self.passes: dict[Vertex, dict[Hashable, set[int]]] = {}

    def step(self, a: Vertex, way: Vertex, net: Hashable) -> tuple[Vertex, float] | None:
        """The next vertex and its price; None where a wire cannot go."""
        b = (a[0] + way[0], a[1] + way[1])
        if not (0 <= b[0] < self.limits[0] and 0 <= b[1] < self.limits[1]):
            return None
        owner = self.edges.get(frozenset((a, b)))
        if owner is not None:
            return (b, _SHARED) if owner == net else None
        along = 0 if way[0] else 1
        return b, _CENTRE if LANES in (a[along] % (LANES + 1), b[along] % (LANES + 1)) else 1.0

    def turn(self, at: Vertex, old: Vertex, new: Vertex, net: Hashable) -> float | None:
        """Price of continuing by `new` after `old`; None where another net's wire is in the way."""
        foreign = [w for n, w in self.passes.get(at, {}).items() if n != net]
        if old != new:
            return None if foreign else _BEND
        across = {1 if old[0] else 0}
        return None if any(ways != across for ways in foreign) else _CROSSING * len(foreign)

    def lay(self, path: Sequence[Vertex], net: Hashable) -> None:
        for a, b in itertools.pairwise(path):
            self.edges[frozenset((a, b))] = net
            along = 0 if a[0] != b[0] else 1
            for v in (a, b):
                self.passes.setdefault(v, {}).setdefault(net, set()).add(along)


def line(k: int) -> int:
    """Number of the centre line of a column or row."""
    return k * (LANES + 1) + LANES


def vertex(cell: Cell) -> Vertex:
    return line(cell[0]), line(cell[1])


def routes(
    size: tuple[int, int], occupied: Iterable[Cell], links: Sequence[Link]
) -> list[list[Vertex]]:
    """Each link's corners on the lattice, its two cells included; short links first."""
    laid = _Laid(occupied, size)
    found: dict[int, list[Vertex]] = {}
    for k in sorted(range(len(links)), key=lambda k: _rank(links[k])):
        path = _search(laid, links[k])
        if path is None:
            raise ValueError(f"no way is left from {links[k].source} to {links[k].target}")
        laid.lay(path, links[k].net)
        found[k] = path
    return [corners(found[k]) for k in range(len(links))]


def _rank(link: Link) -> int:
    return sum(abs(a - b) for a, b in zip(link.source, link.target, strict=True))


def _search(laid: _Laid, link: Link) -> list[Vertex] | None:
    """The cheapest path (Dijkstra over place and direction)."""
    start, goal = vertex(link.source), vertex(link.target)
    arrivals = {(-SIDES[s][0], -SIDES[s][1]) for s in link.into}
    queue: list[tuple[float, int, Vertex, Vertex, _Trail]] = []
    for way in (SIDES[s] for s in link.out):
        queue.append((0.0, len(queue), start, way, _Trail(start, None)))
    done: set[tuple[Vertex, Vertex]] = set()
    count = len(queue)
    while queue:
        cost, _, at, way, trail = heapq.heappop(queue)
        if (at, way) in done:
            continue
        done.add((at, way))
        moved = laid.step(at, way, link.net)
        if moved is None:
            continue
        then, far = moved
        if then == goal and way in arrivals:
            return _unwound(_Trail(goal, trail))
        if then in laid.blocked:
            continue
        for onward in SIDES.values():
            extra = laid.turn(then, way, onward, link.net)
            if extra is not None and onward != (-way[0], -way[1]):
                count += 1
                state = (cost + far + extra, count, then, onward, _Trail(then, trail))
                heapq.heappush(queue, state)
    return None


def _unwound(trail: _Trail | None) -> list[Vertex]:
    path = []
    while trail is not None:
        path.append(trail.at)
        trail = trail.before
    return path[::-1]


def corners(path: Sequence[Vertex]) -> list[Vertex]:
    """A path without the vertices at which it continues straight on."""
    kept = [path[0]]
    for a, b, c in zip(path, path[1:], path[2:], strict=False):
        if (b[0] - a[0], b[1] - a[1]) != (c[0] - b[0], c[1] - b[1]):
            kept.append(b)
    return [*kept, path[-1]]
