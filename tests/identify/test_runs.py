"""Runs: what is accepted as time, input and position of an axis."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.columns import Column
from macromicro.errors import InputError
from macromicro.identify import Run
from macromicro.identify.notices import ResampledWarning
from macromicro.identify.runs import as_run, checked
from macromicro.recording import Recording

T = np.arange(100) * 1e-3


def test_a_recording_is_a_run() -> None:
    columns = [
        Column("t", "s", "time"),
        Column("motor", "V", "volts"),
        Column("macro_position", "count", "encoder"),
    ]
    recording = Recording.from_arrays(columns, [T, np.full(100, 4.0), 2.0 * T], 1e-3, {})
    run = as_run(recording, "run")
    assert isinstance(run, Run)
    assert run.dt == pytest.approx(1e-3)
    np.testing.assert_array_equal(run.x, 2.0 * T)


def test_uneven_time_is_interpolated_and_said() -> None:
    """Every tenth sample late by half a step: a straight line stays one, a step stays a step."""
    t = T.copy()
    t[5::10] += 0.5e-3
    u = np.where(t < 0.05, 0.0, 1.0)
    said = "time steps from 0.0005 to 0.0015 s; interpolated onto 100 samples 0.001 s apart"
    with pytest.warns(ResampledWarning, match=said):
        run = checked(t, u, 3.0 * t)
    assert np.ptp(np.diff(run.t)) < 1e-12
    np.testing.assert_allclose(run.x, 3.0 * run.t, atol=1e-12)
    assert set(np.unique(run.u)) == {0.0, 1.0}


def test_clock_jitter_of_a_recorder_is_left_alone(recwarn: pytest.WarningsRecorder) -> None:
    t = T + 1e-6 * np.random.default_rng(0).standard_normal(100)
    assert checked(t, t, t).t is t
    assert not recwarn.list


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"t": None}, "run.t: the array is missing"),
        ({"x": T[:50]}, "have 100, 100 and 50 rows"),
        ({"t": T[::-1]}, "times that increase"),
        (
            {"t": np.where(T > 0.05, T + 1.0, T)},
            r"a gap of 1.001 s after 0.05 s \(usual step 0.001 s\)",
        ),
        ({"x": np.where(T > 0.05, np.nan, T)}, "row 51"),
        ({"u": ["a"] * 100}, "numbers"),
    ],
)
def test_unusable_runs_are_refused(change: dict, match: str) -> None:
    with pytest.raises(InputError, match=match):
        checked(**{"t": T, "u": T, "x": T, **change})
    with pytest.raises(InputError, match="20 samples or more"):
        checked(T[:5], T[:5], T[:5])
    with pytest.raises(InputError, match="a Recording or arrays"):
        as_run(3, "run")


def test_a_time_that_goes_back_is_named_with_the_one_before() -> None:
    t = np.arange(30) * 0.1
    t[7] = 0.55
    with pytest.raises(InputError, match=r"0\.55 s follows 0\.6 s"):
        checked(t, t, t)


def test_the_input_is_held_from_each_time_stamp_to_the_next() -> None:
    """On the even grid each sample has the input of the last stamp that is not later."""
    t = np.arange(30) * 0.1
    t[10:20] += 0.04
    u = np.arange(30.0)
    with pytest.warns(ResampledWarning):
        run = checked(t, u, u)
    wanted = [float(u[t <= now + 1e-12][-1]) for now in run.t]
    np.testing.assert_array_equal(run.u, wanted)
    assert run.u[0] == 0.0 and run.u[10] == 9.0 and run.u[-1] == 29.0
