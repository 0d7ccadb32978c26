"""Records checked, averaged and filtered: each rule at its edge."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.identify.notices import SaturationWarning
from macromicro.identify.records import (
    average_runs,
    differentiated,
    flag_saturation,
    integrated,
    lowpassed,
    records,
    signal,
)

N = np.random.default_rng(2).normal(size=200)


def test_a_signal_names_its_first_bad_row() -> None:
    with pytest.raises(InputError, match=r"row 3 is nan \(rows that are not finite: 2\)"):
        signal([1.0, 2.0, 3.0, np.nan, np.inf], "x")
    with pytest.raises(InputError, match=r"shape is \(1, 2\)"):
        signal([[1.0, 2.0]], "x")
    with pytest.raises(InputError, match="str"):
        signal("abc", "x")


@pytest.mark.parametrize("cutoff", [0.02, 0.5, 20.0])
def test_a_low_pass_halves_the_power_at_its_cut_off(cutoff: float) -> None:
    """Both signals alike; a Butterworth of the second order by default."""
    dt = 0.1 / cutoff
    x = np.r_[1.0, np.zeros(4000)]
    for order in (2, 4):
        u, y = lowpassed(x, 3.0 * x, dt, cutoff, order)
        spectrum = np.abs(np.exp(-2j * np.pi * cutoff * dt * np.arange(4001)) @ u)
        assert spectrum == pytest.approx(np.sqrt(0.5), rel=1e-6)
        np.testing.assert_allclose(y, 3.0 * u, atol=1e-12)
        high = np.abs(np.exp(-2j * np.pi * 3.0 * cutoff * dt * np.arange(4001)) @ u)
        turned = np.tan(np.pi * 0.3) / np.tan(np.pi * 0.1)
        assert high == pytest.approx(1.0 / np.sqrt(1.0 + turned ** (2 * order)), rel=1e-6)
    np.testing.assert_allclose(
        lowpassed(x, x, dt, cutoff)[0], lowpassed(x, x, dt, cutoff, 2)[0], atol=1e-12
    )


@pytest.mark.parametrize("cutoff", [0.0, -1.0, 5.0, 6.0])
def test_a_cut_off_lies_below_half_the_sampling_frequency(cutoff: float) -> None:
    with pytest.raises(InputError, match="between 0 and 5 Hz"):
        lowpassed(N, N, 0.1, cutoff)


def test_speeds_are_differences_and_integration_takes_them_back() -> None:
    x = np.r_[0.0, np.cumsum(N)] * 0.1
    u, y = differentiated(np.r_[N, 9.0], x, 0.1)
    np.testing.assert_allclose(y, N)
    np.testing.assert_array_equal(u, N)
    np.testing.assert_allclose(integrated(u, y, 0.1)[1], x[1:])
    np.testing.assert_allclose(integrated(u, y, 0.1)[0], np.cumsum(N) * 0.1)
    for bad in ((N, N[:-1], 0.1), ([1.0], [1.0], 0.1), (N, N, 0.0)):
        with pytest.raises(InputError, match="dt above 0"):
            differentiated(*bad)
    assert len(differentiated([1.0, 1.0], [0.0, 2.0], 0.5)[1]) == 1


def test_runs_are_mirrored_counted_from_their_begin_cut_and_averaged() -> None:
    forth = ([1.0, 1.0, 1.0], [5.0, 6.0, 9.0])
    back = ([-1.0, -2.0, -1.0, -1.0], [7.0, 5.0, 4.0, 0.0])
    u, x = average_runs([forth, back])
    np.testing.assert_allclose(u, [1.0, 1.5, 1.0])
    np.testing.assert_allclose(x, [0.0, 1.5, 3.5])
    for bad in ([], [([1.0], [1.0])], [([1.0, 2.0], [1.0])]):
        with pytest.raises(InputError, match="runs"):
            average_runs(bad)


@pytest.mark.parametrize(("weights", "good"), [([0.0] * 20, False), ([-1.0] + [1.0] * 19, False),
                                                ([0.0] * 19 + [1.0], True)])  # fmt: skip
def test_weights_are_zero_or_more_and_not_all_zero(weights: list[float], good: bool) -> None:
    if good:
        assert records(N[:20], N[:20], weights, 10)[0].w.tolist() == weights
    else:
        with pytest.raises(InputError, match="weights"):
            records(N[:20], N[:20], weights, 10)


def test_records_are_as_many_and_as_long_as_each_other() -> None:
    assert len(records([N, N], [N, N], None, 200)) == 2
    assert records(list(N), N, None, 200)[0].w.tolist() == [1.0] * 200
    for bad in (([N, N], [N]), ([], [])):
        with pytest.raises(InputError, match="as many of each"):
            records(*bad, None, 10)
    with pytest.raises(InputError, match=r"record\[1\].*one length"):
        records([N, N], [N, N[:-1]], None, 10)
    with pytest.raises(InputError, match=r"^record: .*200 samples given.* 201 or more"):
        records(N, N, None, 201)
    with pytest.raises(InputError, match="zero throughout"):
        records([np.zeros(20)] * 2, [N[:20]] * 2, None, 10)
    records([np.zeros(20), np.ones(20)], [N[:20]] * 2, None, 10)  # one of them moves it


@pytest.mark.parametrize(("held", "said"), [(2, False), (3, False), (5, True)])
def test_an_input_that_stays_at_its_extreme_is_taken_for_saturated(held: int, said: bool) -> None:
    """For three samples in a row, three times or more and 1 % of the record."""
    u = 0.5 * np.tanh(N)
    u[50 : 50 + held] = 0.9
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        np.testing.assert_array_equal(flag_saturation(u, "u"), u)
    assert [w.category for w in told] == [SaturationWarning] * said
    assert not said or "(0.9) for 5 of 200 samples" in str(told[0].message)


def test_steps_are_not_saturated() -> None:
    """They do not change from sample to sample elsewhere either."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        flag_saturation(np.repeat([0.0, 1.0, 0.5, 1.0], 50), "u")
        flag_saturation(np.zeros(50), "u")
        flag_saturation(N, "u", limit=float(np.abs(N).max()))


def test_beyond_a_limit_the_input_is_clipped() -> None:
    over = int((np.abs(N) > 1.0).sum())
    with pytest.warns(SaturationWarning, match=f"{over} of 200 samples beyond the limit of 1"):
        np.testing.assert_array_equal(flag_saturation(N, "u", 1.0), np.clip(N, -1.0, 1.0))


@pytest.mark.parametrize(("n", "flat", "said"), [(200, 4, False), (200, 5, True),
                                                 (1000, 11, False), (1000, 12, True)])  # fmt: skip
def test_a_flat_top_is_of_three_samples_with_neighbours_or_of_a_percent(
    n: int, flat: int, said: bool
) -> None:
    """In a signal that moves in every other sample; neighbours on both sides stand for one."""
    u = np.linspace(0.1, 1.0, n)
    u[40 : 40 + flat] = 2.0
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        flag_saturation(u, "u")
    assert [w.category for w in told] == [SaturationWarning] * said
