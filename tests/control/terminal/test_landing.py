"""Landings: they end at rest at the goal, with the least effort, by the linear model itself."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from macromicro.control.terminal import landing
from macromicro.control.terminal.model import Motion, Terminal

DT = 1e-3
P = Terminal()


def system(p):
    """The linear model in (x, v, q, s), from `model`'s equations solved for x'' and q''."""
    w, d = 2.0 * math.pi * p.frequency, p.decay
    pull = np.array([0.0, -p.drag, p.share * w * w, 2.0 * p.share * d])
    swing = np.array([0.0, 0.0, -w * w, -2.0 * d]) - pull
    return (
        np.array([[0.0, 1.0, 0.0, 0.0], pull, [0.0, 0.0, 0.0, 1.0], swing]),
        np.array([0.0, p.push, 0.0, -p.push]),
    )


def flown(p, at, goal, periods, anew=True):
    """Efforts of a landing, planned anew each period or once; where the linear model ends.

    A plan takes the swing's pull on the carriage as damping alone; planning anew makes that good.
    """
    a, b = system(p)
    both = np.zeros((5, 5))
    both[:4, :4], both[:4, 4] = a * DT, b * DT
    step = expm(both)
    modes = landing.modes(p, DT)
    plan = landing.planned(p, modes, at, goal, periods)
    z, sent = np.array(at), []
    for k in range(periods):
        if anew:
            plan = landing.planned(p, modes, Motion(*map(float, z)), goal, periods - k)
        w, _, _ = landing.efforts(modes, plan, periods - k)
        sent.append(w)
        z = step[:4, :4] @ z + step[:4, 4] * w
    return np.array(sent), z


def test_from_rest_it_ends_at_the_goal_at_rest_with_the_belt_at_rest():
    sent, z = flown(P, Motion(0.0, 0.0, 0.0, 0.0), 0.01, 62)
    assert z[0] == pytest.approx(0.01, abs=5e-6)
    assert z[1] == pytest.approx(0.0, abs=2e-3)
    assert abs(z[2]) < 2e-5
    assert abs(z[3]) < 3e-3
    assert sent.max() > 0.0 > sent.min()


@settings(max_examples=30)
@given(st.floats(-0.4, 0.4), st.floats(-1e-3, 1e-3), st.floats(-0.1, 0.1), st.floats(-0.02, 0.02))
def test_it_ends_at_rest_from_any_state(v, q, s, goal):
    sent, z = flown(P, Motion(0.0, v, q, s), goal, 80)
    size = 1.0 + float(np.abs(sent).max())
    assert abs(z[0] - goal) < 5e-6 * size
    assert abs(z[1]) < 1e-3 * size
    assert abs(z[2]) < 2e-5 * size
    assert abs(z[3]) < 3e-3 * size


def test_no_other_efforts_that_end_there_are_smaller():
    at, goal, n = Motion(0.0, 0.3, 2e-4, 0.02), 0.012, 62
    sent, z = flown(P, at, goal, n, anew=False)
    a, b = system(P)
    both = np.zeros((5, 5))
    both[:4, :4], both[:4, 4] = a * DT, b * DT
    step = expm(both)
    reach, free = [], np.array(at)
    column = step[:4, 4]
    for _ in range(n):
        reach.append(column)
        column = step[:4, :4] @ column
        free = step[:4, :4] @ free
    least = np.linalg.pinv(np.array(reach[::-1]).T) @ (z - free)
    assert float(sent @ sent) == pytest.approx(float(least @ least), rel=0.01)


def test_lowest_and_highest_are_those_of_the_efforts():
    at = Motion(0.0, 0.2, 1e-4, 0.0)
    modes = landing.modes(P, DT)
    plan = landing.planned(P, modes, at, 0.008, 40)
    every = [landing.efforts(modes, plan, 40 - k)[0] for k in range(40)]
    first, lowest, highest = landing.efforts(modes, plan, 40)
    assert (first, lowest, highest) == (every[0], min(every), max(every))


def test_without_a_known_swing_place_and_speed_alone_are_landed():
    p = P._replace(frequency=0.0, share=0.0)
    _, z = flown(p, Motion(0.0, 0.3, 0.0, 0.0), 0.012, 50)
    assert z[0] == pytest.approx(0.012, abs=1e-5)
    modes = landing.modes(p, DT)
    plan = landing.planned(p, modes, Motion(0.0, 0.3, 0.0, 0.0), 0.012, 50)
    assert math.isfinite(landing.efforts(modes, plan, 50)[0])
    fall = math.exp(-p.drag * DT)
    speed, place = p.push * (1.0 - fall) / p.drag, p.push * DT / p.drag
    wanted = (p.drag, 0.0, fall, 0.0, 0.0, 0.0, 0.0, place, speed, 0.0, 0.0)
    assert tuple(modes) == pytest.approx(wanted)


def test_a_plan_is_the_softened_least_squares_solution():
    """Against the exact sampled system without the swing's pull, in the modes' coordinates."""
    p = Terminal(share=0.0, decay=15.0, frequency=18.0)
    at, goal, n = Motion(0.001, 0.25, 3e-4, -0.05), 0.009, 45
    a, b = system(p)
    both = np.zeros((5, 5))
    both[:4, :4], both[:4, 4] = a * DT, b * DT
    step = expm(both)
    w = 2.0 * math.pi * p.frequency
    tied = p.drag / (p.drag**2 - 2.0 * p.decay * p.drag + w * w)
    modal = np.array(
        [[1.0, 1.0 / p.drag, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0],
         [0.0, -tied, 1.0, 0.0], [0.0, tied * p.drag, 0.0, 1.0]]
    )  # fmt: skip
    column, reach, free = step[:4, 4], [], np.array(at)
    for _ in range(n):
        reach.append(modal @ column)
        column = step[:4, :4] @ column
        free = step[:4, :4] @ free
    c = np.array(reach[::-1]).T
    soft = np.diag([3e-6**2, 5e-4**2, 1e-5**2, 1.5e-3**2])
    lack = modal @ np.array([goal, 0.0, 0.0, 0.0]) - modal @ free
    wanted = c.T @ np.linalg.solve(c @ c.T + soft, lack)
    modes = landing.modes(p, DT)
    plan = landing.planned(p, modes, at, goal, n)
    found = [landing.efforts(modes, plan, n - k)[0] for k in range(n)]
    assert found == pytest.approx(wanted, abs=3e-3 * float(np.abs(wanted).max()))


def test_the_modes_of_a_flexible_carriage_are_those_of_its_system():
    """Speed and swing of the coupled system: its eigenvalues, to first order in the share."""
    p = Terminal(share=0.03, decay=3.0)
    m = landing.modes(p, DT)
    values = np.linalg.eigvals(system(p)[0])
    real = sorted(v.real for v in values if abs(v.imag) < 1e-9)
    ring = next(v for v in values if v.imag > 0.0)
    assert m.fall == pytest.approx(math.exp(real[0] * DT), rel=3e-4)
    turned = np.linalg.eigvals(np.array([[m.a, m.b], [m.c, m.d]]))
    assert max(turned.imag) == pytest.approx(abs(np.exp(ring * DT).imag), rel=3e-3)
    assert turned[0].real == pytest.approx(np.exp(ring * DT).real, rel=3e-4)
