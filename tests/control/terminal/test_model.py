"""The model of the law `terminal`: friction holds and stops, drag and swing as in closed form."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from macromicro.control.terminal import model
from macromicro.control.terminal.model import Motion, Terminal

P = Terminal(share=0.0, frequency=0.0)
REST = Motion(0.0, 0.0, 0.0, 0.0)
DT = 1e-3


def after(p, m, u, periods):
    for _ in range(periods):
        m = model.moved(p, m, 0.0, u, DT)
    return m


def test_below_breakaway_nothing_moves_and_above_it_does_in_the_efforts_direction():
    held = P.coulomb + P.breakaway
    assert model.moved(P, REST, 0.0, held, DT) == REST
    assert model.moved(P, REST, 0.0, -held, DT) == REST
    assert model.moved(P, REST, 0.0, held + 0.1, DT).v > 0.0
    assert model.moved(P, REST, 0.0, -held - 0.1, DT).v < 0.0


def test_excess_friction_is_added_and_never_turns_into_a_push():
    assert model.friction(P, 0.5, 0.0) == pytest.approx(P.coulomb + P.breakaway + 0.5)
    assert model.friction(P, -9.0, 1.0) == 0.0
    assert model.friction(P, 0.0, 1.0) == pytest.approx(P.coulomb)
    there = model.friction(P, 0.0, P.fade)
    assert there == pytest.approx(P.coulomb + P.breakaway / math.e)


def test_speed_goes_to_what_the_effort_beyond_friction_holds():
    m = after(P, REST, 5.0, 500)
    assert m.v == pytest.approx(P.push * (5.0 - P.coulomb) / P.drag, rel=1e-6)


def test_drag_alone_takes_the_speed_exponentially():
    p = P._replace(coulomb=0.0, breakaway=0.0)
    m = after(p, Motion(0.0, 0.3, 0.0, 0.0), 0.0, 20)
    assert m.v == pytest.approx(0.3 * math.exp(-p.drag * 0.02), rel=1e-9)
    assert m.x == pytest.approx((0.3 - m.v) / p.drag, rel=1e-3)


def test_friction_stops_the_carriage_and_does_not_turn_it():
    m = after(P, Motion(0.0, 0.05, 0.0, 0.0), 0.0, 10)
    assert m.v == 0.0
    assert 0.0 < m.x < 0.05 * 0.01
    back = after(P, Motion(0.0, -0.05, 0.0, 0.0), 0.0, 10)
    assert back.x == pytest.approx(-m.x)


def test_a_swing_keeps_frequency_and_decay():
    p = Terminal(frequency=20.0, decay=2.0)
    turn = 2.0 * math.pi / math.sqrt((2.0 * math.pi * 20.0) ** 2 - 4.0)
    q, s = model.swung(p, 1e-3, 0.0, 0.0, turn)
    assert q == pytest.approx(1e-3 * math.exp(-2.0 * turn), rel=1e-9)
    assert s == pytest.approx(0.0, abs=1e-9)


def test_a_swing_goes_as_its_equation_says_whatever_its_damping():
    """Against the matrix exponential; the kick half at the begin, half at the end."""
    p = Terminal(frequency=20.0, decay=60.0)
    w = 2.0 * math.pi * 20.0
    turn = expm(np.array([[0.0, 1.0], [-w * w, -2.0 * 60.0]]) * 4e-3)
    wanted = turn @ [1e-3, 0.05 - 0.1] - [0.0, 0.1]
    assert model.swung(p, 1e-3, 0.05, 0.2, 4e-3) == pytest.approx(tuple(wanted), rel=1e-9)


def test_where_friction_stops_it_in_a_period_is_that_share_of_the_way():
    f = model.friction(P, 0.1, 0.01)
    fall = math.exp(-P.drag * DT)
    for way in (1.0, -1.0):
        end = fall * 0.01 - P.push * f * (1.0 - fall) / P.drag  # had it gone on
        part = 0.01 / (0.01 - end)
        p = P._replace(frequency=20.0)
        m = model.moved(p, Motion(2.0, way * 0.01, 1e-4, 0.02), 0.1, 0.0, DT)
        assert m.x == pytest.approx(2.0 + way * 0.5 * part * DT * 0.01, rel=1e-12)
        assert (m.x - 2.0) * way == pytest.approx(0.5 * part * DT * 0.01, rel=1e-6)
        assert m.v == 0.0
        assert (m.q, m.s) == model.swung(p, 1e-4, 0.02, -way * 0.01, DT)


def test_in_motion_way_speed_and_swing_are_those_of_the_equation():
    p = Terminal()
    w = 2.0 * math.pi * p.frequency
    m = Motion(1.0, -0.2, 3e-4, 0.4)
    found = model.moved(p, m, 0.3, -4.0, DT)
    back = p.share * (w * w * 3e-4 + 2.0 * p.decay * 0.4)
    fall = math.exp(-p.drag * DT)
    f = model.friction(p, 0.3, -0.2)
    v = -0.2 * fall + (p.push * (-4.0 + f) + back) * (1.0 - fall) / p.drag
    assert found.v == pytest.approx(v, rel=1e-12)
    assert found.x == pytest.approx(1.0 + 0.5 * DT * (v - 0.2), rel=1e-12)
    assert (found.q, found.s) == model.swung(p, 3e-4, 0.4, v + 0.2, DT)


def test_a_kick_of_the_carriage_leaves_the_swing_behind():
    _, s = model.swung(Terminal(), 0.0, 0.0, 0.2, 1e-6)
    assert s == pytest.approx(-0.2, rel=1e-3)
    assert model.swung(Terminal(frequency=0.0), 1e-3, 0.1, 0.2, DT) == (0.0, 0.0)


def test_the_swing_pulls_the_carriage_by_its_share():
    p = Terminal(coulomb=0.0, breakaway=0.0, drag=1e-6)
    w = 2.0 * math.pi * p.frequency
    m = model.moved(p, Motion(0.0, 1e-9, 1e-3, 0.0), 0.0, 0.0, 1e-5)
    assert m.v == pytest.approx(p.share * w * w * 1e-3 * 1e-5, rel=1e-3)


@given(st.floats(-0.4, 0.4), st.floats(-2e-3, 2e-3), st.floats(-0.3, 0.3))
def test_without_effort_the_energy_of_carriage_and_swing_falls(v, q, s):
    p = Terminal()
    w = 2.0 * math.pi * p.frequency

    def energy(m):
        return m.v**2 + p.share * ((m.s + m.v) ** 2 + (w * m.q) ** 2)

    m = Motion(0.0, v, q, s)
    later = after(p, m, 0.0, 100)
    assert energy(later) <= energy(m) * (1.0 + 1e-6) + 1e-12
