"""When the force of a drive acts: section "A drive" of docs/identify.md."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from tests.identify.late_records import AXIS, DT, record, rows, steps

from macromicro.errors import InputError
from macromicro.identify import _axis_delay, drive
from macromicro.identify.axis import late, simulate
from macromicro.identify.driven import FIT
from macromicro.identify.notices import DataWarning


@pytest.mark.parametrize("samples", [0, 1, 3, 7, 12, 17, 58, 700])
def test_the_delay_of_the_force_is_found(samples: int) -> None:
    u = steps(1)
    assert abs(_axis_delay.delay(rows(u, late(u, samples))) - samples) <= samples // 200


def test_a_shifted_force_keeps_its_ends() -> None:
    force = np.arange(5.0)
    np.testing.assert_array_equal(_axis_delay.shifted(force, 2), [0.0, 0.0, 0.0, 1.0, 2.0])
    np.testing.assert_array_equal(_axis_delay.shifted(force, -2), [2.0, 3.0, 4.0, 4.0, 4.0])
    np.testing.assert_array_equal(_axis_delay.shifted(force, 0), force)
    np.testing.assert_array_equal(_axis_delay.shifted(force, -9), np.full(5, 4.0))


@pytest.mark.parametrize("samples", [0.0, 6.6])
def test_its_error_holds(samples: float) -> None:
    """Of 30 records: 68 and 95 % intervals hold the delay in 16 to 25 and in 26 to 30."""
    off = np.empty(30)
    for seed in range(30):
        u = steps(seed + 40, 4000)
        made = rows(u, late(u, samples), seed)
        found, error = _axis_delay.exact(made, _axis_delay.delay(made))
        assert found >= 0.0
        off[seed] = (found - samples) / error
    assert 16 <= np.sum(np.abs(off) < 1.0) <= 25
    assert np.sum(np.abs(off) < 1.96) >= 26


def test_drive_says_it_unless_the_delay_is_to_be_found() -> None:
    u = steps(8)
    t, said, x = record(u, late(u, 15.4))
    with pytest.warns(DataWarning, match="later than u"):
        wrong = drive(t, said, x, structure="coulomb")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = drive(t, said, x, structure="coulomb", delay=FIT)
    at = found.refined.names.index("lag")
    assert found.delay + found.axis.lag / DT == pytest.approx(15.4, abs=0.3)
    assert at == 4 and 0.0 < found.refined.std[at] < 2e-4
    for estimate in (found.refined, found.inverse):  # the latter by the delay found, too
        missed = np.array([estimate.axis.mass - 4.0, estimate.axis.coulomb - 12.0])
        own = [estimate.names.index(n) for n in ("mass", "coulomb")]
        np.testing.assert_array_less(np.abs(missed), 4.0 * estimate.std[own])
    assert abs(wrong.inverse.axis.mass - 4.0) + abs(wrong.axis.mass - 4.0) > 0.1


def test_under_noise_of_the_position_alone_the_free_run_tells_it() -> None:
    u = steps(11)
    random = np.random.default_rng(0)
    x = simulate(AXIS, late(u, 7.3), DT) + 1e-6 * random.standard_normal(len(u))
    found = drive(np.arange(len(u)) * DT, u, x, structure="coulomb", delay=FIT)
    assert found.delay + found.axis.lag / DT == pytest.approx(7.3, abs=1e-3)
    assert found.refined.std[-1] < 1e-6
    assert found.axis.mass == pytest.approx(4.0, abs=1e-4)


def test_errors_grow_by_what_the_delay_leaves_open() -> None:
    u = steps(12)
    made = rows(u, late(u, 2.0))
    asked: list[float] = []

    def fit(pushed: list[_axis_delay.Rows]) -> _axis_delay.Estimate:
        asked.append(float(pushed[0].force.sum()))
        number = float(len(asked))
        axis = AXIS._replace(mass=4.0 + number, coulomb=number)
        return _axis_delay.Estimate(axis, ("mass", "coulomb"), np.diag([9.0, 16.0]), 0.0, 0.0)

    found = _axis_delay.under(fit, made, 2e-3, 5e-4)
    np.testing.assert_allclose(found.covariance, [[10.0, 1.0], [1.0, 17.0]])
    assert asked == [float(late(u, samples).sum()) for samples in (2.0, 2.5)]
    assert found.axis.mass == 5.0 and found.draws is None and not found.sensed


@pytest.mark.parametrize("delay", [-1, 1001, "all", 0.5])
def test_what_is_no_delay_is_refused(delay: object) -> None:
    u = steps(10, 2000)
    with pytest.raises(InputError, match=r"delay: .* from 0 to 1000, or \"fit\""):
        drive(*record(u, u), delay=delay)  # type: ignore[arg-type]
