"""Records of a drive that tell nothing, or something else: refused, or no error is told."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify import drive
from macromicro.identify._axis_hints import against, coarse, directions, jumps
from macromicro.identify.axis_inverse import Estimate
from macromicro.identify.kinds.drive_report import about
from macromicro.identify.notices import DataWarning
from macromicro.identify.runs import Run
from macromicro.models.mass import Axis, simulate

DT = 1e-3


def record(seconds: float = 8.0, dt: float = DT, **axis: float) -> tuple[Array, Array, Array]:
    """An axis of 95 kg under steps of force both ways, its position with a noise of 2 um."""
    random = np.random.default_rng(0)
    each = round(0.4 / dt)
    u = np.repeat(random.uniform(-120.0, 120.0, round(seconds / 0.4)), each)
    made = Axis(**({"mass": 95.0, "viscous": 200.0, "coulomb": 20.0} | axis))
    x = simulate(made, u, dt, 0.0, 0.0)
    return np.arange(len(u)) * dt, u, x + 2e-6 * random.standard_normal(len(u))


@pytest.mark.parametrize("structure", ["viscous", "coulomb", "auto"])
def test_a_force_of_the_wrong_sign_is_refused(structure: str) -> None:
    t, u, x = record()
    with pytest.raises(InputError, match="Check the signs of u, x and gain"):
        drive(t, -u, x, structure=structure)


def estimate(mass: float, error: float, viscous: float = 1.0) -> Estimate:
    axis = Axis(mass=mass, viscous=viscous)
    return Estimate(axis, ("viscous", "mass"), np.diag([1.0, error**2]), 0.0, 0.0)


def test_a_mass_below_zero_is_refused_where_it_is_sure() -> None:
    against(estimate(-1.0, 0.51))
    against(estimate(1.0, 0.01))
    with pytest.raises(InputError, match=r"the mass is -1 \+- 0\.49: the force acts against"):
        against(estimate(-1.0, 0.49))


@given(st.integers(1, 2), st.floats(0.02, 0.4), st.integers(1, 20))
def test_a_counter_that_wraps_is_refused(seed: int, speed: float, most: int) -> None:
    random = np.random.default_rng(seed)
    t = np.arange(4000) * DT
    x = np.cumsum(np.repeat(random.uniform(-speed, speed, 8), 500)) * DT
    way = float(np.ptp(x)) / (most + 0.5)
    wrapped = np.mod(x - x.min(), way)
    large = float(np.abs(np.diff(x)).max())
    many = int(np.count_nonzero(np.abs(np.diff(wrapped)) > 0.5 * way))
    if way < 7.0 * large or many > 60:
        return
    jumps(Run(t, x, x), "record[0].x")
    with pytest.raises(
        InputError, match=rf"\({many} such jumps; all other.*Unwrap the counter"
    ) as e:
        jumps(Run(t, x, wrapped), "record[0].x")
    row = int(e.value.where.rsplit(" ", 1)[1])
    assert abs(wrapped[row - 1] - wrapped[row - 2]) > 0.5 * way
    assert np.all(np.abs(np.diff(wrapped[: row - 1])) < 0.5 * way)


@pytest.mark.parametrize("x", [
    np.zeros(500), np.r_[np.zeros(250), np.ones(250)], np.arange(500.0),
    np.floor(np.arange(500) / 7.0), np.floor(np.cumsum(np.linspace(0.0, 3.0, 500))),
    np.r_[np.zeros(100), 0.02 * np.arange(400.0) ** 2],
    100.0 * (1.0 - np.exp(-np.arange(500) / 40.0)),
])  # fmt: skip
def test_positions_that_rest_count_or_speed_up_are_no_jumps(x: Array) -> None:
    jumps(Run(np.arange(500) * DT, x, x), "x")


def test_five_times_any_other_step_is_a_jump() -> None:
    x = np.r_[np.arange(100.0), np.arange(100.0) + 104.0]
    jumps(Run(x, x, x), "x")
    x[100:] += 0.01
    with pytest.raises(
        InputError, match=r"x, row 101: the position jumps by 5\.01 \(1 such jumps; .* 1 at most"
    ):
        jumps(Run(x, x, x), "x")


def test_a_jump_within_what_it_moves_at_full_speed_is_one() -> None:
    """The speed is 3 before and 3 after it, and changes by 0.02 elsewhere: counts were lost."""
    swing = 300.0 * np.sin(np.arange(1000) / 100.0)
    x = np.r_[swing[:700], swing[700:] - 2.0]
    assert np.abs(np.diff(x)).max() < 5.0
    with pytest.raises(
        InputError,
        match=r"row 701: .* jumps by 0\.\d+ \(1 such jumps; other steps differ .* 0\.0\d+ at most",
    ):
        jumps(Run(x, x, x), "x")
    spike = swing.copy()
    spike[500] += 2.0
    with pytest.raises(InputError, match="row 501: the position jumps by"):
        jumps(Run(spike, spike, spike), "x")


def test_an_impact_is_no_jump() -> None:
    """From one sample to the next it goes back as fast as it came, and stays there."""
    x = np.r_[np.arange(0.0, 100.0), 99.0 - np.arange(1.0, 80.0), np.full(50, 20.0)]
    jumps(Run(x, x, x), "x")
    smooth = np.cumsum(x) * 1e-2
    jumps(Run(smooth, smooth, smooth), "x")
    steps = np.r_[np.ones(100), 6.0, np.full(100, 11.0)]  # a push over two samples
    pushed = np.cumsum(steps + 0.01 * np.random.default_rng(0).standard_normal(201))
    jumps(Run(pushed, pushed, pushed), "x")


def test_jumps_of_more_than_a_fiftieth_of_the_samples_are_how_it_moves() -> None:
    """A coarse and rapid position: each seventh sample."""
    x = np.arange(700.0) + 50.0 * (np.arange(700) // 7)
    jumps(Run(x, x, x), "x")


def test_a_wrapped_record_is_refused_with_its_row() -> None:
    t, u, x = record()
    with pytest.raises(InputError, match=r"record\[0\]\.x, row \d+: the position jumps by"):
        drive(t, u, np.mod(x, 0.4 * np.ptp(x)))


def test_samples_too_far_apart_are_refused() -> None:
    t, u, x = record(80.0, viscous=95.0 * 2.0 * math.pi * 10.0)
    with pytest.raises(InputError, match="the sample time is 50 ms, the time constant"):
        drive(t[::50], u[::50], x[::50])


@pytest.mark.parametrize(("samples", "told"), [(1.49, "refused"), (1.51, "warned"), (4.01, "")])
def test_the_shorter_time_constant_of_both_methods_counts(samples: float, told: str) -> None:
    both = (Axis(9.0, 1.0), Axis(samples * DT, 1.0))
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        if told == "refused":
            with pytest.raises(InputError, match=r"sample time is 1 ms, .* 1\.49 ms"):
                coarse(both, DT)
        else:
            coarse(both, DT)
    assert [w.category for w in seen] == ([DataWarning] if told == "warned" else [])
    coarse((Axis(1.0, 0.0), Axis(-1.0, 1.0)), DT)


def test_what_ends_at_zero_has_no_standard_error() -> None:
    """There is no Coulomb friction; the search for some ends at nothing."""
    t, u, x = record(coulomb=0.0, viscous=400.0)
    with pytest.warns(DataWarning, match="coulomb ended at 0"):
        found = drive(t, u - 3.0 * np.sign(np.gradient(x)), x, structure="coulomb")
    errors: dict[str, Any] = dict(zip(found.refined.names, found.refined.std, strict=True))
    assert math.isnan(errors.pop("coulomb")) and found.axis.coulomb < 1e-3
    assert all(error > 0.0 for error in errors.values())
    assert abs(found.axis.mass - 95.0) < 2.0 * errors["mass"] < 10.0


def test_directions_are_those_of_some_share_of_the_motion() -> None:
    both = np.repeat([1.0, 1.0, 2.0, -0.5, 0.019, -0.019], 10)
    assert directions(both) == {1.0, -1.0}
    assert directions(both, 0.24) == {1.0, -1.0} and directions(both, 0.26) == {1.0}
    assert directions(np.array([1.0, -0.009])) == {1.0}


def test_an_error_in_words() -> None:
    assert about(0.0123, "N") == "+- 0.012 N" and about(2.0) == "+- 2"
    assert about(math.nan, "N") == ""


def test_motion_in_one_direction_is_said() -> None:
    """Its offset is Coulomb friction, too; with friction in the model the fit refuses by name."""
    t = np.arange(10000) * DT
    u = np.repeat(np.random.default_rng(0).uniform(40.0, 160.0, 25), 400)
    x = simulate(Axis(95.0, 200.0, 20.0), u, DT) + 2e-6 * np.random.default_rng(1).normal(
        size=10000
    )
    with pytest.warns(DataWarning, match="one direction only: Coulomb friction and a constant"):
        found = drive(t, u, x, structure="viscous")
    assert found.axis.offset == pytest.approx(20.0, rel=0.01)
    with pytest.raises(InputError, match=r"cannot be separated: coulomb, offset\)"):
        drive(t, u, x, structure="coulomb")
    both = record()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        drive(*both, structure="coulomb")
