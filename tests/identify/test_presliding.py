"""An axis with elastic friction: LuGre (Canudas de Wit 1995)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.identify import Axis
from macromicro.identify import simulate as rigid
from macromicro.identify.presliding import Presliding, begin, level, simulate, slid
from macromicro.identify.presliding import step as moved

DT = 1e-3
PLAIN = Presliding(
    mass=2.0,
    viscous=8.0,
    offset=0.0,
    asymmetry=0.0,
    stribeck=0.0,
    stribeck_speed=0.01,
    stiffness=5e5,
    settling=1e-3,
    levels=np.array([5.0]),
    low=0.0,
    high=1.0,
)


def test_the_level_goes_linearly_between_nodes_and_stays_beyond_them() -> None:
    p = PLAIN._replace(levels=np.array([4.0, 6.0, 5.0]), low=-1.0, high=1.0)
    seen = [level(p, x, 1.0) for x in (-2.0, -1.0, -0.5, 0.0, 0.5, 0.75, 1.0, 3.0)]
    assert seen == pytest.approx([4.0, 4.0, 5.0, 6.0, 5.5, 5.25, 5.0, 5.0])
    assert p.coulomb == pytest.approx(5.0)


def test_the_drop_fades_with_the_square_of_the_speed() -> None:
    p = PLAIN._replace(stribeck=2.0, stribeck_speed=0.1)
    for v in (0.0, 0.05, -0.1, 0.3):
        assert level(p, 0.0, v) == pytest.approx(5.0 + 2.0 * np.exp(-((v / 0.1) ** 2)))


def test_a_force_below_the_level_moves_it_as_far_as_the_stiffness_lets_it() -> None:
    p = PLAIN._replace(settling=5e-3)
    pull = 0.05 * 5.0
    x = simulate(p, np.r_[0.0, np.full(3000, pull)], DT)
    stands = p.levels[0] * -np.log(1.0 - 0.05) / p.stiffness  # f = g (1 - exp(-sigma0 x/g))
    assert x[-1] == pytest.approx(stands, rel=0.02)
    assert abs(x[-1] - x[-2]) < 1e-12


def test_friction_of_a_sliding_axis_is_its_level() -> None:
    p = PLAIN._replace(viscous=0.0, offset=0.7, levels=np.array([5.0]))
    x = simulate(p, np.full(400, 9.0), DT, v=0.4)
    v = np.diff(x) / DT
    assert np.diff(v) / DT == pytest.approx((9.0 - 0.7 - 5.0) / 2.0, rel=1e-6)


def test_viscous_friction_differs_by_direction() -> None:
    p = PLAIN._replace(asymmetry=3.0)
    for side in (1.0, -1.0):
        x = simulate(p, np.full(6000, side * 20.0), DT, v=side * 0.5)
        assert (x[-1] - x[-2]) / DT == pytest.approx(side * 15.0 / (8.0 + side * 3.0), rel=1e-4)


def test_a_stiff_one_is_the_axis_with_rigid_friction() -> None:
    t = np.arange(3000) * DT
    force = 12.0 * np.sin(2 * np.pi * 1.3 * t) + 3.0 * np.sin(2 * np.pi * 0.4 * t)
    p = PLAIN._replace(stiffness=2.0 * (1.0 / DT) ** 2, settling=2 * DT)
    other = rigid(Axis(mass=2.0, viscous=8.0, coulomb=5.0), force, DT)
    assert simulate(p, force, DT) == pytest.approx(other, abs=0.01 * np.ptp(other))


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_friction_stays_within_its_level_and_gives_back_no_more_than_it_stored(seed) -> None:
    random = np.random.default_rng(seed)
    f = stored = 0.0
    for dx in np.repeat(random.normal(0.0, 2e-5, 12), 10) / 10.0:
        f = slid(PLAIN, f, 5.0, dx, 1.0)
        assert abs(f) <= 5.0 * (1.0 + 1e-12)
        now = f**2 / (2.0 * PLAIN.stiffness)
        assert f * dx >= now - stored - 1e-15
        stored = now


def test_a_run_begins_in_balance_or_sliding() -> None:
    for v, pull, f in ((0.0, 3.0, 3.0), (0.0, -9.0, -5.0), (0.1, 0.0, 5.0), (-0.1, 1.0, -5.0)):
        assert begin(PLAIN, 0.0, v, pull) == pytest.approx(f)


def test_a_stuck_mass_swings_at_the_frequency_of_mass_and_stiffness() -> None:
    p = PLAIN._replace(viscous=0.0, settling=0.0)
    f, h = 0.0, 1e-4
    x, v, seen = 0.0, 1e-6, []
    for _ in range(2000):
        v, gone, f = moved(p, f, x, v, 0.0, h)
        x += gone
        seen.append(x)
    turns = np.flatnonzero(np.diff(np.sign(seen)) > 0)
    frequency = (len(turns) - 1) / ((turns[-1] - turns[0]) * h)
    assert frequency == pytest.approx(np.sqrt(p.stiffness / p.mass) / (2 * np.pi), rel=0.01)


def test_damping_before_sliding_is_the_settling_time_times_the_stiffness() -> None:
    p = PLAIN._replace(viscous=0.0, settling=2e-4)
    f, h, x, v = 0.0, 1e-5, 0.0, 1e-6
    first = second = 0.0
    for k in range(3000):
        v, gone, f = moved(p, f, x, v, 0.0, h)
        x += gone
        if k < 1300:
            first = max(first, abs(x))
        if k >= 1300:
            second = max(second, abs(x))
    rate = p.settling * p.stiffness / (2 * p.mass)
    assert second / first == pytest.approx(np.exp(-rate * 0.0126), rel=0.05)
