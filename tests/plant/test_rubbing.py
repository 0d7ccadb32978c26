"""Friction of one's own on an axis: solved for with the speed, remembered, compiled."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
import pytest

from macromicro.kernel import compiled, kernel
from macromicro.plant import axis, rubbing
from macromicro.plant.rubbing import FrictionPart, Sheet
from macromicro.schema.par import Par
from tests.plant.test_axis import DT, NOISE, params, run


class Wall(NamedTuple):
    """Friction that is another one beyond a place."""

    level: Annotated[float, Par("N", "level", "a test", lo=0.0)] = 2.0
    edge: Annotated[float, Par("m", "where it begins", "a test")] = 0.01
    grip: Annotated[float, Par("N*s/m", "at rest", "a test", lo=0.0)] = 1e6


class Passed(NamedTuple):
    """What it remembers: the way slid, and the force that it held at the start."""

    way: float
    held: float


def start(p: Wall, held: float) -> Passed:
    return Passed(0.0, held)


@kernel
def force(p: Wall, s: Passed, x: float, v: float, h: float) -> tuple[float, float]:
    level = p.level if x > p.edge else 0.0
    return 0.0, min(level / max(abs(v), 1e-9), p.grip)


@kernel
def after(p: Wall, s: Passed, x: float, v: float, h: float) -> Passed:
    return Passed(s.way + abs(v) * h, s.held)


WALL = rubbing.known(
    FrictionPart("wall", Wall, force, start, after, lambda p: Sheet(p.level, 0.0, 0.0))
)


@pytest.mark.parametrize("frequency", [0.0, 60.0])
def test_it_takes_the_place_of_the_bristles(frequency):
    """Free before the edge, at rest behind it; the way is what was slid, turns counted."""
    p = params(drive={"frequency": frequency})._replace(friction=Wall())
    states = run(p, lambda t: 1.0 if t < 0.05 else 0.0, 1500)
    free = run(p._replace(friction=Wall(edge=1.0)), lambda t: 1.0 if t < 0.05 else 0.0, 1500)
    assert [s.x for s in states if s.x < 0.01] == [s.x for s in free if s.x < 0.01]
    assert states[-1].x < 0.9 * free[-1].x and abs(states[-1].v) < 1e-6
    assert states[-1].rubbed.way == pytest.approx(
        float(np.sum(np.abs(np.diff([s.x for s in states])))), rel=0.02
    )


def test_it_brakes_by_its_force():
    """m dv/dt = -level, without a motor."""
    p = params()._replace(friction=Wall(edge=-1.0))
    p = p._replace(power=p.power._replace(push=0.0))
    first = axis.at_rest(p)._replace(v=0.1, vm=0.1)
    second = axis.advance(p, first, 0.0, NOISE, 0, DT)
    mass = p.body.motor + p.load.mass
    assert (first.v - second.v) * mass == pytest.approx(2.0 * DT, rel=4e-3)  # c + d v1
    back = axis.advance(p, first._replace(v=-0.1, vm=-0.1), 0.0, NOISE, 0, DT)
    assert back.v == pytest.approx(-second.v)


def test_it_is_told_what_it_holds_at_rest():
    p = params(load={"incline": 0.1})._replace(friction=Wall())
    assert axis.at_rest(p).rubbed == Passed(0.0, p.body.weight) and p.body.weight > 0.0


def test_compiled_it_does_the_same():
    p = params()._replace(friction=Wall(edge=1e-4))
    s, fast = axis.at_rest(p), compiled(axis.advance)
    for k in range(12):
        now = axis.advance(p, s, 0.3 * k, NOISE, 0, DT)
        assert tuple(fast(p, s, 0.3 * k, NOISE, 0, DT)) == tuple(now)
        s = now
    assert s.x > 1e-4 and s.rubbed.way > 0.0


def test_a_part_without_memory_has_none():
    class Oil(NamedTuple):
        slope: Annotated[float, Par("N*s/m", "slope", "a test")] = 3.0

    rubbing.known(FrictionPart("oil", Oil, lambda p, s, x, v, h: (0.5, p.slope)))
    p = params()._replace(friction=Oil())
    assert axis.at_rest(p).rubbed == 0.0
    first = axis.at_rest(p)._replace(v=0.1, vm=0.1)
    p = p._replace(power=p.power._replace(push=0.0))
    second = axis.advance(p, first, 0.0, NOISE, 0, DT)
    mass = p.body.motor + p.load.mass
    assert (first.v - second.v) * mass == pytest.approx((0.5 + 3.0 * 0.1) * DT, rel=1e-2)
    assert second.rubbed == 0.0
