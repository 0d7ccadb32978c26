"""What disturbs a drive on a spring, told from what friction makes of it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.identify import sprung_spread
from macromicro.identify.runs import Run
from macromicro.identify.sprung import Sprung, step
from macromicro.identify.sprung_fit import sprung_drive

DT = 1e-3
DRIVE = Sprung(mass=2.0, viscous=5.0, coulomb=3.0, offset=1.0, spring=400.0)
SIZE, EVERY = 1.5, 0.06


def cogged(seed: int) -> Run:
    random = np.random.default_rng(seed)
    u = np.repeat(random.uniform(-30.0, 30.0, 14), 286)[:4000]
    turn, phase = 2.0 * math.pi / EVERY, random.uniform(0.0, 2.0 * math.pi)
    x, place, v = np.empty(len(u)), 0.0, 0.0
    for k in range(len(u)):
        x[k] = place
        place, v = step(DRIVE, place, v, float(u[k]) + SIZE * math.sin(turn * place + phase), DT)
    return Run(np.arange(len(u)) * DT, u, x)


def test_a_force_that_repeats_along_the_way_of_a_drive_on_a_spring(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Between the reversals of record and free run friction pushes twice its level."""
    seen = []
    own = sprung_spread.ripple

    def told(*args: object) -> object:
        seen.append(own(*args))  # type: ignore[arg-type]
        return seen[-1]

    monkeypatch.setattr(sprung_spread, "ripple", told)
    off = []
    for seed in range(6):
        fit = sprung_drive([cogged(seed)], spring=True, friction="coulomb")
        found = seen[-1]
        assert found is not None
        assert found.size == pytest.approx(SIZE, rel=0.06)
        assert 2.0 * math.pi / found.turn == pytest.approx(EVERY, rel=0.03)
        off.append((fit.values - [getattr(DRIVE, n) for n in fit.names]) / fit.std)
        assert fit.factors[1].mean() < 1.85
    size = np.sqrt(np.mean(np.square(off), axis=0))
    assert np.all((size > 0.5) & (size < 1.4)), size


def test_forces_stand_for_those_between_reversals() -> None:
    t = np.arange(400) * DT
    x = np.sin(2.0 * math.pi * 5.0 * t)
    late = np.sin(2.0 * math.pi * 5.0 * (t - 0.004))
    ways = np.sign(np.gradient(x)) != np.sign(np.gradient(late))
    force = np.stack([t, 2.0 * t], axis=1)[1:-1] + 6.0 * ways[1:-1, None]
    found = sprung_spread._steady(Run(t, 0 * t, x), x - late, force)
    assert found == pytest.approx(np.stack([t, 2.0 * t], axis=1)[1:-1], abs=1e-9)
    same = sprung_spread._steady(Run(t, 0 * t, x), 0.0 * x, force)
    assert same is force  # nothing is apart
    assert sprung_spread._steady(Run(t, 0 * t, x), 2.0 * x, force) is force  # all of it is
