"""Lines of the table, and what went wrong in two_stage."""

from __future__ import annotations

import pytest

from macromicro.report import two_stage
from macromicro.rig import codes, guard
from macromicro.rig.faults import describe
from macromicro.runs.job import Ended


def test_a_line_a_move_with_units(ended: Ended) -> None:
    lines = two_stage.table(ended)
    assert len(lines) == len(ended.moves)
    macro, micro = lines[0].cells, lines[1].cells
    assert len(macro) == len(micro) == len(two_stage.HEADINGS)
    assert macro[1:3] == ("macro", "40 mm") and macro[4] == "±0.14 mm"
    assert micro[1:3] == ("micro", "1500 um") and micro[4] == "±10 um"
    assert macro[7] == "-" and micro[7].endswith(" um") and micro[8].endswith(" um")
    assert micro[3] == f"{ended.moves[1].settling_s:.3f} s"
    assert not any("-0.0 um" in cell for line in lines for cell in line.cells)


def test_no_negative_zero(ended: Ended) -> None:
    moves = [ended.moves[1]._replace(final_error=-0.04)]
    assert two_stage.table(ended._replace(moves=moves))[0].cells[5] == "0.0 um"


def test_remarks(ended: Ended) -> None:
    found = dict(two_stage.remarks(ended))
    slow = dict(two_stage.remarks(ended._replace(wall=8.0 * ended.simulated)))
    assert "times real time" in found["speed"] and ", 0.12 times" in slow["speed"]
    assert "to within 20 um of zero in cycle 1" in found["extension"]


def test_the_verdict_counts_moves_and_names_the_worst(ended: Ended) -> None:
    moves = [m._replace(final_error=0.5e-3 if m.stage == "macro" else 0.25) for m in ended.moves]
    moves[4] = moves[4]._replace(final_error=-2.5)
    good = ended._replace(moves=moves)
    assert (
        two_stage.verdict(good)
        == f"{len(moves)} of {len(moves)} moves arrived; worst 2.5 um (move 5)"
    )
    moves[0] = moves[0]._replace(arrived_s=None, final_error=7.0)
    found = two_stage.verdict(ended._replace(moves=moves))
    assert found == f"{len(moves) - 1} of {len(moves)} moves arrived; worst 7 mm (move 1)"
    cut = two_stage.verdict(ended._replace(moves=moves[1:3], finished=False))
    assert cut == f"2 of {len(moves)} moves arrived; worst 250 nm (move 2)"


def test_the_vibration_says_after_how_many_of_the_macro_moves_it_is_told(ended: Ended) -> None:
    """One move that shook of two is not both of them, nor the first."""
    shaken = ended.vibration[0]
    found = dict(two_stage.remarks(ended._replace(vibration=[shaken._replace(move=3)])))
    assert "after move 4," in found["vibration"]
    cycle = sum(m.stage == "macro" and m.move < ended.job.setup.per_cycle for m in ended.moves)
    found = dict(two_stage.remarks(ended._replace(vibration=[shaken] * cycle)))
    assert f"after the {cycle} macro moves of a cycle" in found["vibration"]
    found = dict(two_stage.remarks(ended._replace(vibration=[shaken] * (cycle + 1))))
    assert f"after {cycle + 1} of the {cycle} macro moves" in found["vibration"]


def test_a_good_run_has_no_problems(ended: Ended) -> None:
    assert two_stage.problems(ended) == []


@pytest.mark.parametrize(("complete", "count"), [(True, 1), (False, 0)])
def test_a_move_that_did_not_arrive_is_named(ended: Ended, complete: bool, count: int) -> None:
    """A move that was cut short is another problem's matter."""
    moves = list(ended.moves)
    moves[2] = moves[2]._replace(arrived_s=None, settling_s=None, complete=complete)
    found = two_stage.problems(ended._replace(moves=moves))
    assert len(found) == count
    assert all("move 3 " in text for text in found)
    cells = two_stage.table(ended._replace(moves=moves))[2].cells
    assert cells[3] == ("did not arrive" if complete else "cut short")


def test_a_fault_and_a_run_that_did_not_finish(ended: Ended) -> None:
    watch = guard.fresh()._replace(fault=codes.TOO_HOT, value=171.2, limit=170.0, time=2.0)
    (text,) = two_stage.problems(ended._replace(finished=False, fault=describe(watch)))
    assert "too high" in text and "171 degC" in text and "cool" in text
    (text,) = two_stage.problems(ended._replace(finished=False))
    assert "did not finish" in text
