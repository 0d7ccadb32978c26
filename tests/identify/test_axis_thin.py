"""Long records as means over blocks: the same motion under the same force, and the same axis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.identify import _axis_thin, drive
from macromicro.identify.axis import Axis, simulate
from macromicro.identify.axis_fit import DriveFit
from macromicro.identify.axis_inverse import Estimate, differences
from macromicro.identify.driven import Driven
from macromicro.identify.notices import DataWarning, SaturationWarning, notice
from macromicro.identify.runs import Run

DT = 1e-3
AXIS = Axis(mass=95.0, viscous=203.0, coulomb=20.0, offset=-3.0)


def record(n: int, seed: int = 2, axis: Axis = AXIS) -> Run:
    """Moves both ways under a disturbed force, with noise of the position."""
    rng = np.random.default_rng(seed)
    t = np.arange(n) * DT
    u = 40.0 * np.sign(np.sin(2.2 * t + np.sin(0.05 * t))) + 30.0 * np.sin(5.7 * t)
    force = u + 0.8 * np.repeat(rng.standard_normal(n // 50 + 1), 50)[:n]
    return Run(t, u, simulate(axis, force, DT) + 1e-6 * rng.standard_normal(n))


@given(many=st.integers(2, 9), seed=st.integers(0, 99))
def test_means_move_as_the_mean_force_tells(many: int, seed: int) -> None:
    """Without friction: the speed from block to block, exactly, whatever the force did."""
    n = 40 * many + many // 2
    u = np.random.default_rng(seed).standard_normal(n)
    v = np.concatenate([[0.0], np.cumsum(u)[:-1]]) * DT  # at each sample, under a held force
    made = _axis_thin.means(Run(np.arange(n) * DT, u, v), many)
    assert len(made.t) == 40 and made.dt == pytest.approx(many * DT)
    speeds, force = made.x, made.u  # what is averaged as positions are speeds here
    np.testing.assert_allclose(np.diff(speeds), force[:-1] * made.dt, atol=1e-12)


def test_short_records_stay_as_they_are() -> None:
    assert _axis_thin.factors([record(20_000)], Driven()) == (1, 1)


def test_blocks_are_short_against_the_time_constant(monkeypatch: pytest.MonkeyPatch) -> None:
    """470 samples: 100 or more remain for regression, 30 for free runs, if so many are too many."""
    monkeypatch.setattr(_axis_thin, "LONG", 1000)
    run = record(30_000)
    assert _axis_thin.factors([run], Driven()) == (4, 15)
    monkeypatch.setattr(_axis_thin, "LONG", 10_000)
    assert _axis_thin.factors([run], Driven()) == (3, 3)
    still = run._replace(x=np.zeros(len(run.x)))
    assert _axis_thin.factors([still], Driven()) == (1, 1)


@pytest.fixture(scope="module")
def both() -> tuple[Run, DriveFit, DriveFit]:
    run = record(20_000)
    with pytest.MonkeyPatch.context() as patch:
        plain = drive(*run, structure="coulomb")
        patch.setattr(_axis_thin, "LONG", 7500)
        patch.setattr(_axis_thin, "_PIECE", 3000)  # of means, of which there are 10 000
        return run, plain, drive(*run)


def test_long_records_are_cut_for_regression_and_no_sample_is_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(_axis_thin, "LONG", 3000)
    monkeypatch.setattr(_axis_thin, "_PIECE", 1000)
    both = [differences(record(n), np.arange(float(n)), 80.0, 1) for n in (3000, 3500)]
    made = _axis_thin.pieces(both)
    assert [len(r.v) for r in made] == [3000, 875, 875, 875, 875]
    for name in ("force", "v", "a", "still"):
        whole = np.concatenate([getattr(r, name) for r in both])
        np.testing.assert_array_equal(np.concatenate([getattr(r, name) for r in made]), whole)
    np.testing.assert_array_equal(np.concatenate([r.run.x for r in made[1:]]), both[1].run.x)


def test_the_same_axis_is_found(both: tuple[Run, DriveFit, DriveFit]) -> None:
    _, plain, thin = both
    assert thin.structure == "coulomb"
    for one, other in ((plain.refined, thin.refined), (plain.inverse, thin.inverse)):
        assert (np.abs(one.values - other.values) < one.std).all()
        assert (other.std < 1.5 * one.std).all() and (one.std < 1.5 * other.std).all()


def test_the_free_run_is_of_what_was_measured(both: tuple[Run, DriveFit, DriveFit]) -> None:
    run, plain, thin = both
    assert [len(x) for x in thin.free_run] == [len(run.x)]
    np.testing.assert_allclose(run.x - thin.free_run[0], thin.residuals[0], atol=1e-15)
    assert thin.rms == pytest.approx(float(np.sqrt(np.mean(thin.residuals[0] ** 2))))
    assert thin.rms < 1.5 * plain.rms
    assert thin.fit == pytest.approx(100.0 - 100.0 * thin.rms / float(np.std(run.x)))


def test_what_means_make_of_reversals_is_taken_off(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without noise, of four samples each: 0.1 % of the mass and 0.2 % of viscous friction."""
    monkeypatch.setattr(_axis_thin, "LONG", 10_000)
    run = record(60_000)
    clean = run._replace(x=simulate(AXIS, np.clip(run.u, -65.0, 65.0), DT))
    assert _axis_thin.factors([clean], Driven()) == (4, 6)
    with pytest.warns(SaturationWarning):
        fit = drive(*clean, structure="coulomb", limit=65.0)
    assert fit.rms < 1e-3  # the free run over the record as measured knows the limit, too
    found = fit.inverse
    truth = np.array([getattr(AXIS, n) for n in found.names])
    assert (np.abs(found.values - truth) < [0.02, 0.06, 0.004, 0.002]).all()


def test_an_estimate_stays_where_the_parts_do_not_better_it(
    recwarn: pytest.WarningsRecorder,
) -> None:
    found = Estimate(AXIS, ("mass", "viscous"), np.eye(2), 0.1, 1.0)

    def refused(_: list[Run]) -> Estimate:
        raise InputError("record", "at rest", "a motion")

    def far(_: list[Run]) -> Estimate:
        return replace(found, axis=AXIS._replace(mass=200.0))

    def near(parts: list[Run]) -> Estimate:
        """As of a run by the axis itself, under the input as it acts."""
        (part,) = parts
        notice(DataWarning, "said of the record already")
        np.testing.assert_allclose(part.x, run.x[0] + simulate(AXIS, 2.0 * run.u, DT), atol=1e-12)
        return replace(found, axis=AXIS._replace(mass=94.0, viscous=204.0))

    run = record(2000)._replace(x=np.full(2000, 0.3))
    for again in (refused, far):
        assert _axis_thin.unblurred([run], found, Driven(2.0), again) is found
    other = _axis_thin.unblurred([run], found, Driven(2.0), near)
    assert other.values.tolist() == [96.0, 202.0] and other.axis.coulomb == 20.0
    assert other.covariance is found.covariance
    assert not recwarn.list


def test_a_late_input_is_moved_before_it_is_averaged(monkeypatch: pytest.MonkeyPatch) -> None:
    run = record(20_000)
    later = run._replace(u=np.roll(run.u, -7))
    monkeypatch.setattr(_axis_thin, "LONG", 7500)
    found = drive(*later, structure="coulomb", delay=7)
    assert abs(found.refined.axis.mass - 95.0) < 3.0 * found.refined.std[0]
    assert found.fit > 99.0
