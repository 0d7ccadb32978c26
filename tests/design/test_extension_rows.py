"""Returns to zero in recordings of a few rows, each made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.control.supervisor import DONE, MACRO, MICRO, SETTLING
from macromicro.design.extension import Cycle, Extension, extension, per_cycle
from macromicro.design.response import MoveResult
from macromicro.recorded import COLUMNS
from macromicro.recording import Recording

DT = 2e-3


def recorded(phase: list[int], hall_um: list[float], move: list[int], dt: float = DT) -> Recording:
    rows = len(phase)
    arrays = {c.name: np.zeros(rows) for c in COLUMNS}
    arrays["t"] = np.arange(rows) * dt
    arrays["phase"], arrays["move"] = np.array(phase, float), np.array(move, float)
    arrays["hall_position"] = np.array(hall_um) * 1e-3
    return Recording.from_arrays(COLUMNS, [arrays[c.name] for c in COLUMNS], dt, {})


def returning(*hall_um: float, phase: int = MACRO) -> list[Extension]:
    """After a move 2 of three rows and a move 3 of one row, both micro."""
    places = [500.0] * 4 + list(hall_um)
    phases = [MICRO] * 4 + [phase] * len(hall_um)
    return extension(recorded(phases, places, [2, 2, 2, 3] + [4] * len(hall_um)))


def test_a_return_begins_in_the_row_after_its_move() -> None:
    (found,) = returning(300.0, 100.0, 19.0, 1.0, 0.0)
    assert (found.move, found.start_s, found.from_um) == (3, 4 * DT, 300.0)
    assert found.time_s == 2 * DT


def test_it_counts_from_more_than_20_um_on_either_side() -> None:
    assert [r.from_um for r in returning(-20.1, 0.0)] == [pytest.approx(-20.1)]
    assert [r.from_um for r in returning(20.1, 0.0)] == [pytest.approx(20.1)]
    assert returning(20.0, 300.0) == returning(-20.0, 300.0) == []


def test_it_has_returned_when_it_stays_within_20_um() -> None:
    assert returning(300.0, 20.0, 20.1, 20.0, 0.0)[0].time_s == 3 * DT
    assert returning(300.0, -20.0, -20.1, -20.0, 0.0)[0].time_s == 3 * DT
    assert returning(300.0, 0.0, 0.0, 21.0)[0].time_s is None
    assert returning(300.0, np.nan, 0.0)[0].time_s == 2 * DT  # a missing one is not within


def test_what_is_left_is_the_mean_of_the_last_20_ms() -> None:
    """Ten rows of 2 ms; less where fewer are there."""
    tail = [float(k) for k in range(30)]
    (found,) = returning(300.0, *tail)
    assert found.left_um == pytest.approx(np.mean(tail[-10:]))
    assert returning(300.0, 0.0)[0].left_um == pytest.approx(150.0)


def test_times_are_told_to_the_nanosecond() -> None:
    """So that a period of a third of a millisecond makes no endless digits."""
    dt = 1e-3 / 3.0
    (found,) = extension(recorded([MICRO, MACRO, MACRO], [400.0, 300.0, 0.0], [0, 1, 1], dt))
    assert (found.start_s, found.time_s) == (0.000333333, 0.000333333)


def test_a_return_ends_where_the_stage_is_enabled_again() -> None:
    phases = [MICRO, MACRO, SETTLING, MICRO, MACRO, MACRO]
    found = extension(recorded(phases, [400.0, 300.0, 50.0, 0.0, 200.0, 10.0], [0, 1, 1, 2, 3, 3]))
    assert [(r.move, r.start_s, r.time_s) for r in found] == [(0, DT, None), (2, 4 * DT, DT)]
    assert [r.left_um for r in found] == pytest.approx([175.0, 105.0])


def test_what_ends_with_the_programme_is_no_return() -> None:
    assert returning(300.0, 0.0, phase=DONE) == []
    assert extension(recorded([MACRO, MICRO, MICRO], [400.0] * 3, [0, 1, 1])) == []


def result(move: int, stage: str, error: float | None, true: float | None) -> MoveResult:
    empty = dict.fromkeys(MoveResult._fields)
    return MoveResult(**{**empty, "move": move, "stage": stage, "final_error": error,
                         "true_error": true})  # fmt: skip


def test_cycles_have_the_means_of_their_moves_and_returns() -> None:
    """Three moves a cycle; the last cycle was begun only. A macro move has no bias."""
    moves = [
        result(0, "macro", 90.0, 90.0), result(1, "micro", 2.0, 1.0), result(2, "micro", 4.0, None),
        result(3, "macro", None, None), result(4, "micro", None, 5.0), result(5, "micro", 7.0, 9.0),
        result(6, "macro", 1.0, 1.0),
    ]  # fmt: skip
    returns = [
        Extension(1, 0.0, 300.0, 0.5, 3.0), Extension(2, 0.0, 300.0, 0.7, 5.0),
        Extension(4, 0.0, 300.0, None, 30.0), Extension(5, 0.0, 300.0, 0.9, 10.0),
    ]  # fmt: skip
    assert per_cycle(moves, returns, 3) == [
        Cycle(1, 2, pytest.approx(0.6), 0.7, 4.0, 3.0, 1.0),
        Cycle(2, 2, None, None, 20.0, 7.0, 7.0),
        Cycle(3, 0, None, None, None, None, None),
    ]
    assert per_cycle([], [], 3) == []
