"""What a drive does with its input that nobody spoke of: section "A drive" of docs/identify.md."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest
from tests.identify.late_records import record, rows, steps

from macromicro.identify import _axis_choice, _axis_drive, drive
from macromicro.identify._axis_delay import delay
from macromicro.identify.axis import late
from macromicro.identify.axis_inverse import Rows
from macromicro.identify.notices import DataWarning


def said_of(made: list[Rows], gain: float = 1.0) -> list[str]:
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        _axis_drive.warned(made, gain)
    return [str(w.message) for w in seen if w.category is DataWarning]


def test_a_force_that_acts_before_it_is_said_to() -> None:
    u = steps(2)
    made = rows(late(u, 5), u)
    assert delay(made) == 0 and delay(made, -12) == -5
    (text,) = said_of(made)
    assert re.match(r"the force acts 5 ms \(5 samples\) earlier than u: .*two clocks", text)


def test_at_the_end_of_what_is_tried_there_is_no_shift() -> None:
    u = steps(2)
    assert not any("earlier" in text for text in said_of(rows(late(u, 12), u)))
    assert any("earlier" in text for text in said_of(rows(late(u, 11), u)))


def test_a_delay_is_told_with_what_it_explains_and_a_remedy() -> None:
    u = steps(3)
    (text,) = said_of(rows(u, late(u, 20)))
    found = re.match(r"the force acts 20 ms \(20 samples\) later .* by (\d+) % on held-out", text)
    assert found is not None and 50 < int(found[1]) < 100 and "--delay fit" in text


def test_where_only_the_shifted_force_drives_it_that_is_said() -> None:
    """The force has turned before it acts: mass and friction would be below 0."""
    u = steps(4)
    (text,) = said_of(rows(u, late(u, 700)))
    assert "700 samples) later" in text and "alone gives a positive mass and friction" in text


@pytest.mark.parametrize(("most", "gain"), [(30.0, 1.0), (43.0, -4.0)])
def test_a_force_that_does_not_grow_is_told_with_its_limit(most: float, gain: float) -> None:
    u = steps(5)
    made = rows(u, np.clip(u, -most, most))
    assert _axis_drive.limit(made) == pytest.approx(most, rel=0.05)
    (text,) = said_of(made, gain)
    found = re.match(r"the force seems to saturate at u = ([\d.]+): this lowers", text)
    assert found is not None and float(found[1]) == pytest.approx(most / abs(gain), rel=0.05)
    assert "--limit" in text


def test_a_limited_force_is_cut_on_both_sides() -> None:
    u = steps(6)
    (cut,) = _axis_drive.limited(rows(u, u), 20.0)
    np.testing.assert_array_equal(cut.force, np.clip(u, -20.0, 20.0))


def test_errors_of_a_smaller_force_count_as_parts_of_it() -> None:
    u = steps(6)
    made = rows(u, u)
    assert _axis_choice.lowered(made, _axis_drive.limited(made, 0.5), "coulomb") is None


@pytest.mark.parametrize("seed", [7, 10])
def test_a_late_and_limited_force_is_both(seed: int) -> None:
    """Of one record the delay alone explains nothing that counts: the limit hides it."""
    u = steps(seed)
    both = sorted(said_of(rows(u, np.clip(late(u, 9), -30.0, 30.0))))
    assert len(both) == 2
    assert "9 samples) later" in both[0] and "seems to saturate" in both[1]


@pytest.mark.parametrize("seed", range(3))
def test_of_a_drive_that_does_as_it_is_told_nothing_is_said(seed: int) -> None:
    u = steps(seed + 20)
    assert said_of(rows(u, u, seed)) == []


def test_a_known_delay_is_no_news() -> None:
    u = steps(9)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        drive(*record(u, late(u, 15)), structure="coulomb", delay=15)
