"""Inverse dynamics under a force that repeats along the way: errors as wide as its phases make."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from macromicro.arrays import Array
from macromicro.identify import _axis_cogging, _axis_noise, axis_fit, coverage
from macromicro.identify._axis_cogging import cogged, repeating
from macromicro.identify._axis_instruments import instrumented
from macromicro.identify._ripple import Ripple, ripple
from macromicro.identify._spread import robust_covariance
from macromicro.identify.axis import Axis, acting, simulate, step
from macromicro.identify.axis_fit import rows_of
from macromicro.identify.axis_inverse import (
    Estimate,
    Rows,
    columns,
    evened,
    fitted,
    force_residuals,
    regressors,
)
from macromicro.identify.coverage import Drawn
from macromicro.identify.driven import Driven
from macromicro.identify.runs import Run

DT, EVERY, SIZE = 1e-3, 0.06, 1.5
TRUTH = Axis(mass=4.0, viscous=25.0, coulomb=12.0, offset=2.0)
NAMES = ("mass", "viscous", "coulomb", "offset")


def inputs(seed: int) -> Array:
    return np.repeat(np.random.default_rng(seed).uniform(-60.0, 60.0, 20), 250)


def moved(u: Array, phase: float, size: float = SIZE) -> Run:
    x, place, v = np.empty(len(u)), 0.0, 0.0
    for k in range(len(u)):
        x[k] = place
        push = float(u[k]) + size * math.sin(2.0 * math.pi / EVERY * place + phase)
        v, gone = step(TRUTH, v, acting(TRUTH, push, place, v, DT), DT)
        place += gone
    return Run(np.arange(len(u)) * DT, u, x)


def estimate(run: Run) -> tuple[list[Rows], Estimate]:
    rows = rows_of([run], Driven())
    return rows, instrumented(rows, fitted(rows, "coulomb"))


def test_errors_are_those_of_its_phases() -> None:
    """One motion, many phases: told from each record alone, as the estimates scatter over all."""
    u = inputs(0)
    phases = 2.0 * math.pi * np.arange(12) / 12.0
    found = [estimate(moved(u, float(phase)))[1] for phase in phases]
    off = np.array([f.values for f in found]) - [getattr(TRUTH, n) for n in NAMES]
    told = np.array([f.std for f in found])
    assert np.sqrt(np.mean((off / told) ** 2, axis=0)) == pytest.approx(1.0, abs=0.3)
    assert all(f.draws is not None for f in found)
    every = [2.0 * math.pi / f.repeats.turn for f in found if f.repeats]
    assert len(every) == 12 and every == pytest.approx([EVERY] * 12, rel=0.02)
    factors = np.array([f.factors for f in found])
    assert (np.abs(off) <= factors[:, 1] * told).mean() > 0.9
    assert factors[:, 1].mean() < 1.8  # of normal errors 1.96: most of it is one harmonic


def table(run: Run) -> tuple[list[Rows], Array]:
    rows = rows_of([run], Driven())
    return rows, columns(rows[0], NAMES, 1.0)[:, :-1]


def forced(rows: list[Rows], force: Array) -> Array:
    """A force behind the filters of a record."""
    r = rows[0]
    return np.asarray(evened(r, [force], [True])[:, 0])


def errors(rows: list[Rows], left: Array, missed: Array) -> Drawn | None:
    found = repeating(rows, left, missed)
    return None if found is None else cogged(found, left, left)


def without(left: Array, force: Array) -> Array:
    return np.asarray(force - left @ np.linalg.lstsq(left, force, rcond=None)[0])


def test_what_it_leaves_counts_as_noise() -> None:
    rows, left = table(moved(inputs(1), 0.3))
    x = rows[0].run.x
    cog = without(left, forced(rows, SIZE * np.sin(2.0 * np.pi / EVERY * x)))
    noise = without(left, 0.5 * np.random.default_rng(0).standard_normal(len(cog)))
    alone, both = (errors(rows, left, cog + e) for e in (0.0 * noise, noise))
    assert alone is not None and both is not None
    gained = np.diag(both.covariance) - np.diag(alone.covariance)
    own = np.diag(robust_covariance(left, noise, [len(noise)]))
    assert (np.abs(gained - own) < 0.3 * own + 0.1 * np.diag(alone.covariance)).all()
    assert np.mean(both.draws**2, axis=0) == pytest.approx(np.diag(both.covariance), rel=0.25)
    assert coverage.factors(alone.draws, np.eye(4)) == pytest.approx(
        np.sqrt(2.0) * np.sin(0.5 * np.pi * np.repeat([[0.6827], [0.95]], 4, axis=1)), rel=0.02
    )


def test_noise_is_no_cogging() -> None:
    u = inputs(2)
    slow = np.cumsum(np.random.default_rng(1).standard_normal(len(u))) * 0.05
    for force in (6.0 * np.random.default_rng(0).standard_normal(len(u)), slow):
        run = Run(np.arange(len(u)) * DT, u, simulate(TRUTH, u + force, DT))
        rows, left = table(run)
        assert errors(rows, left, without(left, forced(rows, force))) is None
        assert estimate(run)[1].draws is None


def test_a_quick_motion_makes_a_force_that_the_filters_weaken() -> None:
    """By the places alone a force beside the filters' corner would be taken for a weaker one."""
    rows, left = table(moved(inputs(3), 1.0))
    turn, x = 2.0 * np.pi / 0.006, rows[0].run.x  # ten times as many in the range
    pair = np.stack([forced(rows, np.sin(turn * x)), forced(rows, np.cos(turn * x))], axis=1)
    found = errors(rows, left, without(left, 3.0 * pair[:, 0]))
    assert found is not None
    exact = 0.5 * 3.0**2 * np.sum((np.linalg.pinv(left) @ pair) ** 2, axis=1)
    kept = [0, 2, 3]  # the viscous slope is hardly moved
    assert np.diag(found.covariance)[kept] == pytest.approx(exact[kept], rel=0.1)


def test_output_error_draws_it_beside_the_noise() -> None:
    run = moved(inputs(4), 2.0)
    rows, found = estimate(run)
    told = _axis_noise.disturbance(rows, found)
    assert told.repeats is not None
    assert told.repeats.size == pytest.approx(SIZE, rel=0.05)
    at = told.repeats.at(run.x)
    ideal = -SIZE * np.sin(2.0 * np.pi / EVERY * run.x + 2.0)
    assert min(np.std(at - ideal), np.std(at + ideal)) < 0.2 * SIZE
    plain = _axis_noise.noise(
        rows, found.axis, *(f(rows, found) for f in (force_residuals, regressors))
    )
    assert told.power < 0.1 * plain.power
    fit = axis_fit.drive(run.t, run.u, run.x, structure="coulomb").refined
    assert fit.draws is not None and not fit.sensed and fit.factors[1].mean() < 1.9


def test_it_is_sought_once_in_a_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Output error takes the period that inverse dynamics has found, or that there is none."""
    sought: list[Ripple | None] = []

    def seen(*args: list[Array]) -> Ripple | None:
        sought.append(ripple(*args))
        return sought[-1]

    monkeypatch.setattr(_axis_cogging, "ripple", seen)
    for run in (moved(inputs(4), 2.0), moved(inputs(4), 2.0, 0.0)):
        sought.clear()
        fit = axis_fit.drive(run.t, run.u, run.x, structure="coulomb")
        assert len(sought) == 1
        assert (fit.refined.draws is None) == (sought[0] is None)
    rows, found = estimate(moved(inputs(4), 2.0))
    assert found.repeats is not None
    again = _axis_noise.disturbance(rows, replace(found, searched=False)).repeats
    once = _axis_noise.disturbance(rows, found).repeats
    assert once is not None and again is not None
    assert once.turn == found.repeats.turn
    assert again.turn == pytest.approx(once.turn, rel=1e-3)
    assert again.size == pytest.approx(once.size, rel=1e-3)
