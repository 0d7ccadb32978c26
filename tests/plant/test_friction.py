"""Carriage friction: Section 4.2.1 (stiction, Coulomb, viscous), LuGre of reference [30]."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.plant import friction
from macromicro.plant.friction import Friction

P = Friction()
H = 5e-5


def slide(speeds: list[float], z: float = 0.0, offset: float = 0.0, h: float = H) -> np.ndarray:
    """Friction force [N] and bristle [m] at each step of a prescribed motion."""
    rows, v0 = [], speeds[0]
    for v in speeds:
        a, b, c, d = friction.bristle_terms(P, P.bristle, P.bristle_damping, z, v0, offset, h)
        z, force, v0 = a + b * v, c + d * v, v
        rows.append((force, z))
    return np.array(rows)


@pytest.mark.parametrize("v", [0.002, 0.01, 0.0321, 0.1, 0.5, -0.01, -0.3])
@pytest.mark.parametrize("offset", [-0.5, 0.0, 0.5])
def test_steady_sliding_force_is_the_stribeck_curve(v: float, offset: float) -> None:
    """Section 4.2.1: kinetic level plus what is left of the breakaway force at that speed."""
    force = slide([v] * 4000, offset=offset)[-1, 0]
    curve = P.coulomb + offset + P.stribeck * np.exp(-((v / P.stribeck_speed) ** 2))
    assert force == pytest.approx(np.sign(v) * curve, rel=1e-6)
    assert friction.level(P, v, offset) == pytest.approx(curve)


def test_force_drops_from_the_static_to_the_kinetic_level() -> None:
    """Sections 4.2.3 and 4.2.5: why the dead zone needs a jump (a0)."""
    static, kinetic = friction.level(P, 0.0, 0.0), friction.level(P, 1.0, 0.0)
    assert static == P.coulomb + P.stribeck
    assert kinetic == pytest.approx(P.coulomb)
    grid = [friction.level(P, v, 0.0) for v in np.linspace(0.0, 0.2, 50)]
    assert all(b <= a for a, b in pairwise(grid))


def test_level_never_turns_negative() -> None:
    """A negative level would push the carriage."""
    assert friction.level(P, 10.0, -100.0) > 0.0


@given(st.floats(0.05, 0.97), st.sampled_from([-1.0, 1.0]))
@settings(max_examples=10)
def test_sticks_below_breakaway(share: float, way: float) -> None:
    """Section 4.2.1: a force below the static level moves the carriage by its bristles only.

    The force grows over 0.3 s; applied at once, it would swing the bristles over the edge.
    """
    push = way * share * (P.coulomb + P.stribeck)
    mass, v, z, x = 0.45, 0.0, 0.0, 0.0
    for k in range(12000):  # 0.6 s
        a, b, c, d = friction.bristle_terms(P, P.bristle, P.bristle_damping, z, v, 0.0, H)
        force = push * min(k / 6000, 1.0)
        v = (mass * v + H * (force - c)) / (mass + H * (d + P.viscous))
        z, x = a + b * v, x + H * v
    assert abs(x) < 5.0 * (P.coulomb + P.stribeck) / P.bristle  # about one encoder count
    assert P.bristle * z == pytest.approx(push, rel=1e-6)
    assert abs(v) < 1e-9


def test_breaks_away_above_the_static_level() -> None:
    """Section 4.2.3: above breakaway it slides, and on with less force."""
    push, mass, v, z = 1.02 * (P.coulomb + P.stribeck), 0.45, 0.0, 0.0
    for _ in range(20000):
        a, b, c, d = friction.bristle_terms(P, P.bristle, P.bristle_damping, z, v, 0.0, H)
        v = (mass * v + H * (push - c)) / (mass + H * (d + P.viscous))
        z = a + b * v
    assert v == pytest.approx((push - P.coulomb) / P.viscous, rel=1e-3)


@given(
    st.lists(st.floats(-0.3, 0.3), min_size=2, max_size=12),
    st.floats(1e-6, 3e-4),
    st.floats(-0.5, 0.5),
)
@settings(max_examples=50)
def test_friction_takes_energy_but_for_what_its_bristles_store(
    speeds: list[float], h: float, offset: float
) -> None:
    """Over any motion the work done on the friction is at least the change of stored energy.

    The stored energy is bristle z^2 / 2; the motion is a polygon of random speeds.
    """
    path = [float(v) for a, b in pairwise(speeds) for v in np.linspace(a, b, 40)]
    rows = slide(path, offset=offset, h=h)
    work = float(np.sum(rows[:, 0] * np.array(path)) * h)
    stored = 0.5 * P.bristle * rows[-1, 1] ** 2
    assert work >= stored - 1e-12


def test_a_closed_path_costs_energy() -> None:
    """There and back over 5 mm: twice the kinetic level times the way, about 0.1 J."""
    v = 0.1 * np.sin(np.linspace(0.0, 2.0 * np.pi, 4000))
    rows = slide(list(v))
    assert np.sum(v) * H == pytest.approx(0.0, abs=1e-9)
    way = float(np.sum(np.abs(v)) * H)
    work = float(np.sum(rows[:, 0] * v) * H)
    assert P.coulomb * way < work < (P.coulomb + P.stribeck) * way


def test_bristle_stays_within_the_static_level() -> None:
    """LuGre: |sigma0 z| never exceeds the static friction."""
    greatest = 48.0 * H  # change of speed in a step by the motor's full force
    rng = np.random.default_rng(0)
    speeds = np.cumsum(rng.choice([-greatest, greatest], 20000))
    rows = slide(list(speeds))
    assert np.abs(rows[:, 1]).max() * P.bristle <= 1.01 * (P.coulomb + P.stribeck)


@given(st.floats(-0.01, 0.22))
def test_level_changes_along_the_rod_within_its_amplitude(x: float) -> None:
    """Section 4.2.3 (M1): motion depends on the position; 520 and 170 counts of period."""
    assert abs(friction.ripple(P, x)) <= P.ripple
    assert P.ripple_long * 14000 == pytest.approx(520.0, rel=1e-3)
    assert P.ripple_short * 14000 == pytest.approx(170.0, rel=1e-3)


def test_level_visits_most_of_its_amplitude() -> None:
    """(M1): it is a real dependence, of both signs, along 200 mm."""
    level = [friction.ripple(P, x) for x in np.linspace(0.0, 0.2, 2000)]
    assert max(level) > 0.9 * P.ripple
    assert min(level) < -0.9 * P.ripple


@pytest.mark.parametrize("x", [0.0, 0.003, 0.0097, 0.041, -0.02])
def test_the_level_changes_along_the_rod_by_two_sines(x: float) -> None:
    """Of 1 N from trough to crest each, one of them a radian ahead: alone by a far other period."""
    long = P._replace(ripple=1.0, ripple_short=1e12)
    assert friction.ripple(long, x) - friction.ripple(long, 0.0) == pytest.approx(
        0.5 * np.sin(2.0 * np.pi * x / P.ripple_long)
    )
    short = P._replace(ripple=1.0, ripple_long=1e12)
    assert friction.ripple(short, x) == pytest.approx(
        0.5 * np.sin(2.0 * np.pi * x / P.ripple_short + 1.0), abs=1e-9
    )


def test_friction_that_is_none_stays_a_micronewton() -> None:
    """Bristles need a level to be drawn against."""
    none = P._replace(coulomb=0.4, stribeck=0.0)
    assert friction.level(none, 0.1, -0.4) == friction.level(none, 0.1, -9.0) == 1e-6
    assert friction.level(none, 0.1, -0.3) == pytest.approx(0.1)
