"""Weights from a recording: the operator that made it is found again."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.hysteresis.prandtl import operator, relaxed, run
from macromicro.hysteresis.prandtl_fit import fit, moved, spaced

PATH = np.concatenate(
    [
        np.linspace(a, b, 120)[1:]
        for a, b in [(0, 100), (100, 0), (0, 100), (100, 20), (20, 80), (80, 5), (5, 95), (95, 40)]
    ]
)
TRUE = operator(spaced(PATH, 6), [0.6, 0.2, 0.1, 0.0, 0.05, 0.05], offset=-7.0)


def test_the_operator_that_made_the_recording_is_found() -> None:
    """Whatever past it had before: only what does not depend on it is fitted to."""
    start = relaxed(TRUE, 0.0)._replace(y=np.array([0.0, 3.0, -4.0, 9.0, 7.0, -8.0]))
    found = fit(PATH, run(TRUE, PATH, start), plays=6)
    assert found.operator.weights == pytest.approx(TRUE.weights, abs=1e-9)
    assert found.operator.thresholds == pytest.approx(TRUE.thresholds)
    assert found.operator.offset == pytest.approx(-7.0, abs=1e-8)
    assert found.operator.widening == 0.0
    assert found.rms < 1e-9
    assert found.held_rms < 1e-9
    assert found.outputs[found.known :] == pytest.approx(
        run(TRUE, PATH, start)[found.known :], abs=1e-8
    )


def test_only_what_follows_both_ends_counts_and_the_end_is_held_out() -> None:
    found = fit(PATH, run(TRUE, PATH), plays=6, held_out=0.25)
    assert 0.9 * 100.0 < PATH[found.known] <= 100.0
    assert found.known < 119
    assert len(PATH) - found.fitted == pytest.approx(0.25 * (len(PATH) - found.known), abs=1)
    everything = fit(PATH, run(TRUE, PATH), plays=6, held_out=0.0)
    assert everything.fitted == len(PATH)
    assert math.isnan(everything.held_rms)


def test_the_end_that_is_met_last_counts() -> None:
    """A record that begins at the top is known once it has been at the bottom."""
    down = 100.0 - PATH
    found = fit(down, run(TRUE, down), plays=6)
    assert down[found.known] == pytest.approx(0.0, abs=100.0 / 20.0)
    assert 100 < found.known < 119
    assert found.operator.weights == pytest.approx(TRUE.weights, abs=1e-9)


def test_as_many_samples_as_twice_the_plays_are_needed() -> None:
    """From 5 V below the top on, 10 samples are left to fit: enough for 5 plays, not for 6."""
    u = np.r_[np.linspace(0.0, 100.0, 50), np.linspace(100.0, 0.0, 12)[1:]]
    found = fit(u, u, plays=5)
    assert (found.known, found.fitted) == (47, 57)
    with pytest.raises(InputError, match=r"only 10 samples .*12 samples or more"):
        fit(u, u, plays=6)


def test_residuals_are_those_of_their_own_parts() -> None:
    """Noise on the held-out part alone shows there alone."""
    f = run(TRUE, PATH)
    whole = fit(PATH, f, plays=6)
    noise = 0.5 * np.random.default_rng(1).standard_normal(len(PATH))
    noise[: whole.fitted] = 0.0
    found = fit(PATH, f + noise, plays=6)
    assert found.rms < 1e-9
    assert found.held_rms == pytest.approx(np.sqrt(np.mean(noise[whole.fitted :] ** 2)), rel=1e-6)


def test_no_weight_falls_below_zero() -> None:
    """A curve that stiffens has weights of both signs; the fit keeps to those that dissipate."""
    found = fit(PATH, 0.01 * PATH * PATH, plays=8)
    assert np.all(found.operator.weights >= 0.0)
    assert found.rms > 1.0


def test_plays_along_an_input_equal_the_operator() -> None:
    y = moved(PATH, TRUE.thresholds)
    start = relaxed(TRUE, float(PATH[0]))
    assert TRUE.offset + y @ TRUE.weights == pytest.approx(run(TRUE, PATH, start), abs=1e-12)


def test_thresholds_stay_below_half_the_range() -> None:
    assert spaced([-20.0, 120.0], 7).tolist() == [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0]


@pytest.mark.parametrize(
    ("u", "f", "options", "named"),
    [
        ([1.0] * 9, range(9), {}, "constant at 1"),
        ([1.0, math.nan, 2.0, 3.0], range(4), {}, "NaN"),
        (range(5), range(6), {}, "equally long"),
        (range(3), range(3), {}, "4 numbers or more"),
        (range(900), range(900), {}, "both ends"),
        (PATH, -PATH, {}, "rise together"),
        (PATH, PATH, {"plays": 1}, "2 to 200"),
        (PATH, PATH, {"plays": 201}, "2 to 200"),
        (PATH, PATH, {"held_out": 0.95}, "0 to 0.9"),
    ],
)
def test_what_cannot_be_fitted_is_refused(
    u: object, f: object, options: dict[str, float], named: str
) -> None:
    with pytest.raises(InputError, match=named):
        fit(list(u), list(f), **options)  # type: ignore[call-overload, arg-type]
