"""What `drive` accepts, how it parts its records, and what its result tells."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.identify import Axis, Filtering, drive, simulate
from macromicro.identify._axis_hints import part
from macromicro.identify.axis_fit import Driven, _check, is_surer, rows_of, runs_of, split, start
from macromicro.identify.axis_inverse import Estimate, Rows, differences
from macromicro.identify.runs import Run
from macromicro.models.mass import late

DT = 1e-3
T = np.arange(1200) * DT
U = np.sign(np.sin(40.0 * T) + 0.3) * 20.0
RUN = Run(T, U, np.cumsum(np.sin(5.0 * T)) * DT)
USUAL = Filtering()


def run(n: int) -> Run:
    return Run(T[:n], U[:n], RUN.x[:n])


def test_an_input_acts_late_by_samples_and_rests_at_its_first_value() -> None:
    u = np.array([3.0, 1.0, 4.0, 1.0])
    assert late(u, 0).tolist() == [3.0, 1.0, 4.0, 1.0]
    assert late(u, 1).tolist() == [3.0, 3.0, 1.0, 4.0]
    assert late(u, 3).tolist() == [3.0, 3.0, 3.0, 3.0]


@pytest.mark.parametrize(
    "options",
    [
        {"delay": 0}, {"delay": 1000}, {"delay": np.int64(3)},
        {"gain": -1.0}, {"structure": "auto"}, {"structure": "full"},
    ],
)  # fmt: skip
def test_what_is_at_the_edge_is_accepted(options: dict[str, Any]) -> None:
    _check(**{"gain": 1.0, "structure": "auto", "delay": 0, **options})


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"delay": -1}, "0 to 1000"),
        ({"delay": 1001}, "0 to 1000"),
        ({"delay": 1.0}, "0 to 1000"),
        ({"gain": float("nan")}, "other than zero"),
        ({"gain": float("inf")}, "other than zero"),
        ({"gain": 0.0}, "other than zero"),
        ({"structure": "rusty"}, "auto, viscous"),
    ],
)
def test_what_is_beyond_is_refused(options: dict[str, Any], match: str) -> None:
    with pytest.raises(InputError, match=match):
        _check(**{"gain": 1.0, "structure": "auto", "delay": 0, **options})


def test_one_record_or_lists_of_records() -> None:
    assert len(runs_of(T, U, RUN.x)) == 1
    assert [len(r.t) for r in runs_of([T, T[:400]], [U, U[:400]], [RUN.x, RUN.x[:400]])] == [
        1200,
        400,
    ]
    assert len(runs_of(T[:200], U[:200], RUN.x[:200])[0].t) == 200
    with pytest.raises(InputError, match="200 samples or more"):
        runs_of(T[:199], U[:199], RUN.x[:199])
    with pytest.raises(InputError, match=r"record\[1\].*200 samples or more"):
        runs_of([T, T[:199]], [U, U[:199]], [RUN.x, RUN.x[:199]])
    with pytest.raises(InputError, match="t, u and x hold 2, 1 and 2 arrays"):
        runs_of([T, T], [U], [T, T])
    with pytest.raises(InputError, match="x: the array is missing"):
        runs_of(T, U, [])


def rows(runs: list[Run], filtering: Filtering = USUAL, **options: Any) -> list[Rows]:
    return rows_of(runs, Driven(filtering=filtering, **options))


def test_the_force_is_the_gain_times_what_actslate() -> None:
    (found,) = rows([RUN], gain=3.0, delay=2)
    np.testing.assert_array_equal(found.force, 3.0 * late(U, 2))


@pytest.mark.parametrize(
    ("n", "count", "factor"),
    [
        (1200, 1, 10),  # a thirtieth of what is held out would be 12
        (800, 1, 8),
        (240, 3, 8),  # of three records a whole one is held out
        (240, 2, 2),
    ],
)
def test_decimation_leaves_thirty_samples_to_judge_by(n: int, count: int, factor: int) -> None:
    assert {r.factor for r in rows([run(n)] * count)} == {factor}


@pytest.mark.parametrize(("decimate", "fine"), [(1, True), (8, True), (0, False), (9, False),
                                                (2.0, False)])  # fmt: skip
def test_decimation_can_be_told(decimate: Any, fine: bool) -> None:
    filtering = Filtering(decimate=decimate)
    if fine:
        assert rows([run(800)], filtering)[0].factor == decimate
    else:
        with pytest.raises(InputError, match=r"decimate: .*a whole number from 1 to 8"):
            rows([run(800)], filtering)


def test_the_low_pass_is_at_eighty_hertz_for_milliseconds_or_as_told() -> None:
    for cutoff, corner in ((None, 80.0), (0.5, 0.5), (499.0, 499.0)):
        (found,) = rows([RUN], Filtering(cutoff=cutoff))
        np.testing.assert_array_equal(found.v, differences(RUN, U, corner, 10).v)
    for cutoff in (0.0, -1.0, 500.0):
        with pytest.raises(InputError, match="between 0 and 500 Hz"):
            rows([RUN], Filtering(cutoff=cutoff))


def test_an_input_that_never_changes_is_refused_over_all_records() -> None:
    def held(volts: float) -> Run:
        return Run(T, np.full(1200, volts), RUN.x)

    for same in ([held(2.0)], [held(2.0)] * 2):
        with pytest.raises(InputError, match="constant at 2"):
            rows(same)
    assert len(rows([held(2.0), held(3.0)])) == len(rows([held(2.0), RUN])) == 2
    with pytest.raises(InputError, match=r"record\[1\]\.x: the position is constant at 0"):
        rows([RUN, Run(T, U, np.zeros(1200))])


def numbered(n: int) -> Rows:
    k = np.arange(float(n))
    return Rows(Run(k, k + 0.1, k + 0.2), k + 0.3, k + 0.4, k + 0.5, k > 1.0, 7)


def test_one_or_two_records_are_judged_by_their_tails() -> None:
    train, test = split([run(10), run(20)])
    assert [len(r.x) for r in train] == [7, 14] and [len(r.x) for r in test] == [3, 6]
    for k in range(3):
        np.testing.assert_array_equal(np.concatenate([train[1][k], test[1][k]]), run(20)[k])


def test_of_three_records_or_more_every_third_judges() -> None:
    train, test = split([run(n) for n in range(10, 17)])
    assert [len(r.x) for r in train] == [10, 11, 13, 14, 16]
    assert [len(r.x) for r in test] == [12, 15]


def test_a_part_of_a_record_keeps_all_its_columns() -> None:
    made = part(numbered(10), slice(4, 6))
    assert made.run.t.tolist() == [4.0, 5.0] and made.run.x.tolist() == [4.2, 5.2]
    assert made.force.tolist() == [4.3, 5.3] and made.a.tolist() == [4.5, 5.5]
    assert made.still.all() and made.factor == 7


def test_a_fit_tells_its_free_run_and_its_errors() -> None:
    """Over whole records, from where and how fast they begin; the rest is judged by itself."""
    truth = Axis(2.0, 3.0, 1.5, 0.4)
    t = np.arange(3000) * 2e-3
    u = 9.0 * np.sin(3.0 * t) + 3.0 * np.sin(11.0 * t)
    noise = 1e-4 * np.random.default_rng(1).normal(size=3000)
    x = simulate(truth, 2.0 * late(u, 3), 2e-3) + noise
    found = drive(t, u, x, gain=2.0, structure="coulomb", delay=3)
    np.testing.assert_allclose(found.axis[:4], truth[:4], rtol=0.02)
    assert (found.gain, found.delay, found.structure, found.holdout) == (2.0, 3, "coulomb", {})
    begun = found.starts[0]
    np.testing.assert_allclose(found.free_run[0], found.simulate(u, 2e-3, *begun), atol=1e-12)
    np.testing.assert_allclose(found.residuals[0], x - found.free_run[0], atol=1e-12)
    assert found.rms == pytest.approx(np.sqrt(np.mean(found.residuals[0] ** 2)))
    assert found.fit == pytest.approx(100.0 * (1.0 - found.rms / np.std(x)))
    # Of noise alone, what was not fitted is missed by hardly more.
    assert found.holdout_rms == pytest.approx(1e-4, rel=0.2)


def test_a_record_begins_at_rest_below_2_percent_of_its_top_speed() -> None:
    t = np.arange(2000) * DT

    def begun(slow: float) -> tuple[float, float]:
        v = np.where(t < 1.0, slow, 1.0)
        return start(Run(t, U[0] + 0.0 * t, 0.3 + np.cumsum(v) * DT), 1.0, 0)

    assert begun(0.03) == (pytest.approx(0.30003), pytest.approx(0.03, abs=1e-3))
    assert begun(0.01) == (pytest.approx(0.30001), 0.0)


@pytest.mark.slow
def test_a_delay_is_found_in_records_of_two_sample_times() -> None:
    """150 ms, of records at 1 and 4 ms: in seconds, not in samples of one of them."""
    truth, records = Axis(4.0, 25.0, 12.0, 2.0), []
    for step, seed in ((1e-3, 1), (4e-3, 2)):
        t = np.arange(round(8.0 / step)) * step
        u = np.repeat(np.random.default_rng(seed).uniform(-60.0, 60.0, 27), round(0.3 / step))
        u = u[: len(t)]
        records.append((t, u, simulate(truth._replace(lag=0.15), u, step)))
    t, u, x = (list(column) for column in zip(*records, strict=True))
    found = drive(t, u, x, structure="coulomb", delay="fit")
    assert found.axis.lag == pytest.approx(0.15, abs=1e-5)
    np.testing.assert_allclose(found.axis[:4], truth[:4], rtol=1e-3)


def test_what_the_last_part_alone_shows_is_fitted_too() -> None:
    """Reverse motion in the last tenth: other blocks are held out then."""
    u = np.repeat(np.random.default_rng(0).uniform(30.0, 150.0, 16), 400)
    u[-800:] *= -1.0
    truth = Axis(mass=20.0, viscous=200.0, coulomb=20.0)
    x = simulate(truth, u, DT)
    found = drive(np.arange(len(u)) * DT, u, x, structure="coulomb")
    assert found.holdout_rms < 1e-4


@pytest.mark.parametrize(
    ("inverse", "refined", "surer"),
    [
        ([1.0, 1.0], [2.0, 2.0], True),
        ([1.0, 4.0], [2.0, 3.0], True),
        ([1.0, 8.0], [2.0, 3.0], False),
        ([1.0, np.nan], [2.0, 3.0], True),
        ([np.nan, np.nan], [2.0, 3.0], False),
    ],
)
def test_the_surer_method_has_the_smaller_errors_on_average(
    inverse: list[float], refined: list[float], surer: bool
) -> None:
    """By the mean ratio of their logarithms, over parameters that both know."""
    names, axis = ("mass", "viscous"), Axis(4.0, 25.0)
    one, other = (
        Estimate(axis, names, np.diag(np.square(std)), 0.1, 1.0) for std in (inverse, refined)
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert is_surer(one, other) is surer
        negative = replace(one, axis=axis._replace(mass=-1.0))
        assert not is_surer(negative, other)
