"""Belt mode: Section 6.2, Figure 6.3 (about 20 um, gone in about two seconds)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.nominal import PERIOD
from macromicro.plant import belt
from macromicro.plant.belt import FASTEST, Belt
from macromicro.plant.bench import Bench
from macromicro.schema.par import entries

from .drives import energy

P = Belt()
MASS = 0.45
W = 2.0 * math.pi * P.frequency

modes = st.builds(Belt, st.floats(0.1, 400.0), st.floats(0.0, 500.0), st.floats(0.001, 1.0))


@given(modes, st.floats(-0.1, 0.1), st.floats(-5.0, 5.0), st.floats(1e-7, 10.0))
def test_without_a_kick_energy_never_rises_whatever_the_step(
    p: Belt, q: float, speed: float, h: float
) -> None:
    """Section 6.2: the belt stores and loses energy, it creates none."""
    before = energy(p, MASS, q, speed)
    # Rounding of one part grows with the phase of a step; of 276 Hz in 8 s by 1e-12.
    rounding = 1e-12 + np.finfo(float).eps * 2.0 * math.pi * p.frequency * h
    for _ in range(20):
        q, speed = belt.step(p, q, speed, 0.0, h)
        after = energy(p, MASS, q, speed)
        assert after <= before * (1.0 + rounding)
        before = after


@given(modes, st.floats(-0.1, 0.1), st.floats(-5.0, 5.0), st.floats(1e-7, 1.0))
def test_an_undamped_mode_keeps_its_energy(p: Belt, q: float, speed: float, h: float) -> None:
    """The midpoint rule neither damps nor excites by itself."""
    p = p._replace(decay=0.0)
    before = energy(p, MASS, q, speed)
    for _ in range(20):
        q, speed = belt.step(p, q, speed, 0.0, h)
    assert energy(p, MASS, q, speed) == pytest.approx(before, rel=1e-9)


def test_rings_and_decays_as_the_analytic_solution() -> None:
    """q = exp(-d t) (v0 / w_d) sin(w_d t), with w_d^2 = w^2 - d^2, over two seconds."""
    h, n = 5e-5, 40000
    damped = math.sqrt(W * W - P.decay * P.decay)
    q, speed, track = 0.0, 0.1, np.empty(n)
    for k in range(n):
        q, speed = belt.step(P, q, speed, 0.0, h)
        track[k] = q
    t = h * np.arange(1, n + 1)
    exact = np.exp(-P.decay * t) * 0.1 / damped * np.sin(damped * t)
    # The rule's phase error grows with time: (w h)^2 / 12 of the phase.
    np.testing.assert_allclose(track, exact, atol=0.1 / damped * 2.0 * W * (W * h) ** 2 / 12.0)
    half = n // 2
    ratio = np.abs(track[half:]).max() / np.abs(track[:half]).max()
    assert ratio == pytest.approx(math.exp(-P.decay * 1.0), rel=0.02)


def test_twenty_micrometres_are_gone_in_about_two_seconds() -> None:
    """Section 6.2 (I2): 20 um fall to 2 um in 1.5-2.5 s."""
    assert 1.5 <= math.log(20.0 / 2.0) / P.decay <= 2.5


@given(modes, st.floats(-0.01, 0.01), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
@settings(max_examples=50)
def test_a_kick_changes_the_mode_by_the_carriages_change_of_speed(
    p: Belt, q: float, speed: float, kick: float
) -> None:
    """q'' = ... - a: a step of the carriage's speed is the same step backwards of the mode's."""
    assert belt.step(p, q, speed, kick, 1e-4) == pytest.approx(
        belt.step(p, q, speed - kick, 0.0, 1e-4)
    )


def test_reaction_gives_the_carriage_what_the_mode_loses() -> None:
    """Carriage and mode alone exchange energy: free of damping, the sum stays.

    The energy of mode and carriage in the room's frame: M v^2/2 + mu M q'^2/2 + mu M v q'
    + spring, where mu M is the mode's mass beside the carriage's M.
    """
    p = P._replace(decay=0.0, participation=0.3)
    q, speed, v, h = 2e-3, 0.0, 0.0, 1e-6
    mode = p.participation * MASS

    def total() -> float:
        kinetic = 0.5 * MASS * v * v + 0.5 * mode * (speed + v) ** 2
        return kinetic + 0.5 * mode * W * W * q * q

    start, swing = total(), 0.0
    for _ in range(60000):
        new = v + h * belt.reaction(p, MASS, q, speed) / MASS
        q, speed = belt.step(p, q, speed, new - v, h)
        v = new
        swing = max(swing, 0.5 * MASS * v * v)
    assert total() == pytest.approx(start, rel=1e-3)
    assert swing > 0.05 * start  # the carriage took part


@given(st.floats(-0.01, 0.01), st.floats(-1.0, 1.0), st.floats(0.1, 2.0))
def test_reaction_is_the_gradient_of_the_energy_plus_the_damper(
    q: float, speed: float, mass: float
) -> None:
    """Force = dE/dq + 2 d (mode's mass) q': what pulls the mode back pushes the carriage."""
    e = 1e-6
    gradient = (energy(P, mass, q + e, 0.0) - energy(P, mass, q - e, 0.0)) / (2.0 * e)
    damper = 2.0 * P.decay * P.participation * mass * speed
    assert belt.reaction(P, mass, q, speed) == pytest.approx(gradient + damper, abs=1e-6)


def test_a_mode_that_the_loop_can_see_may_be_set() -> None:
    """A sampled loop sees nothing beyond half its frequency."""
    (entry,) = (e for e in entries(Bench()) if e.path == "belt.frequency")
    assert 100.0 < entry.par.hi == FASTEST < 0.5 / PERIOD
