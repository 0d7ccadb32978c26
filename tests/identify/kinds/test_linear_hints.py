"""What else a linear record asks for: the hints of `identify linear`."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest
from scipy.signal import lfilter

from macromicro.arrays import Array
from macromicro.identify.kinds import linear
from macromicro.identify.kinds.linear import Asked, Hint, constant, hints

DT = 1e-3


def inputs(seed: int, n: int = 3000) -> Array:
    random = np.random.default_rng(seed)
    return np.repeat(random.uniform(-2.0, 2.0, n // 100), 100)


def answered(u: Array, seed: int = 0, noise: float = 20.0) -> Array:
    """(4.3), with noise of the output."""
    y = lfilter([0.0, 165.72], [1.0, -0.95833], u)
    return np.asarray(y + noise * np.random.default_rng(seed).standard_normal(len(u)))


def asked(u: Array, y: Array) -> Asked:
    return Asked([u], [y], 1, 1, 1, DT)


def of(u: Array, y: Array, **changes: int) -> list[Hint]:
    return hints(asked(u, y)._replace(**changes), "V")


@pytest.mark.parametrize("seed", range(3))
def test_of_the_right_model_nothing_is_said(seed: int) -> None:
    u = inputs(seed)
    assert of(u, answered(u, seed)) == []


@pytest.mark.parametrize("samples", [0, 31])
def test_a_delay(samples: int) -> None:
    u = inputs(1)
    y = answered(np.r_[np.zeros(samples), u[: len(u) - samples]])
    first = of(u, y, delay=9)[0]
    assert first.words == f"a delay of {samples + 1} (--order 1,1,{samples + 1})"
    assert 0.3 < first.lowered < 1.0


def test_a_higher_order() -> None:
    u = inputs(2)
    y = lfilter([0.0, 2.0, 1.9], [1.0, -1.95, 0.96], u) * 10.0
    y = y + 2.0 * np.random.default_rng(0).standard_normal(len(u))
    assert of(u, y)[0].words == "an order of 2 (--order 2,2,1)"


def test_a_dead_zone_and_a_limit_are_found_to_a_twentieth_of_the_input() -> None:
    u = inputs(3)
    dead = of(u, answered(np.sign(u) * np.maximum(np.abs(u) - 0.5, 0.0)))[0].words
    found = re.fullmatch(r"a dead zone of ([\d.]+) V \(--width ([\d.]+)\)", dead)
    assert found is not None and found[1] == found[2]
    assert float(found[1]) == pytest.approx(0.5, abs=0.11)
    cut = of(u, answered(np.clip(u, -1.2, 1.2)))[0].words
    limit = re.fullmatch(r"an input that acts up to ([\d.]+) V only", cut)
    assert limit is not None and float(limit[1]) == pytest.approx(1.2, abs=0.11)


@pytest.mark.slow
def test_inputs_that_are_cut_to_be_tried_bring_no_warning() -> None:
    """Nor do they say that the record's own input saturates."""
    smooth = np.cumsum(inputs(3)) % 7.0 + 0.01 * np.arange(len(inputs(3)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        of(smooth, answered(smooth))


def test_a_constant_in_the_output() -> None:
    u, offset = inputs(4), -800.0
    found = constant(asked(u, answered(u) + offset))
    assert found == pytest.approx(offset, rel=0.1)
    assert constant(asked(u, answered(u))) == 0.0


def test_the_best_is_first_and_each_lowers_the_error_by_a_tenth() -> None:
    u = inputs(5)
    found = of(u, answered(np.r_[np.zeros(8), u[:-8]]))
    assert len(found) > 1
    assert [h.lowered for h in found] == sorted((h.lowered for h in found), reverse=True)
    assert all(h.lowered >= 0.1 for h in found)


def test_it_is_judged_by_the_last_part_of_each_record() -> None:
    """A fault of the first part alone, which a richer model could follow, is no reason."""
    u = inputs(6)
    y = answered(u)
    burst = y.copy()
    burst[500:520] += 3e4
    assert of(u, burst) == []
    two = Asked([u[:1500], u[1500:]], [y[:1500], answered(u[1500:])], 1, 1, 3, DT)
    assert hints(two)[0].words.startswith("a delay of 1")


def test_what_only_the_fitted_part_shows_is_not_told() -> None:
    """A delay of 5 more in the first 70 % alone: of the rest it foretells nothing."""
    u = inputs(9)
    late = answered(np.r_[np.zeros(5), u[:-5]])
    assert of(u, np.where(np.arange(len(u)) < 0.7 * len(u), late, answered(u))) == []


def test_long_records_are_looked_at_by_their_first_part(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(linear, "_MOST", 5000)
    u = inputs(7, 6000)
    late = answered(np.r_[np.zeros(8), u[:-8]])
    mixed = np.where(np.arange(len(u)) < 5000, answered(u), late)
    assert of(u, mixed) == []


def test_where_nothing_can_be_judged_nothing_is_said() -> None:
    u = np.zeros(500)
    assert of(u, answered(u)) == []
    exact = inputs(8)
    assert of(exact, answered(exact, noise=0.0)) == []
