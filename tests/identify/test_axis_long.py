"""Long records as means over blocks: the same motion under the same force, and the same axis."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.identify import _moved_mass, drive
from macromicro.identify.axis_fit import DriveFit
from macromicro.identify.notices import SaturationWarning
from macromicro.identify.runs import Run
from macromicro.models.mass import Axis, simulate

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
    made = _moved_mass.means(Run(np.arange(n) * DT, u, v), many)
    assert len(made.t) == 40 and made.dt == pytest.approx(many * DT)
    speeds, force = made.x, made.u  # what is averaged as positions are speeds here
    np.testing.assert_allclose(np.diff(speeds), force[:-1] * made.dt, atol=1e-12)


def test_short_records_stay_as_they_are() -> None:
    run = record(20_000)
    assert not _moved_mass.is_long([run]) and _moved_mass.shorten([run], AXIS) == [run]


def test_blocks_are_short_against_the_time_constant(monkeypatch: pytest.MonkeyPatch) -> None:
    """470 samples, of which 30 remain; what is still too long is represented by its parts."""
    run = record(30_000)
    monkeypatch.setattr(_moved_mass, "LONG", 10_000)
    (made,) = _moved_mass.shorten([run], AXIS)
    assert len(made.t) == 10_000 and made.dt == pytest.approx(3.0 * DT)
    monkeypatch.setattr(_moved_mass, "LONG", 1000)
    parts = _moved_mass.shorten([run], AXIS)
    assert [len(part.t) for part in parts] == [250] * 4
    assert parts[0].dt == pytest.approx(15.0 * DT)
    assert parts[-1].t[-1] == pytest.approx(run.t[-1], abs=15.0 * DT)


def test_stretches_are_spread_over_the_records_by_their_lengths() -> None:
    made = _moved_mass.stretches([record(3000), record(1000, 3)], 4, 500)
    assert [len(part.t) for part in made] == [500] * 4
    assert [round(part.t[0] / DT) for part in made] == [0, 1250, 2500, 0]


@pytest.fixture(scope="module")
def both() -> tuple[Run, DriveFit, DriveFit]:
    run = record(20_000)
    with pytest.MonkeyPatch.context() as patch:
        plain = drive(*run, structure="coulomb")
        patch.setattr(_moved_mass, "LONG", 7500)
        return run, plain, drive(*run, structure="coulomb")


def test_the_same_axis_is_found(both: tuple[Run, DriveFit, DriveFit]) -> None:
    _, plain, short = both
    for one, other in ((plain.refined, short.refined), (plain.inverse, short.inverse)):
        assert (np.abs(one.values - other.values) < 2.0 * np.maximum(one.std, other.std)).all()
        assert (other.std < 3.0 * one.std).all() and (one.std < 3.0 * other.std).all()


def test_the_free_run_is_of_what_was_measured(both: tuple[Run, DriveFit, DriveFit]) -> None:
    run, plain, short = both
    assert [len(x) for x in short.free_run] == [len(run.x)]
    np.testing.assert_allclose(run.x - short.free_run[0], short.residuals[0], atol=1e-15)
    assert short.rms == pytest.approx(float(np.sqrt(np.mean(short.residuals[0] ** 2))))
    assert short.rms < 2.0 * plain.rms
    assert short.fit == pytest.approx(100.0 - 100.0 * short.rms / float(np.std(run.x)))


def test_a_late_and_limited_input_is_so_before_it_is_averaged(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    run = record(20_000)
    acts = np.clip(run.u, -65.0, 65.0)
    later = run._replace(u=np.roll(run.u, -7), x=simulate(AXIS, acts, DT))
    monkeypatch.setattr(_moved_mass, "LONG", 7500)
    with pytest.warns(SaturationWarning):
        found = drive(*later, structure="coulomb", delay=7, limit=65.0)
    assert found.refined.axis.mass == pytest.approx(95.0, rel=1e-3)
    assert found.fit > 99.9
