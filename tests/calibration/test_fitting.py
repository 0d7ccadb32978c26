"""Fits of a calibration: the matrix is the kernel's table, parameters and what is left."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.calibration import fitting, iso
from macromicro.control import correction


@given(
    st.lists(st.floats(-1.0, 1.0), min_size=2, max_size=9),
    st.lists(st.floats(-0.3, 1.3), min_size=1, max_size=5),
)
def test_the_matrix_of_a_table_is_what_the_kernel_reads(
    values: list[float], places: list[float]
) -> None:
    table, x = np.array(values), np.array(places)
    found = fitting.basis(0.0, 1.0, len(table), x) @ table
    step = 1.0 / (len(table) - 1)
    wanted = [correction.curve(0.0, step, table, place)[0] for place in places]
    assert found == pytest.approx(wanted, abs=1e-12)


def data(seed: int, noise: float = 0.1e-6, drift: float = 0.0) -> fitting.Data:
    """Two runs over a screw of lead 4 mm, reversal -20 um, with a warming reference."""
    random = np.random.default_rng(seed)
    places = np.sort(random.uniform(0.0, 0.2, 40))
    x = np.concatenate([places, places[::-1]] * 3)
    flank = np.tile(np.repeat([1.0, 0.0], 40), 3)
    t = 1.0 * np.arange(len(x))
    off = 8e-6 * np.sin(2.0 * math.pi * x / 4e-3) - 20e-6 * (flank - 0.5) + 3e-4 * (x - 0.05)
    off += 10e-6 * np.sin(15.0 * x) + drift * t + noise * random.standard_normal(len(x))
    nothing = np.full(len(x), np.nan)
    return fitting.Data(0.0, 0.2, x, off, flank, t, nothing, None, (0.0, 1.0), x, x)


def test_what_a_screw_does_is_found_whatever_the_reference_drifts() -> None:
    for drift in (0.0, 5e-9):
        found = fitting.fit(data(1, drift=drift), [4e-3])
        known = {each.name: each for each in found.estimates}
        assert known["reversal"].value == pytest.approx(-20e-6, abs=0.3e-6)
        assert known["periodic error"].value == pytest.approx(8e-6, abs=0.2e-6)
        assert found.residual < 0.3e-6 and found.model.period == 4e-3
        assert found.model.time == 0.0


def test_what_repeats_does_so_along_the_drive() -> None:
    """The load lies half the backlash further on its upper flank, where the pitch error differs."""
    made = data(6)
    share = made.flank - 0.5
    off = -60e-6 * share + 30e-6 * np.sin(2.0 * math.pi * (made.x - 60e-6 * share) / 4e-3)
    noise = 0.1e-6 * np.random.default_rng(7).standard_normal(len(off))
    found = fitting.fit(made._replace(deviation=off + noise), [4e-3])
    assert found.residual < 0.15e-6
    p = found.correction
    load = correction.Load(0.1, 1.0)
    tables = correction.tables(p, load)
    for x, flank, wanted in zip(made.x, made.flank, off, strict=True):
        value, *_ = correction.deviation(tables, x, flank, 0.0)
        assert value == pytest.approx(wanted, abs=0.2e-6)


def test_readings_scatter_more_than_a_fit_of_few_leaves() -> None:
    """What is left at positions of the fit is less than at others, by its degrees of freedom."""
    made = data(8, noise=1e-6)
    few = np.arange(0, len(made.x), 20)
    small = made._replace(**{name: getattr(made, name)[few] for name in _COLUMNS})
    found = fitting.fit(small, [4e-3])
    assert np.std(found.scatter) > 1.1 * np.std(found.left)


_COLUMNS = ("x", "deviation", "flank", "t", "temperature", "target", "on_drive")


@pytest.mark.parametrize("constant", [40.0, 150.0])
def test_a_growth_since_the_start_is_found_without_a_temperature(constant: float) -> None:
    made = data(5, drift=5e-9)
    grown = 5e-5 * (1.0 - np.exp(-made.t / constant)) * made.x
    found = fitting.fit(made._replace(deviation=made.deviation + grown), [4e-3])
    known = {each.name: each for each in found.estimates}["growth after the start"]
    assert abs(known.value - 5e-5) < known.half < 2e-5
    assert found.model.time == pytest.approx(constant, rel=0.3)
    assert found.correction.warm_until == made.t[-1] and found.residual < 0.3e-6


@pytest.mark.parametrize("seed", [0, 6, 16])
def test_a_reference_that_drifts_is_no_growth(seed: int) -> None:
    made, random = data(200 + seed), np.random.default_rng(seed)
    drift = 3.0 * 0.2e-6 * np.cumsum(random.standard_normal(len(made.t))) / math.sqrt(60.0)
    found = fitting.fit(made._replace(deviation=made.deviation + drift), [4e-3])
    assert found.model.time == 0.0 and found.correction.warm_up == 0.0


def test_a_period_that_nobody_names_is_found() -> None:
    found = fitting.fit(data(2), [])
    assert found.model.period == pytest.approx(4e-3, rel=2e-3)


def test_noise_alone_gives_the_smallest_table() -> None:
    made = data(3)
    random = np.random.default_rng(4)
    made = made._replace(deviation=1e-6 * random.standard_normal(len(made.x)))
    found = fitting.fit(made, [4e-3])
    assert found.model.size <= 3 and found.model.gap <= 1


def test_intervals_hold() -> None:
    held = 0
    for seed in range(40):
        fit = fitting.fit(data(100 + seed, noise=1e-6), [4e-3])
        each = next(e for e in fit.estimates if e.name == "periodic error")
        held += abs(each.value - 8e-6) <= each.half
    assert held >= 33


def test_figures_of_the_standard_by_hand() -> None:
    target = np.repeat([0.0, 1.0], 6)
    direction = np.tile(np.repeat([1.0, -1.0], 3), 2)
    deviation = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, -1.0, 0.0, 1.0, 2.0, 2.0, 2.0])
    found = iso.figures(iso.means(target, direction, deviation))
    # Means: 2 and 0 from below with s = 1, 5 (s = 1) and 2 (s = 0) from above.
    assert (found.B, found.B_mean) == (3.0, -2.5)
    assert (found.E, found.M) == (5.0, 2.5)
    assert (found.A_up, found.A_down) == (6.0, 5.0)
    assert found.A == 7.0 - -2.0
    assert (found.R_up, found.R_down, found.R) == (4.0, 4.0, 7.0)
