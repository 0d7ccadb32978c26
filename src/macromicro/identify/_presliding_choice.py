"""Choice of elastic friction: one level, a Stribeck drop, levels along the travel."""

# Each starts from the one before and is judged on held-out pieces, as in `axis_choice`.

from __future__ import annotations

import math

import numpy as np

from macromicro.arrays import Array
from macromicro.identify._axis_pieces import settled
from macromicro.identify._choose import FOLDS, no_better, turn, typical
from macromicro.identify._presliding_search import FLOOR, Problem, Shape, searched
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.presliding import REACHES

RIGID = "rigid"
NODES = (1, 3, 5, 9, 17)  # tried along the travel
_ASKED = "elastic friction"
_BEGINS = (0.05, 0.3, 1.5, 4.0)  # circular frequencies of the stuck mass times the sample time
_SMALL = 0.01  # of the mean square of a typical piece: what less is, is no better
Candidate = tuple[Array, Shape]


def named(shape: Shape) -> str:
    """The elastic friction in words."""
    parts = [shape.friction]
    if "stribeck" in shape.names:
        parts.append("Stribeck")
    parts.append(f"{shape.nodes} nodes" if shape.nodes > 1 else "one level")
    return ", ".join(parts)


def _first(problem: Problem, friction: str) -> tuple[Array, Shape]:
    """One level, from the rigid axis; the best of searches from several stiffnesses."""
    rigid = problem.rigid
    names = ["mass", "viscous", "offset", "stiffness", "settling"]
    values = [1.0, 1.0, rigid.axis.offset / problem.coulomb, 0.0, 2.0]
    if "asymmetry" in rigid.names:
        names.append("asymmetry")
        values.append(rigid.axis.asymmetry / rigid.axis.viscous)
    if "stribeck" in rigid.names:
        names += ["stribeck", "stribeck_speed"]
        values += [rigid.axis.stribeck / problem.coulomb, 0.0]
    level = max(rigid.axis.coulomb / problem.coulomb, FLOOR)
    elements = [0.0] * (len(REACHES) - 1) if friction == "gms" else []
    shape = Shape(friction, tuple(names), 1)
    ends = []
    for stuck in _BEGINS:
        z = np.array([*values, level, *elements])
        z[names.index("stiffness")] = math.log(stuck)
        ends.append(searched(problem, z, shape, 30))
    return min(ends, key=lambda end: end.cost).x, shape


def chosen(
    problem: Problem, friction: str, along: int | None
) -> tuple[Array, Shape, dict[str, float], dict[str, str]]:
    """The simplest friction that no richer one beats on held-out pieces."""
    z, shape = _first(problem, friction)
    tried = [(z, shape)]
    if "stribeck" not in shape.names:
        at = len(shape.names)
        more = shape._replace(names=(*shape.names, "stribeck", "stribeck_speed"))
        tried.append((searched(problem, np.insert(z, at, [0.1, 0.0]), more, 20).x, more))
    squares = {RIGID: _rigid(problem)}
    # A piece in which next to nothing moves shall not outweigh the others in a mean of logarithms.
    floor = _SMALL * float(np.median(squares[RIGID]))
    for z, shape in tried:
        squares[named(shape)] = _held_out(problem, z, shape) + floor
    squares[RIGID] += floor
    best = tried[0]
    reasons: dict[str, str] = {}
    best = _better(best, tried[1:], squares, reasons)
    for nodes in NODES[1:] if along is None else (along,):
        z, shape = best
        if nodes == shape.nodes:
            continue
        finer = shape._replace(nodes=nodes)
        end = searched(problem, _refined(z, shape, nodes), finer, 20)
        squares[named(finer)] = _held_out(problem, end.x, finer) + floor
        if along is not None:
            best = (end.x, finer)
            break
        before = best
        best = _better(best, [(end.x, finer)], squares, reasons)
        if best is before and nodes > NODES[1]:
            break
    scores = {n: typical(s) for n, s in squares.items()}
    taken = named(best[1])
    gained = np.log(squares[RIGID] / squares[taken])
    why = no_better(scores[RIGID], scores[taken], gained, RIGID)
    reasons[RIGID if not why else _ASKED] = why or f"{taken} is better"
    return *best, scores, reasons


def asked_for(friction: str, reasons: dict[str, str]) -> bool:
    """Whether elastic friction beats rigid friction; warns if not."""
    if _ASKED not in reasons:
        return True
    notice(
        DataWarning,
        f"{friction} friction predicts held-out pieces no better than rigid friction, within "
        "their scatter: the record does not need it, and its elastic parameters have no "
        "standard errors",
    )
    return False


def _better(
    best: Candidate, others: list[Candidate], squares: dict[str, Array], reasons: dict[str, str]
) -> Candidate:
    """The best candidate, with reasons against the others."""
    for other in others:
        poor, rich = squares[named(best[1])], squares[named(other[1])]
        gained = np.log(poor / rich)
        why = no_better(typical(poor), typical(rich), gained, named(best[1]))
        if why:
            reasons[named(other[1])] = why
        else:
            reasons[named(best[1])] = f"{named(other[1])} is better"
            best = other
    return best


def _refined(z: Array, shape: Shape, nodes: int) -> Array:
    count = len(shape.names)
    old = z[count : count + shape.nodes]
    at = np.linspace(0.0, 1.0, nodes)
    new = np.interp(
        at, np.linspace(0.0, 1.0, max(shape.nodes, 2)), np.resize(old, max(len(old), 2))
    )
    return np.concatenate([z[:count], new, z[count + shape.nodes :]])


def _held_out(problem: Problem, z: Array, shape: Shape) -> Array:
    """Mean square error on each piece by a fit without it."""
    found: list[tuple[int, float]] = []
    for held in range(FOLDS):
        end = searched(problem, z, shape, 8, held)
        first = 0
        for p, error in zip(problem.pieces, problem.missed(end.x, shape), strict=True):
            means = np.add.reduceat(error**2, p.starts) / p.lengths
            number = first + np.arange(len(p.starts))
            mine = turn(number) == held
            found += zip(number[mine].tolist(), means[mine].tolist(), strict=True)
            first += len(number)
    return np.array([m for _, m in sorted(found)])


def _rigid(problem: Problem) -> Array:
    """Mean square error on each piece by the rigid axis fitted to all."""
    found = []
    for p in problem.pieces:
        error = settled(p, problem.rigid.axis).error
        found.append(np.add.reduceat(error**2, p.starts) / p.lengths)
    return np.concatenate(found)
