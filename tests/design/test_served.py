"""Moves in recordings of the live machine: what is one, when it began, and whether it ended."""

from __future__ import annotations

import numpy as np
import pytest

import macromicro
from macromicro.columns import Column
from macromicro.control.live.messages import MODES
from macromicro.design.served import is_live, served_moves, timetable
from macromicro.errors import InputError
from macromicro.programme import MACRO, MICRO
from macromicro.recording import Recording

NAMES = ("t", "mode", "motion", "macro_reference", "macro_position", "micro_reference")
NAMES += ("hall_position", "laser", "laser_reset")


def live(*parts: tuple[str, int, float, float, int]) -> Recording:
    """Parts of a recording: mode, motion, set points [counts, mm], rows. A negative first set
    point travels on from there. Sensors are on the set point from the 50th row of a part on."""
    rows: list[list[float]] = []
    for mode, motion, coarse, fine, count in parts:
        for k in range(count):
            place = -coarse + k if coarse < 0.0 else coarse
            lag = 10.0 if k < 50 and mode.startswith("moving") else 0.0
            far = lag if mode == "moving-macro" else 0.0
            row = [0.0, MODES.index(mode), motion, place, place - far, fine, fine - 0.05 * lag]
            rows.append([*row, 1e3 * (fine - 0.05 * lag), 0.0])
    table = np.array(rows).T
    table[0] = 2.0 + 1e-3 * np.arange(len(rows))
    columns = [Column(name, "-", name) for name in NAMES]
    return Recording.from_arrays(columns, table, 1e-3, {"modes": ", ".join(MODES)})


ALL = (
    ("disabled", 0, 0.0, 0.0, 100),
    ("homing", 1, -100.0, 0.0, 500),
    ("ready", 0, 0.0, 0.0, 200),
    ("moving-macro", 2, 700.0, 0.0, 600),
    ("settling", 2, 700.0, 0.0, 400),
    ("moving-micro", 2, 700.0, 0.5, 800),
    ("holding", 0, 700.0, 0.5, 900),
    ("moving-macro", 3, -700.0, 0.0, 500),  # a jog
    ("stopped", 3, 1200.0, 0.0, 100),
    ("ready", 0, 1200.0, 0.0, 100),
    ("moving-macro", 4, 2000.0, 0.0, 300),
    ("stopped", 4, 2000.0, 0.0, 100),
    ("ready", 0, 2000.0, 0.0, 300),
    ("moving-micro", 5, 2000.0, 1.0, 1000),
    ("holding", 0, 2000.0, 1.0, 1000),
)


def test_moves_to_a_place_are_found_and_no_others() -> None:
    recording = live(*ALL)
    assert is_live(recording)
    found = served_moves(recording)
    assert found.programme.stage.tolist() == [MACRO, MICRO, MACRO, MICRO]
    assert found.programme.target.tolist() == [700.0, 0.5e-3, 2000.0, 1e-3]
    assert found.cut.tolist() == [False, False, True, False]
    assert not np.isin(found.recording["mode"], (MODES.index("homing"), 0)).any()
    moves = macromicro.moves(recording)
    assert [move.complete for move in moves] == [True, True, False, True]
    assert [round(move.start_s, 3) for move in moves] == [2.8, 3.8, 6.2, 6.9]
    assert moves[0].settling_s == pytest.approx(0.05)
    assert moves[1].settling_s == pytest.approx(0.05, abs=0.012)  # the laser's mean over 21 ms
    assert moves[3].final_error == pytest.approx(0.0)


@pytest.mark.parametrize(("rows", "complete"), [(1, True), (0, False)])
def test_a_recording_that_ends_on_the_way_cuts_its_last_move(rows: int, complete: bool) -> None:
    ends = ("ready", 0, 700.0, 0.0, 300) if rows else ("moving-macro", 1, 700.0, 0.0, 1)
    (move,) = macromicro.moves(live(("moving-macro", 1, 700.0, 0.0, 300), ends))
    assert move.complete == complete


def test_their_times_make_a_programme() -> None:
    what = timetable(live(*ALL))
    assert what.scheduled and what.end == pytest.approx(6.899)
    assert what.start.tolist() == pytest.approx([0.8, 1.8, 4.2, 4.9])
    assert what.hold.tolist() == pytest.approx([1.0, 2.4, 0.7, 1.999])
    with pytest.raises(InputError, match="no moves"):
        timetable(live(*ALL[:3]))


def test_so_do_those_of_a_run() -> None:
    run = macromicro.run("thesis")
    what, moves = timetable(run), macromicro.moves(run)
    assert what.start.tolist() == pytest.approx([move.start_s for move in moves])
    assert [("macro", "micro")[k] for k in what.stage] == [move.stage for move in moves]
