"""Which moves a recording of a run shows, from rows made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.control.supervisor import DONE, SETTLING
from macromicro.control.supervisor import MACRO as MOVING
from macromicro.control.supervisor import MICRO as FINE
from macromicro.design.served import is_live, ran, timetable
from macromicro.errors import InputError
from macromicro.programme import MACRO, MICRO
from macromicro.recorded import COLUMNS
from macromicro.recording import Recording

DT = 0.5


def recorded(rows: list[tuple[int, int, float, float]]) -> Recording:
    """Rows of (move, phase, macro reference [counts], micro reference [mm])."""
    arrays = {c.name: np.zeros(len(rows)) for c in COLUMNS}
    arrays["t"] = 7.0 + np.arange(len(rows)) * DT
    names = ("move", "phase", "macro_reference", "micro_reference")
    for name, values in zip(names, zip(*rows, strict=True), strict=True):
        arrays[name] = np.array(values, float)
    return Recording.from_arrays(COLUMNS, [arrays[c.name] for c in COLUMNS], DT, {})


RUN = [
    (0, MOVING, 50.0, 0.0), (0, SETTLING, 50.0, 0.0),
    (1, FINE, 50.0, 1.5), (1, FINE, 50.0, 1.5),
    (2, FINE, 50.0, 2.0),
    (3, MOVING, 80.0, 0.0), (3, MOVING, 80.0, 0.0),
    (4, MOVING, 20.0, 0.0), (4, MOVING, 20.0, 0.0),
]  # fmt: skip


def test_moves_have_stage_target_and_time_of_their_first_row() -> None:
    begun, what = ran(recorded(RUN))
    assert begun.tolist() == [True] * 5
    assert what.stage.tolist() == [MACRO, MICRO, MICRO, MACRO, MACRO]
    np.testing.assert_allclose(what.target, [50.0, 1.5e-3, 2e-3, 80.0, 20.0])
    np.testing.assert_allclose(what.start, [0.0, 1.0, 2.0, 2.5, 3.5])


def test_a_fine_move_that_was_overtaken_is_counted_but_not_begun() -> None:
    """Its row shows the carriage still on the way to where it was sent before."""
    rows = [(0, MOVING, 50.0, 0.0), (0, MOVING, 50.0, 0.0), (1, MOVING, 50.0, 0.0),
            (2, SETTLING, 50.0, 0.0), (3, FINE, 50.0, 1.0)]  # fmt: skip
    begun, what = ran(recorded(rows))
    assert begun.tolist() == [True, False, False, True]
    assert what.stage.tolist() == [MACRO, MICRO, MICRO, MICRO]


def test_a_move_back_to_the_same_place_is_one_if_the_carriage_was_not_moving() -> None:
    rows = [(0, MOVING, 50.0, 0.0), (0, SETTLING, 50.0, 0.0), (1, MOVING, 50.0, 0.0)]
    assert ran(recorded(rows))[0].tolist() == [True, True]
    assert ran(recorded([(0, MOVING, 50.0, 0.0), *rows]))[0].tolist() == [True, True]


def test_a_move_whose_index_never_shows_stands_in_the_next_ones_row() -> None:
    rows = [(0, FINE, 0.0, 1.0), (2, FINE, 0.0, 2.0)]
    begun, what = ran(recorded(rows))
    assert begun.tolist() == [True, True, True]
    np.testing.assert_allclose(what.target, [1e-3, 2e-3, 2e-3])


def test_a_timetable_has_each_moves_own_time_and_length() -> None:
    found = timetable(recorded(RUN))
    np.testing.assert_allclose(found.start, [0.0, 1.0, 2.0, 2.5, 3.5])
    np.testing.assert_allclose(found.hold, [1.0, 1.0, 0.5, 1.0, 0.5])
    assert found.end == 4.0 and found.title == "moves of the recording"
    overtaken = timetable(recorded([(0, MOVING, 50.0, 0.0), (1, MOVING, 50.0, 0.0)]))
    assert overtaken.target.tolist() == [50.0]
    np.testing.assert_allclose(overtaken.hold, [0.5])


def test_a_recording_without_moves_has_no_timetable() -> None:
    made = recorded([(0, DONE, 0.0, 0.0), (0, DONE, 0.0, 0.0)])
    assert not is_live(made)
    with pytest.raises(InputError, match="no moves"):
        timetable(made)
