"""Inverse dynamics: derivatives, regressors, what is left out, and plain least squares."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.identify.axis_inverse import (
    STRUCTURES,
    Estimate,
    Rows,
    _decimate,
    _standing,
    columns,
    differences,
    fit_structure,
    linear,
    means,
    parameters,
    plausible,
    stack,
    subtract_bias,
)
from macromicro.identify.runs import Run
from macromicro.models.mass import Axis, late, simulate

DT = 1e-3
T = np.arange(6000) * DT
# Two sines, so that the axis is fast and slow both ways.
X = 0.3 * np.sin(3.0 * T) + 0.02 * np.sin(11.0 * T)
V = 0.9 * np.cos(3.0 * T) + 0.22 * np.cos(11.0 * T)
A = -2.7 * np.sin(3.0 * T) - 2.42 * np.sin(11.0 * T)
TRUTH = Axis(2.0, 3.0, 1.5, 0.4, 0.3, 0.8, 0.15)
FORCE = (
    2.0 * A + 3.0 * V + 0.3 * np.abs(V) + 0.4
    + np.sign(V) * (1.5 + 0.8 * np.exp(-((V / 0.15) ** 2)))
)  # fmt: skip


def held(force: np.ndarray) -> np.ndarray:
    """What is held from each sample to the next, so that it acts at its middle."""
    return np.interp(T + 0.5 * DT, T, force)


def rows(factor: int = 1, force: np.ndarray = FORCE, part: slice = slice(None)) -> Rows:
    run = Run(T[part], held(force)[part], X[part])
    still = np.abs(V[part]) < 0.01 * np.abs(V).max()
    return Rows(run, held(force)[part], V[part], A[part], still, factor)


def test_speed_and_acceleration_are_central_differences_behind_a_low_pass() -> None:
    """Far below its cut-off, far from the ends; the axis stands below 1 % of its top speed."""
    found = differences(Run(T, FORCE, X), FORCE, 80.0, 7)
    inside = slice(200, -200)
    np.testing.assert_allclose(found.v[inside], V[inside], atol=1e-4)
    np.testing.assert_allclose(found.a[inside], A[inside], atol=2e-3)
    assert found.factor == 7 and found.force is FORCE
    np.testing.assert_array_equal(found.still, np.abs(found.v) < 0.01 * np.abs(found.v).max())


def test_a_low_pass_takes_what_is_above_its_cut_off() -> None:
    """A fourth order forth and back: half of the height at the cut-off, nearly none at thrice."""
    for frequency, share in ((40.0, 0.5), (120.0, 1.0 / (1.0 + 3.0**8))):
        x = np.sin(2.0 * math.pi * frequency * T)
        v = differences(Run(T, T, x), T, 40.0, 1).v[1000:-1000]
        digital = math.tan(math.pi * frequency * DT) / math.tan(math.pi * 40.0 * DT)
        turn = 2.0 * math.pi * frequency * DT
        # a mean weighted by a triangle: sinc^2, to the fourth order of the sample time
        wanted = turn / DT * (np.sinc(0.5 * turn / math.pi) ** 2) / (1.0 + digital**8)
        assert np.abs(v).max() == pytest.approx(wanted, rel=0.01)
        assert share == pytest.approx(1.0 / (1.0 + digital**8), rel=0.5)


@pytest.mark.parametrize("structure", STRUCTURES)
def test_regressors_are_those_of_the_equation_and_the_force_comes_last(structure: str) -> None:
    names = STRUCTURES[structure]
    found = columns(rows(), names, 0.15)

    def drop(speed: float) -> np.ndarray:
        return np.asarray(np.sign(V) * np.exp(-((V / speed) ** 2)))

    moving = np.abs(V) >= 0.01 * np.abs(V).max()
    terms = {
        "mass": A, "viscous": V, "coulomb": np.sign(V), "offset": np.ones(6000),
        "asymmetry": np.abs(V), "stribeck": np.sign(V) * np.exp(-((V / 0.15) ** 2)),
        "stribeck_speed": (drop(0.15 + 1e-6) - drop(0.15 - 1e-6)) / 2e-6,
    }  # fmt: skip
    wanted = [terms[n][moving] for n in names if n in terms] + [late(held(FORCE), 0.5)[moving]]
    np.testing.assert_allclose(found, np.stack(wanted, axis=1), rtol=1e-6, atol=1e-6)


def test_an_eccentric_load_adds_its_sine_and_cosine_to_any_structure() -> None:
    force = FORCE + 2.0 * np.sin(X) - 3.0 * np.cos(X)
    hung = rows(1, force)._replace(eccentric=True)
    assert parameters([hung], "viscous") == ("mass", "viscous", "offset", "sine", "cosine")
    assert parameters([rows()], "viscous") == parameters([], "viscous") == STRUCTURES["viscous"]
    found = columns(hung, ("sine", "cosine"), 0.15)
    moving = np.abs(V) >= 0.01 * np.abs(V).max()
    np.testing.assert_allclose(found[:, :2], np.stack([np.sin(X), np.cos(X)], axis=1)[moving])


def test_gravity_on_an_eccentric_load_is_found_beside_friction() -> None:
    """Over four turns, so that a constant torque is told from it."""
    x = 40.0 * X
    v, a = 40.0 * V, 40.0 * A
    force = 0.1 * a + 0.2 * v + 1.5 * np.sign(v) + 0.4 + 2.0 * np.sin(x) - 3.0 * np.cos(x)
    run = Run(T, held(force), x)
    still = np.abs(v) < 0.01 * np.abs(v).max()
    found = fit_structure([Rows(run, held(force), v, a, still, 1, eccentric=True)], "coulomb")
    assert found.names == (*STRUCTURES["coulomb"], "sine", "cosine")
    np.testing.assert_allclose(found.values, [0.1, 0.2, 1.5, 0.4, 2.0, -3.0], rtol=0.02)


def test_decimation_keeps_what_is_slow_and_cuts_the_filters_ends() -> None:
    """Every tenth row, from the hundredth on: an FIR of 201 taps, cut off at 0.8 of the new
    Nyquist frequency."""
    for slow in (np.ones(6000), T, np.sin(3.0 * T)):
        found = _decimate(slow, 10)
        assert len(found) == 580
        np.testing.assert_allclose(found, slow[100:-100:10], atol=1e-3)
    for frequency, share in ((20.0, 1.0), (40.0, 0.5), (60.0, 0.0)):
        fast = np.sin(2.0 * math.pi * frequency * T)
        size = np.sqrt(2.0 * np.mean(_decimate(fast, 10) ** 2))
        assert size == pytest.approx(share, abs=0.02)
    assert _decimate(slow, 1) is slow


def test_a_row_stands_where_half_of_its_samples_do() -> None:
    """Of the ten to either side and its own."""
    still = np.zeros(401, bool)
    still[195:206] = True  # eleven: of row 200 all, of its neighbours fewer
    found = _standing(still, 10)
    assert len(found) == 21
    assert np.flatnonzero(found).tolist() == [10]
    still[205] = False
    assert not _standing(still, 10).any()  # ten of 21 are less than half
    assert _standing(still, 1) is still


@pytest.mark.parametrize("factor", [1, 4])
@pytest.mark.parametrize("structure", STRUCTURES)
def test_parameters_of_a_made_force_are_found_again(structure: str, factor: int) -> None:
    free = STRUCTURES[structure]
    axis = TRUTH._replace(**{n: 0.0 for n in ("coulomb", "asymmetry", "stribeck") if n not in free})
    force = (
        2.0 * A + 3.0 * V + axis.asymmetry * np.abs(V) + 0.4
        + np.sign(V) * (axis.coulomb + axis.stribeck * np.exp(-((V / 0.15) ** 2)))
    )  # fmt: skip
    parts = [rows(factor, force, slice(0, 3300)), rows(factor, force, slice(2700, None))]
    found = fit_structure(parts, structure)
    assert found.names == free
    np.testing.assert_allclose(found.values, [getattr(axis, n) for n in free], rtol=0.012)
    assert found.percent < 1.0
    if "stribeck" not in free:
        assert found.axis.stribeck_speed == pytest.approx(np.abs(V).max())
    theta = np.array([getattr(found.axis, n) for n in linear(free)])
    tables = [columns(p, linear(free), found.axis.stribeck_speed) for p in parts]
    left = np.concatenate([table[:, -1] - table[:, :-1] @ theta for table in tables])
    assert found.rms == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-9)
    kept = np.concatenate([columns(p, free, found.axis.stribeck_speed)[:, -1] for p in parts])
    assert found.percent == pytest.approx(100.0 * found.rms / np.sqrt(np.mean(kept**2)))
    std = dict(zip(found.names, found.std, strict=True))
    assert all(0.0 < s < 1.0 for s in std.values())


def estimate(**changed: float) -> Estimate:
    axis = Axis(1.0, 2.0, 0.5, -9.0, -2.0, 0.1, 1.0)._replace(**changed)
    return Estimate(axis, ("mass", "offset"), np.diag([0.04, 0.25]), 0.1, 1.0)


@pytest.mark.parametrize(
    ("changed", "good"),
    [
        ({}, True), ({"mass": 0.0}, False), ({"mass": -1.0}, False), ({"asymmetry": 2.0}, True),
        ({"asymmetry": 2.1}, False), ({"asymmetry": -2.1}, False), ({"coulomb": 0.0}, True),
        ({"coulomb": -0.1}, False), ({"stribeck": -0.1}, False), ({"stribeck": 0.0}, True),
    ],
)  # fmt: skip
def test_masses_and_frictions_below_zero_are_not_plausible(
    changed: dict[str, float], good: bool
) -> None:
    """Nor an asymmetry that makes viscous friction push."""
    assert plausible(estimate(**changed)) == good


def test_an_estimate_is_corrected_by_what_its_method_makes_of_its_own_run() -> None:
    """What comes out too large by as much is taken off, where an axis has what is left."""
    names = ("mass", "coulomb", "stribeck_speed")
    found = Estimate(TRUTH, names, np.eye(3), 0.1, 1.0)
    other = subtract_bias(found, np.array([2.1, 1.4, 0.2]))
    np.testing.assert_allclose(other.values, [1.9, 1.6, 0.1])
    assert other.axis.viscous == TRUTH.viscous and other.covariance is found.covariance
    for own in ([4.0, 1.5, 0.15], [2.0, 3.1, 0.15], [2.0, 1.5, 0.31]):
        assert subtract_bias(found, np.array(own)) is found
    bare = replace(found, axis=TRUTH._replace(stribeck_speed=-1.0), names=names[:2])
    assert subtract_bias(bare, np.array([2.1, 1.5])).axis.mass == pytest.approx(1.9)


def test_an_estimate_tells_its_values_with_their_errors() -> None:
    found = estimate()
    assert found.values.tolist() == [1.0, -9.0] and found.std.tolist() == [0.2, 0.5]
    assert str(found) == "mass 1 +- 0.2, offset -9 +- 0.5"


def test_a_held_force_leaves_no_bias_in_viscous_friction() -> None:
    """Paired with the speed at the sample's start, the half sample costs 0.28 N s/m."""
    t = np.arange(20000) * DT
    force = 60.0 * np.sin(2.0 * t) + 40.0 * np.sin(5.3 * t) + 30.0 * np.sign(np.sin(1.1 * t))
    x = simulate(Axis(95.0, 200.0, 20.0, -3.0), force, DT)
    found = fit_structure([differences(Run(t, force, x), force, 80.0, 10)], "coulomb")
    np.testing.assert_allclose(found.values, [95.0, 200.0, 20.0, -3.0], rtol=5e-4)


def test_means_over_two_samples_are_weighted_by_a_triangle() -> None:
    """By hand: of 4 t^3 the mean about t is 4 t^3 + 2 t dt^2, and the mean of an acceleration that
    is held from sample to sample is that of its two values."""
    t, dt = np.arange(20) * 0.5, 0.5
    v, a = means(t**4, dt)
    np.testing.assert_allclose(v[2:-2], (4.0 * t**3 + 2.0 * t * dt**2)[2:-2], rtol=1e-12)
    np.testing.assert_allclose(a[2:-2], (12.0 * t**2 + 2.0 * dt**2)[2:-2], rtol=1e-12)
    push = np.random.default_rng(0).normal(size=20)
    speed = np.concatenate([[0.0], np.cumsum(push[:-1]) * dt])
    x = np.concatenate([[0.0], np.cumsum(speed[:-1] * dt + 0.5 * push[:-1] * dt**2)])
    np.testing.assert_allclose(means(x, dt)[1][2:-2], late(push, 0.5)[2:-2], atol=1e-10)
    assert means(np.arange(5.0), 0.5)[0].tolist() == [2.0] * 5  # the ends, too


def test_motion_that_does_not_determine_the_parameters_is_refused() -> None:
    steady = Rows(Run(T, FORCE, T), FORCE, np.ones(6000), np.zeros(6000), T < -1.0, 1)
    with pytest.raises(InputError, match="does not determine"):
        fit_structure([steady], "viscous")
    few = rows(part=slice(300, 302))
    with pytest.raises(InputError, match="does not determine"):
        fit_structure([few], "viscous")
    one_way = Rows(Run(T, FORCE, X), FORCE, np.abs(V) + 0.1, A, T < -1.0, 1)
    with pytest.raises(InputError, match="does not determine"):
        fit_structure([one_way], "coulomb")


def test_what_takes_no_more_of_the_force_than_rounding_is_nothing() -> None:
    """A held force is its constant, whatever the axis does; a mass of 1e-13 would be plausible."""
    held = Rows(Run(T, np.full(6000, 7.0), X), np.full(6000, 7.0), V, A, T < -1.0, 1)
    found = fit_structure([held], "viscous")
    assert found.values[:2].tolist() == [0.0, 0.0] and not plausible(found)
    assert found.axis.offset == pytest.approx(7.0)
    small = fit_structure(
        [rows(force=FORCE + 1e7)], "full"
    )  # of a force that is hardly but constant
    assert (small.values[[0, 1, 2, 4, 5]] != 0.0).all()


@pytest.mark.parametrize("factor", [1, 5])
def test_tables_of_several_records_are_stacked_without_what_stands(factor: int) -> None:
    parts = [rows(factor, part=slice(0, 3000)), rows(factor, part=slice(3000, 6000))]
    parts[1].still[500:1500] = True
    each = [columns(r, ("mass", "coulomb"), 1.0) for r in parts]
    table, lengths = stack(parts, lambda r: columns(r, ("mass", "coulomb"), 1.0))
    assert lengths == [len(one) for one in each] and lengths[1] < lengths[0]
    np.testing.assert_array_equal(table, np.concatenate(each))
    bare, _ = stack(parts[1:], lambda r: columns(r, ("mass", "coulomb"), 1.0, forced=False))
    np.testing.assert_array_equal(bare, each[1][:, :-1])


@pytest.mark.parametrize("unit", [1e-10, 1e10])
def test_the_unit_of_the_position_does_not_matter(unit: float) -> None:
    """What determines the parameters in metres does so in counts of any size."""
    still = T < -1.0
    plain = fit_structure([Rows(Run(T, FORCE, X), FORCE, V, A, still, 1)], "coulomb")
    scaled = Rows(Run(T, FORCE, unit * X), FORCE, unit * V, unit * A, still, 1)
    found = fit_structure([scaled], "coulomb")
    per = np.array([1.0 / unit, 1.0 / unit, 1.0, 1.0])  # mass and viscous; coulomb and offset
    assert found.names == ("mass", "viscous", "coulomb", "offset")
    np.testing.assert_allclose(found.values, per * plain.values, rtol=1e-6)
    np.testing.assert_allclose(found.std, per * plain.std, rtol=1e-4)
