"""Measures of moves that do not begin with the recording, in rows made by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from macromicro.control.supervisor import DONE, FAULT, MICRO, SETTLING
from macromicro.control.supervisor import MACRO as MOVING
from macromicro.design.response import MoveResult, moves, smoothed
from macromicro.programme import Programme
from macromicro.recorded import COLUMNS
from macromicro.recording import Recording

DT = 1e-3
PITCH = 7e-5


def recorded(rows: int, dt: float = DT, **columns: Any) -> Recording:
    arrays = {c.name: np.zeros(rows) for c in COLUMNS}
    arrays["t"] = np.arange(rows) * dt
    arrays |= {name: np.asarray(value, float) for name, value in columns.items()}
    return Recording.from_arrays(COLUMNS, [arrays[c.name] for c in COLUMNS], dt, {})


def plan(*steps: tuple[int, float]) -> Programme:
    stage, target = (np.array(x) for x in zip(*steps, strict=True))
    n = len(stage)
    return Programme("", np.zeros(n), stage, target, np.zeros(n), math.nan, "")


def later(dt: float = DT, last: int = DONE, **columns: Any) -> MoveResult:
    """A second macro move of 2000 rows, to 60 counts, that begins in row 300."""
    n = 2300
    phase = np.full(n, MOVING)
    phase[-1] = last
    given = {"move": np.arange(n) >= 300, "phase": phase, **columns}
    made = recorded(n, dt, **given)
    return moves(made, plan((0, 50.0), (0, 60.0)), pitch=PITCH)[1]


def test_a_later_macro_move_is_timed_from_its_own_begin() -> None:
    """It comes within 2 counts in row 700 and rests a count and a half beyond."""
    k = np.arange(2300)
    place = np.where(k < 300, 50.0, np.where(k < 700, 57.9, 61.5))
    true = place * 0.07 + 0.01
    found = later(macro_position=place, true_carriage=true)
    assert (found.start_s, found.arrived_s, found.settling_s) == (0.3, 0.7, 0.4)
    assert found.final_error_counts == -1.5
    assert found.final_error == pytest.approx(-1.5 * 0.07)  # mm
    assert found.true_error == pytest.approx(60.5 * 0.07 - (61.5 * 0.07 + 0.01))
    assert found.overshoot == pytest.approx(1.5 * 0.07)
    assert (found.target, found.band) == (pytest.approx(4.2), pytest.approx(0.14))


def test_times_and_places_are_told_to_the_ninth_digit() -> None:
    place = np.where(np.arange(2300) < 700, 50.0, 60.0)
    found = later(dt=1e-3 / 3.0, macro_position=place)
    assert (found.start_s, found.arrived_s, found.settling_s) == (0.1, 0.233333333, 0.133333333)
    made = recorded(10, move=np.zeros(10), phase=np.full(10, MOVING))
    (found,) = moves(made, plan((0, 1.0 / 3.0)), pitch=1e-3 / 3.0)
    assert found.target == 0.111111111


def test_an_overshoot_counts_from_the_first_known_error() -> None:
    """From above as from below; errors that are missing tell nothing."""
    k = np.arange(2300)
    place = np.where(k < 300, 90.0, np.where(k < 310, 88.0, np.where(k < 320, 57.0, 60.0)))
    assert later(macro_position=place).overshoot == pytest.approx(3.0 * 0.07)
    place[300] = np.nan
    assert later(macro_position=place).overshoot == pytest.approx(3.0 * 0.07)
    place[300] = 59.0  # already beyond: the way back is no overshoot until it passes 60 again
    assert later(macro_position=place).overshoot == pytest.approx(28.0 * 0.07)
    assert later(macro_position=np.full(2300, np.nan)).overshoot is None


def fine(
    first: float, then: float, reset: int | None, last: int = DONE, dt: float = DT
) -> MoveResult:
    """A micro move to 1000 um in the rows 300 to 1300 of 1500, the error `then` from row 800 on;
    the laser still counts from another zero up to a reset."""
    k = np.arange(1500)
    laser = 1000.0 - np.where(k < 800, first, then)
    columns: dict[str, Any] = {"laser_reset": np.zeros(1500)}
    if reset is not None:
        columns["laser_reset"][reset] = 1.0
        laser = laser - 500.0 * (k <= reset)
    phase = np.where(k < 300, SETTLING, np.where(k < 1300, MICRO, MOVING))
    phase[-1] = DONE
    made = recorded(
        1500, move=(k >= 300).astype(float) + (k >= 1300), phase=phase, laser=laser,
        hall_position=0.98 + 0.001 * (k >= 800), true_micro=0.99 + 0.001 * (k >= 800), **columns,
    )  # fmt: skip
    return moves(made, plan((0, 1.0), (1, 1e-3), (0, 2.0)))[1]


@pytest.mark.parametrize("reset", [None, 300, 420])
def test_a_later_micro_move_is_timed_from_its_own_begin(reset: int | None) -> None:
    """In um; readings up to the laser's reset are not its own."""
    found = fine(30.0, 4.0, reset)
    assert found.start_s == 0.3 and found.arrived_s is not None
    # A centred mean over the jump comes within 10 um where 20 of 26 um are gone.
    assert found.arrived_s == pytest.approx(0.8, abs=0.02)
    assert found.settling_s == pytest.approx(found.arrived_s - 0.3, abs=1e-9)
    assert found.final_error == pytest.approx(4.0)
    assert found.hall_error == pytest.approx(1e3 * (1.0 - 0.981))
    assert found.true_error == pytest.approx(1e3 * (1.0 - 0.991))
    assert (found.target, found.overshoot) == (1000.0, 0.0)


def test_a_micro_move_arrives_where_its_smoothed_error_stays_within_ten_um() -> None:
    """Over 21 rows, so ten to either side, less at the ends."""
    error = np.where(np.arange(1000) < 500, 30.0, 4.0)
    mean = [error[max(i - h, 0) : i + h + 1].mean()
            for i in range(1000) for h in (min(10, i, 999 - i),)]  # fmt: skip
    np.testing.assert_allclose(smoothed(error, 21), mean)
    inside = int(np.flatnonzero(np.abs(mean) > 10.0)[-1]) + 1
    assert fine(30.0, 4.0, None).arrived_s == pytest.approx(0.3 + inside * DT, abs=1.1e-3)


def test_the_first_row_of_a_move_counts_where_there_is_no_reset() -> None:
    """Within the band from there on: it took no time."""
    found = fine(4.0, 4.0, None)
    assert (found.arrived_s, found.settling_s) == (0.3, 0.0)


@pytest.mark.parametrize(("rows", "arrives"), [(150, False), (250, True)])
def test_an_unfinished_micro_move_needs_the_dwell(rows: int, arrives: bool) -> None:
    """0.2 s: a finished one is held anyway."""
    k = np.arange(rows)
    laser = np.full(rows, 996.0)
    for last, seen in ((FAULT, arrives), (DONE, True)):
        phase = np.where(k == rows - 1, last, MICRO)
        made = recorded(rows, move=np.zeros(rows), phase=phase, laser=laser)
        (found,) = moves(made, plan((1, 1e-3)))
        assert (found.arrived_s is not None) == seen
        assert (found.final_error is not None) == (last == DONE)


def test_a_target_is_told_to_a_picometre() -> None:
    made = recorded(10, move=np.zeros(10), phase=np.full(10, MICRO))
    (found,) = moves(made, plan((1, 1e-3 / 3.0)))
    assert found.target == 333.333333


@pytest.mark.parametrize("phase", [MOVING, SETTLING, MICRO])
def test_a_fine_move_that_was_overtaken_or_has_no_row_is_none(phase: int) -> None:
    """The second while the carriage is on its way, the third without a row of its own."""
    move = np.repeat([0, 1, 3], 300)
    phases = np.repeat([MOVING, phase, MICRO], 300)
    phases[-1] = DONE
    made = recorded(900, move=move, phase=phases, laser=np.full(900, 1000.0))
    found = moves(made, plan((0, 5.0), (1, 1e-3), (1, 2e-3), (1, 1e-3)))
    assert [m.move for m in found] == ([0, 1, 3] if phase == MICRO else [0, 3])


def test_the_last_row_tells_how_many_moves_were_begun() -> None:
    made = recorded(3, move=[0.0, 0.0, 1.0], phase=np.full(3, MOVING))
    assert [m.move for m in moves(made, plan((0, 1.0), (0, 2.0), (0, 3.0)))] == [0, 1]
