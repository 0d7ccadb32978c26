"""Following a trajectory, in recordings made by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from macromicro.control.supervisor import DONE, SETTLING
from macromicro.control.supervisor import MACRO as MOVING
from macromicro.control.supervisor import MICRO as FINE
from macromicro.design.tracking import course, followed_stages, lagging, tracking
from macromicro.programme import MACRO, MICRO, Programme
from macromicro.recorded import COLUMNS
from macromicro.recording import Recording

DT = 1e-3
PITCH = 7e-5


def recorded(rows: int, **columns: Any) -> Recording:
    arrays = {c.name: np.zeros(rows) for c in COLUMNS}
    arrays["t"] = 3.0 + np.arange(rows) * DT
    arrays |= {name: np.asarray(value, float) for name, value in columns.items()}
    return Recording.from_arrays(COLUMNS, [arrays[c.name] for c in COLUMNS], DT, {})


def plan(*stages: int) -> Programme:
    n = len(stages)
    return Programme("", np.zeros(n), np.array(stages), np.zeros(n), np.zeros(n), math.nan, "")


def targets(stage: int, number: int, apart: int) -> tuple[Recording, Programme]:
    """That many targets, one each so many rows."""
    move = np.repeat(np.arange(number), apart)
    return recorded(len(move), move=move), plan(*[stage] * number)


@pytest.mark.parametrize("stage", [MACRO, MICRO])
@pytest.mark.parametrize(
    ("number", "apart", "follows"), [(20, 250, True), (19, 250, False), (20, 251, False)]
)
def test_twenty_targets_a_quarter_of_a_second_apart_make_a_trajectory(
    stage: int, number: int, apart: int, follows: bool
) -> None:
    assert followed_stages(*targets(stage, number, apart)) == ((stage,) if follows else ())


def test_only_targets_that_were_begun_count() -> None:
    made, _ = targets(MACRO, 19, 10)
    assert followed_stages(made, plan(*[MACRO] * 40)) == ()
    made, _ = targets(MACRO, 20, 10)
    assert followed_stages(made, plan(*[MACRO] * 40)) == (MACRO,)
    assert followed_stages(recorded(0), plan(MACRO)) == ()


def test_a_macro_course_begins_with_its_first_target_and_has_no_missing_counts() -> None:
    move = np.repeat([0, 1, 2], 4)
    place = np.arange(12.0)
    place[6] = np.nan
    made = recorded(12, move=move, macro_reference=np.arange(12.0) + 2.0, macro_position=place)
    found = course(made, plan(MICRO, MACRO, MACRO), MACRO, PITCH)
    assert found is not None
    rows = np.array([4, 5, 7, 8, 9, 10, 11])
    np.testing.assert_allclose(found.t, 3.0 + rows * DT)
    np.testing.assert_allclose(found.reference, (rows + 2.0) * 0.07)  # mm
    np.testing.assert_allclose(found.reading, rows * 0.07)


def test_a_micro_course_leaves_out_resets_and_other_phases() -> None:
    phase = np.array([FINE, FINE, SETTLING, FINE, FINE, FINE, DONE])
    laser = np.array([0.0, 10.0, 20.0, 30.0, np.nan, 50.0, 60.0])
    reset = np.array([1, 0, 0, 0, 0, 0, 0])
    made = recorded(7, phase=phase, laser=laser, laser_reset=reset,
                    micro_reference=np.arange(7) * 0.01)  # fmt: skip
    found = course(made, plan(MICRO), MICRO)
    assert found is not None
    np.testing.assert_allclose(found.reference, [10.0, 30.0, 50.0])  # um of mm
    np.testing.assert_allclose(found.reading, [10.0, 30.0, 50.0])
    assert course(recorded(7, phase=np.full(7, MOVING)), plan(MICRO), MICRO) is None
    for rows in (1, 2):  # one row is no course
        phase = np.where(np.arange(7) < rows, FINE, MOVING)
        seen = course(recorded(7, phase=phase), plan(MICRO), MICRO)
        assert (None if seen is None else len(seen.t)) == (None if rows == 1 else rows)


@pytest.mark.parametrize(("stage", "unit", "scale"), [(MACRO, "mm", 0.07), (MICRO, "um", 1e3)])
def test_errors_lag_and_times_of_a_stage_on_its_way(stage: int, unit: str, scale: float) -> None:
    """It follows 0.3 mm/s or 300 count/s 40 ms late, once farther off by far."""
    rows = 2000
    move = np.repeat(np.arange(40), 50)
    way = np.sin(np.arange(rows) * DT * 2.0)
    late = np.sin((np.arange(rows) - 40) * DT * 2.0)
    late[700] -= 0.2
    names = (
        ("macro_reference", "macro_position") if stage == MACRO else ("micro_reference", "laser")
    )
    made = recorded(
        rows, move=move, phase=np.full(rows, FINE),
        **{names[0]: way, names[1]: late * (1.0 if stage == MACRO else 1e3)},
    )  # fmt: skip
    (found,) = tracking(made, plan(*[stage] * 40), pitch=PITCH)
    error = (way - late) * scale
    assert (found.stage, found.unit, found.targets) == (
        "macro" if stage == MACRO else "micro", unit, 40
    )  # fmt: skip
    assert (found.start_s, found.end_s) == (3.0, pytest.approx(3.0 + 1.999))
    assert found.rms_error == pytest.approx(math.sqrt(np.mean(error**2)))
    assert found.peak_error == pytest.approx(abs(error[700]))
    assert found.peak_s == pytest.approx(3.7)
    assert found.lag_s == pytest.approx(0.04, abs=1e-3)
    assert found.rms_without_lag == pytest.approx(0.2 * scale / math.sqrt(1500.0), rel=0.05)


@pytest.mark.parametrize("rows", [40, 8_000, 60_000])
@pytest.mark.parametrize("late", [0.0, 2.3, 5.0])
def test_a_lag_between_samples_is_found_by_a_parabola(rows: int, late: float) -> None:
    """Of a parabola the squares are one of the lag, nearly; long recordings are thinned."""
    k = np.arange(rows, dtype=float)
    step = max(1, rows // 20_000)
    slope, lag = 3.0, late * step
    found, left = lagging(slope * k, slope * (k - lag), DT)
    assert found == pytest.approx(lag * DT, abs=1e-9)
    off = (late - round(late)) * step
    assert left == pytest.approx(slope * abs(off), abs=1e-9)


def test_a_lag_is_sought_up_to_a_second_and_a_quarter_of_the_rows() -> None:
    k = np.arange(8000.0)
    assert lagging(k, k - 1500.0, DT)[0] == 1.0
    assert lagging(k[:400], k[:400] - 150.0, DT)[0] == pytest.approx(0.1)
    assert lagging(k[:3], k[:3], DT) == (None, None)
    assert lagging(k[:4], k[:4], DT) == (0.0, 0.0)
