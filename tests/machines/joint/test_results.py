"""How moves of two axes went, from a recording made by hand."""

import numpy as np
import pytest

from macromicro.columns import Column
from macromicro.machines import results
from macromicro.machines.joint import planning
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.joint.settings import AXES, DEFAULT
from macromicro.recording import Recording
from tests.machines.joint.axes import straight

DT = 1e-3
PLAN = planning.plan(straight((0.04, 0.03)), DEFAULT)
N = int(np.ceil(PLAN.plans[0].length[0] / DT))


def recording(**off):
    """One move along its path, then held for 0.2 s; `off` is added to columns, mm."""
    s = np.r_[PLAN.traces[0].s[:N], np.full(200, 0.05)]
    t = np.arange(len(s)) * DT
    phase = np.where(np.arange(len(s)) < N + 20, 1.0, 2.0)
    columns = {"t": t, "phase": phase, "move": np.zeros(len(s)), "arrived": (phase == 2) * 1.0}
    for name, share in (("x", 800.0), ("y", 600.0)):
        for column in (f"true_{name}", f"{name}_position", f"{name}_target"):
            columns[column] = share * s + off.get(column, 0.0)
        columns[f"{name}_true_position"] = columns[f"true_{name}"]
    names = [Column(name, "1", "", "f8") for name in columns]
    return Recording.from_arrays(names, list(columns.values()), DT, {})


def test_across_the_path_an_error_is_one_of_the_contour():
    (move,) = results.of(XY_MACHINE, recording(x_position=-0.006, y_position=0.008), PLAN, DEFAULT)
    assert move.way == pytest.approx(50.0) and move.target == pytest.approx((40.0, 30.0))
    # At a right angle to the direction (0.8, 0.6).
    assert move.contour.peak == pytest.approx(0.01) == pytest.approx(move.contour.rms)
    assert move.contour.true_peak == pytest.approx(0.0, abs=1e-9)
    assert move.axes[0].peak_error == pytest.approx(0.006)
    assert move.axes[1].rms_error == pytest.approx(0.008)
    assert move.true_error == pytest.approx(0.0, abs=1e-9)


def test_along_the_path_it_is_none():
    back = {"x_position": -0.008, "y_position": -0.006}
    r = recording(**back)
    (move,) = results.of(XY_MACHINE, r, PLAN, DEFAULT)
    assert move.contour.rms < 2e-3  # but for the first rows, behind the beginning
    assert move.axes[0].peak_error == pytest.approx(0.008)


def test_the_true_place_is_told_apart():
    (move,) = results.of(XY_MACHINE, recording(true_x=0.03, true_y=-0.04), PLAN, DEFAULT)
    assert move.contour.peak == pytest.approx(0.0, abs=1e-9)
    assert move.contour.true_peak == pytest.approx(0.05) == pytest.approx(move.contour.true_rms)
    assert move.true_error == pytest.approx(0.05)
    assert move.complete and move.arrived_s is not None


def test_a_reading_that_is_missing_counts_as_where_it_was():
    values = np.array([np.nan, 1.0, np.nan, 3.0, np.nan])
    assert results.fill_gaps(values).tolist() == [0.0, 1.0, 1.0, 3.0, 3.0]
    assert results.fill_gaps(np.array([1.0, 2.0])).tolist() == [1.0, 2.0]


def test_one_axis_is_a_recording_of_one_stage():
    alone = results.alone(recording(), AXES, "y")
    names = [c.name for c in alone.columns]
    assert names == ["t", "phase", "move", "arrived", "position", "target", "true_position"]
    assert alone["target"][-1] == pytest.approx(30.0)


def test_the_rows_of_a_move_and_of_its_profile():
    r = recording()
    assert results.rows(r, 0) == slice(0, N + 200)
    assert results.under_way(r, PLAN, 0) == slice(0, N)
    assert results.rows(r, 1) == slice(0, 0)
