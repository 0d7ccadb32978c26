"""`identify.carriage_give`: how a carriage that stands gives, and the swing without that."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control.terminal.model import Terminal
from macromicro.identify import carriage
from macromicro.identify.carriage import Answer, Give, Nudged
from macromicro.plant import bench
from macromicro.schema.par import changed
from macromicro.settings import Settings
from macromicro.thesis import strokes

DT = 1e-3
P = Terminal()._replace(push=10.0, frequency=20.0, decay=1.2, share=0.02, delay=1.5 * DT)


def springy(
    p: Terminal, natural: float, rate: float, *, left: float = 0.0, noise: float = 0.0
) -> Nudged:
    """A mass on a spring of so many Hz and its damper, and the swing on it, in steps of 20 us."""
    u, n, h = strokes.nudges(5.0)[strokes.REST :], 50, DT / 50
    w, b = 2.0 * math.pi * p.frequency, 2.0 * math.pi * natural
    x = v = s = 0.0
    q, shown = left / p.share, np.empty(len(u))
    late = round(p.delay / h)
    sent = np.concatenate([np.zeros(late), np.repeat(u, n)])
    for k in range(len(u)):
        shown[k] = x + p.share * q
        for j in range(n):
            pull = w * w * q + 2.0 * p.decay * s
            a = p.push * sent[k * n + j] + p.share * pull - b * b * x - 2.0 * rate * v
            v += h * a
            x += h * v
            s += h * (-pull - a)
            q += h * s
    draw = np.random.default_rng(1).standard_normal(len(u))
    return Nudged(u, shown + noise * draw)


def spring(p: Terminal, natural: float, rate: float) -> complex:
    """Answer of that mass to an effort at the swing's frequency, m/V."""
    w, b = 2.0 * math.pi * p.frequency, 2.0 * math.pi * natural
    return p.push / (b * b - w * w + 2j * rate * w)


def seen(p: Terminal, give: Give) -> Terminal:
    """The swing on such a carriage: the root of its equation, and what a laser sees of it."""
    with_it = carriage.swing_motion(p, give.carriage)
    w = 2.0 * math.pi * p.frequency
    roots = np.roots([1.0 + p.share * with_it, 2.0 * p.decay, w * w])
    root = complex(roots[np.argmax(roots.imag)])
    return p._replace(
        frequency=abs(root) / (2.0 * math.pi),
        decay=-root.real,
        share=p.share * abs(1.0 + carriage.swing_motion(p, give.platform)),
    )


@pytest.mark.parametrize(("natural", "rate"), [(200.0, 600.0), (120.0, 300.0)])
def test_the_answer_at_the_swing_s_frequency_is_found_beside_a_swing(
    natural: float, rate: float
) -> None:
    true = spring(P, natural, rate)
    late = -math.atan2(true.imag, true.real) / (2.0 * math.pi * P.frequency)
    answer = Answer(abs(true), late)
    as_seen = seen(P, Give(answer, answer))
    found = carriage.compliance(as_seen, [springy(P, natural, rate, left=30e-6)], DT)
    for one in found:
        assert one.way == pytest.approx(abs(true), rel=0.02)
        assert one.lag == pytest.approx(late, abs=0.05e-3)


def test_its_errors_are_those_of_noise() -> None:
    low, high = (
        carriage.compliance(P, [springy(P, 200.0, 600.0, noise=s)], DT) for s in (0.05e-6, 0.5e-6)
    )
    for quiet, loud in zip(low, high, strict=True):
        assert 5.0 < loud.errors[0] / quiet.errors[0] < 20.0
        assert abs(loud.way - quiet.way) < 4.0 * loud.errors[0]
        assert abs(loud.lag - quiet.lag) < 4.0 * loud.errors[1]
        assert loud.errors[0] < 0.05 * loud.way


@given(
    way=st.floats(0.5e-6, 30e-6),
    lag=st.floats(0.0, 2e-3),
    shaken=st.floats(0.8, 1.2),
    frequency=st.floats(8.0, 40.0),
    decay=st.floats(0.5, 4.0),
    share=st.floats(0.005, 0.05),
)
def test_a_stiff_carriage_s_swing_is_that_of_the_equations(
    way: float, lag: float, shaken: float, frequency: float, decay: float, share: float
) -> None:
    """q'' + 2 d q' + w^2 q = -x'' with x = share moved q."""
    p = P._replace(frequency=frequency, decay=decay, share=share)
    give = Give(Answer(way, lag), Answer(shaken * way, lag))
    on_a_spring = seen(p, give)
    found = carriage.stiff(on_a_spring, give)
    assert found.frequency == pytest.approx(frequency, rel=1e-6)
    assert found.decay == pytest.approx(decay, rel=1e-4)
    assert found.share == pytest.approx(share, rel=1e-6)
    assert on_a_spring.share >= share


def test_what_is_not_sure_of_the_give_makes_the_swing_less_sure() -> None:
    answer = Answer(6e-6, 0.8e-3, (0.3e-6, 0.05e-3))
    give = Give(answer, answer)
    told = carriage.unsure(P, give, 0.0, 0.0)
    moves = carriage.swing_motion(P, answer).real
    assert told["share"] == pytest.approx(P.share * moves * 0.05, rel=0.1)
    assert told["frequency"] == pytest.approx(0.5 * P.frequency * P.share * moves * 0.05, rel=0.1)
    more = carriage.unsure(P, give, 0.5, 0.3e-3)
    assert all(more[name] > told[name] for name in told)
    assert more["decay"] > 2.0 * told["decay"]


def test_nudges_are_no_strokes_and_only_a_laser_sees_them() -> None:
    plant = bench.prepare(Settings().bench, Settings().sensors)
    volts = np.concatenate([strokes.efforts(5.0)[:3000], np.zeros(300), strokes.nudges(5.0)])
    run = strokes.stroke(plant, volts, 900.0)
    cut = carriage.cut_strokes(run["t"], run["motor"], run["macro_position"], run["laser"] * 1e-6)
    ((a, b),) = cut.nudges
    assert a == 3300 + strokes.REST and b == len(volts)
    assert all(end <= a for _, end, _ in cut.strokes)
    give = carriage._give(P, [cut], DT)
    assert give is not None
    assert carriage._give(P, [cut._replace(laser=np.empty(0))], DT) is None
    assert carriage._give(P, [cut._replace(nudges=((a, a + 400),))], DT) is None


@pytest.mark.parametrize("bristle", [3.6e5, 7.26e5])
def test_the_bench_gives_by_its_bristles(bristle: float) -> None:
    tree = changed(Settings(), {"bench.friction.bristle": bristle})
    b = tree.bench
    plant = bench.prepare(b, tree.sensors)
    run = strokes.stroke(plant, strokes.nudges(5.0), 900.0)
    r = Nudged(run["motor"][strokes.REST :], run["laser"][strokes.REST :] * 1e-6)
    push = b.motor.constant / (b.motor.resistance * b.motor.pulley) * 4.0 / b.carriage.mass
    p = Terminal()._replace(push=push, delay=1.5e-3)
    found = carriage.compliance(p, [r], DT)
    mass, w = b.carriage.mass, 2.0 * math.pi * p.frequency
    assert found.carriage.way == pytest.approx(push * mass / (bristle - mass * w * w), rel=0.05)
    assert found.platform.way == pytest.approx(found.carriage.way, rel=0.15)  # it is shaken
