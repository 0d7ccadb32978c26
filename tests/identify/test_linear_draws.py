"""Errors of linear models by draws of cogging and of rounding are those of refits."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.signal import lfilter

from macromicro import identify
from macromicro.arrays import Array
from macromicro.identify import _linear_draws as model
from macromicro.identify._ripple import Ripple
from macromicro.identify.notices import DataWarning
from macromicro.identify.regression import Task, free_runs, prepared

DT = 1e-3
THETA = np.array([-0.95833, 165.72])
COG = Ripple(2.0 * np.pi / 60.0, 0.1, 0.06, 0.08)


def steps(seed: int, n: int = 3000, held: int = 250) -> Array:
    return np.asarray(np.repeat(np.random.default_rng(seed).uniform(-2.0, 2.0, n // held), held))


def task(
    u: list[Array], y: list[Array], order: int = 1, delay: int = 1, start: str = "rest"
) -> Task:
    return prepared(u, y, (order, order, delay), DT, None, start)  # type: ignore[arg-type]


def cogged(u: Array, phase: float, turn: float = COG.turn, size: float = 0.1) -> Array:
    """The machine of first order by hand, its force by the place at the end of each sample."""
    y, place, pull = np.zeros(len(u)), 0.0, 0.0
    for k in range(1, len(u)):
        pull = size * np.sin(turn * place + phase) if k > 1 else pull
        y[k] = 0.95833 * y[k - 1] + 165.72 * (u[k - 1] + (pull if k > 1 else size * np.sin(phase)))
        place += y[k] * DT
    return y


def fit(name: str, u: Array, y: Array) -> identify.LinearFit:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DataWarning)
        found: identify.LinearFit = getattr(identify, name)(u, y, 1, 1, DT)
    return found


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_runs_under_a_force_along_the_way_are_those_of_the_recursion(delay: int) -> None:
    """Second order, two records with states of their own at the start."""
    a, b, start = [-1.65833, 0.670831], [40.0, 9.716], [3.0, -2.0, 5.0, 1.0][: max(2, 1 + delay)]
    u = [steps(1, 500, 50), steps(2, 300, 50)]
    each = task(u, u, 2, delay, "free")
    theta = np.r_[a, b, np.zeros(len(start)), start]
    phases = np.array([0.0, 1.1, 2.5])
    runs = model.pushed(each, theta, 1, COG, phases)
    assert runs.shape == (3, 300)
    for run, phase in zip(runs, phases, strict=True):
        y, d, place = np.zeros(300), np.zeros(300), 0.0
        for k in range(300):
            if not delay:
                d[k] = COG.at(np.array(place), phase)
            for j in (0, 1):
                y[k] -= a[j] * y[k - j - 1] if k > j else 0.0
                at = k - delay - j
                y[k] += b[j] * (u[1][at] + d[at]) if at >= 0 else 0.0
            y[k] += start[k] if k < len(start) else 0.0
            place += y[k] * DT
            if delay:
                d[k] = COG.at(np.array(place), phase)
        np.testing.assert_allclose(run, y, rtol=1e-9, atol=1e-9)
    still = model.pushed(each, theta, 1, Ripple(1.0, 0.0, 0.0, 0.0), phases[:1])
    np.testing.assert_allclose(still[0], free_runs(each, theta)[1], rtol=1e-9, atol=1e-9)


def test_a_force_along_the_way_is_found_in_each_record() -> None:
    u = [steps(3), steps(4)]
    y = [cogged(u[0], 0.3), cogged(u[1], 2.0)]
    found = model.cogging(task(u, y), THETA)
    assert [2.0 * np.pi / one.turn for one in found] == pytest.approx([60.0, 60.0], rel=0.005)
    assert [one.size for one in found] == pytest.approx([0.1, 0.1], rel=0.05)
    assert [np.arctan2(one.cosine, one.sine) for one in found] == pytest.approx([0.3, 2.0], abs=0.2)
    plain = lfilter([0.0, THETA[1]], [1.0, THETA[0]], u[1])
    noisy = plain + 20.0 * np.random.default_rng(0).standard_normal(3000)
    assert not model.cogging(task(u, [y[0], noisy]), THETA)


def test_a_slow_force_is_none_along_the_way() -> None:
    for seed in range(6):
        u, random = steps(seed), np.random.default_rng(seed)
        walk = lfilter(
            [0.06 * np.sqrt(1.0 - 0.999**2)], [1.0, -0.999], random.standard_normal(3000)
        )
        y = lfilter([0.0, THETA[1]], [1.0, THETA[0]], u + walk)
        assert not model.cogging(task([u], [y]), THETA)


def test_errors_by_cogging_are_those_of_fits_in_any_phase() -> None:
    """Ten phases: what is told, of a fit in one of them, is the scatter of all fits about the
    truth; with it comes a mean, for a machine is slow where the force holds it. Their distribution
    is none of normal errors."""
    u = steps(5)
    fits = [fit("sriv", u, cogged(u, phase)) for phase in 2.0 * np.pi * np.arange(10) / 10]
    off = np.array([np.r_[f.a, f.b, f.gain] for f in fits]) - np.r_[THETA, 165.72 / (1.0 - 0.95833)]
    real = np.sqrt(np.mean(off**2, axis=0))
    told = np.array([np.r_[f.std, f.gain_std] for f in fits])
    assert not any(f.doubt for f in fits)
    np.testing.assert_allclose(np.median(told, axis=0), real, rtol=0.2)
    assert abs(off[:, 2].mean()) > 0.5 * off[:, 2].std()
    draws = fits[0].draws
    assert draws is not None and draws[:, 1].std() < 1.05 * fits[0].std[1]
    gain = draws @ np.r_[-fits[0].gain, 1.0] / (1.0 + fits[0].a.sum())
    assert np.sign(gain.mean()) == np.sign(off[:, 2].mean())
    assert all(f.factors[1, 1] < 1.85 for f in fits)


def test_noise_beside_cogging_adds_to_its_errors() -> None:
    u = steps(5)
    y = cogged(u, 0.3)
    noisy = y + 600.0 * np.random.default_rng(0).standard_normal(3000)
    each = task([u], [noisy])
    (cog,) = model.cogging(task([u], [y]), THETA)
    both = model.cogged(each, THETA, [cog])
    alone = model.cogged(task([u], [y]), THETA, [cog])
    white = lfilter([0.0, THETA[1]], [1.0, THETA[0]], u)
    noise = fit("sriv", u, white + noisy - y).covariance
    expected = np.diag(alone.covariance) + np.diag(noise)
    np.testing.assert_allclose(np.diag(both.covariance), expected, rtol=0.3)
    assert (np.diag(noise) > 2.0 * np.diag(alone.covariance)).all()


@pytest.mark.slow
@pytest.mark.parametrize("coloured", [False, True])
def test_errors_by_rounding_are_those_of_fits_to_all_counts(coloured: bool) -> None:
    u = steps(6)
    clean = lfilter([0.0, THETA[1]], [1.0, THETA[0]], u)
    method = "box_jenkins" if coloured else "sriv"
    off, many = [], 6 if coloured else 12
    for at in (np.arange(many) + 0.5) / many:
        found = fit(method, u, np.floor(clean / 100.0 + at) * 100.0)
        off.append(np.r_[found.a, found.b] - THETA)
    y = np.floor(clean / 100.0 + 0.4) * 100.0
    told = model.rounding(task([u], [y]), THETA, coloured=coloured)
    assert told is not None
    real = np.sqrt(np.mean(np.square(off), axis=0))
    np.testing.assert_allclose(np.sqrt(np.diag(told.covariance)), real, rtol=0.3)
    more = y + 100.0 * np.random.default_rng(0).standard_normal(3000)
    assert model.rounding(task([u], [more]), THETA, coloured=coloured) is None
