"""What disturbs a drive on a spring, told from what friction makes of it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.identify import _sprung_spread
from macromicro.identify._ripple import Ripple
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
    own = _sprung_spread.ripple

    def told(*args: object) -> object:
        seen.append(own(*args))  # type: ignore[arg-type]
        return seen[-1]

    monkeypatch.setattr(_sprung_spread, "ripple", told)
    off, held = [], []
    for seed in range(6):
        fit = sprung_drive([cogged(seed)], spring=True, friction="coulomb")
        found = seen[-1]
        assert found is not None
        assert found.size == pytest.approx(SIZE, rel=0.06)
        assert 2.0 * math.pi / found.turn == pytest.approx(EVERY, rel=0.03)
        off.append((fit.values - [getattr(DRIVE, n) for n in fit.names]) / fit.std)
        held.append(np.abs(off[-1]) < fit.factors[1])
        assert fit.factors[1].mean() < 1.85
    size = np.sqrt(np.mean(np.square(off), axis=0))
    assert np.all(size > 0.5) and np.median(size) < 1.3, size
    assert np.mean(held) > 0.85


def test_what_is_left_tells_no_force_between_reversals_or_where_both_stand() -> None:
    t = np.arange(400) * DT
    x = np.sin(2.0 * math.pi * 5.0 * t)
    late = np.sin(2.0 * math.pi * 5.0 * (t - 0.004))
    for way in (x, late):
        way[330:] = way[330]  # stand
    ways = np.sign(np.gradient(x)) != np.sign(np.gradient(late))
    none = Ripple(1.0, 0.0, 0.0, 0.0)
    force = np.stack([t, 2.0 * t], axis=1)[1:-1] + 6.0 * ways[1:-1, None]
    force[331:] = 9.0  # friction balances anything
    r = Run(t, 0 * t, x)
    told = _sprung_spread._telling(r, x - late)
    assert not told[ways[1:-1]].any() and not told[331:].any()
    assert told.mean() > 0.6
    found = _sprung_spread._rest(r, force, told, none)
    assert found[:325] == pytest.approx(np.stack([t, 2.0 * t], axis=1)[1:326], abs=1e-9)
    assert np.ptp(found[331:], axis=0) == pytest.approx(0.0)
    # What goes another way all the time, or stands most of it, is no matter of reversals.
    assert _sprung_spread._telling(r, 2.0 * x)[:300].mean() > 0.95
    assert _sprung_spread._telling(r, x).all()


def test_cogging_alone_disturbs_a_record_that_rests(monkeypatch: pytest.MonkeyPatch) -> None:
    """At rest and at reversals friction feigned a slow force: the constant one was told ten times
    as wide."""
    run = cogged(1)
    told = sprung_drive([run], spring=True, friction="coulomb").std
    monkeypatch.setattr(_sprung_spread, "drawn", lambda level, n, dt, random: np.zeros(n))
    alone = sprung_drive([run], spring=True, friction="coulomb").std
    assert np.median(told / alone) < 1.1
    assert np.all(told < 3.0 * alone), told / alone
