"""Recordings beside each other: which moves are the same, where columns part."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from macromicro.columns import Column
from macromicro.design.response import MoveResult
from macromicro.recording import Recording
from macromicro.report import _comparison_words, comparison
from macromicro.report.comparison import Side

COLUMNS = (Column("t", "s", ""), Column("laser", "um", ""), Column("fan", "1", "", "i1"))


def recording(laser: list[float]) -> Recording:
    rows = len(laser)
    return Recording.from_arrays(COLUMNS, [1e-3 * np.arange(rows), laser, [1] * rows], 1e-3, {})


def move(k: int, settling: float | None = 0.5, **other: object) -> MoveResult:
    return MoveResult(
        k, "micro", 1000.0, "um", 1.0 * k, settling, settling, 10.0, 1.0, 0.5, None, None, None,
        None, True,
    )._replace(**other)  # fmt: skip


def found(*moves: list[MoveResult], laser: list[list[float]] | None = None) -> object:
    lasers = laser or [[0.0, 1.0]] * len(moves)
    sides = [Side(chr(97 + k), Path("x"), recording(lasers[k]), its) for k, its in enumerate(moves)]
    return comparison.compare(sides)


def test_columns_part_where_they_first_differ() -> None:
    """NaN in both is no difference; NaN in one is."""
    nan = math.nan
    done = found([], [], [], laser=[[0.0, nan, 2.0, 3.0], [0.0, nan, 2.5, nan], [0.0, nan, 2.0]])
    first, second = done.partings
    assert (first.rows, first.t, first.columns) == (4, 0.002, ("laser",))
    assert first.largest["laser"] == 0.5 and first.rms["laser"] == pytest.approx(0.5 / math.sqrt(2))
    assert (second.rows, second.t, second.columns) == (3, None, ())
    texts = dict(_comparison_words.remarks(done))
    assert texts["c"] == "equal to a in all 2 shared columns, bit for bit; it is 0.001 s shorter"


def test_another_structure_is_said() -> None:
    """Compared where both are: of another period, with other units and columns."""
    t = 2e-3 * np.arange(3)
    columns = (COLUMNS[0], COLUMNS[1], Column("fan", "V", ""), Column("x", "m", ""))
    slow = Recording.from_arrays(columns, [t, [0.0, 2.0, 8.0], t, t], 2e-3, {})
    quick = Recording.from_arrays(
        (*COLUMNS, Column("motor", "V", "")), [np.arange(5) / 1e3, range(5), range(5), range(5)],
        1e-3, {},
    )  # fmt: skip
    done = comparison.compare([Side("a", Path("a"), quick, []), Side("b", Path("b"), slow, [])])
    assert _comparison_words.columns(done) == [("laser", "um", "2.309", "4", "0.004 s")]
    assert [text for _, text in _comparison_words.remarks(done)] == [
        "differs from a from 0.004 s on, first in laser; it is 0.001 s longer",
        "lacks columns of a: motor",
        "has columns that a lacks: x",
        "other units, so not compared: fan [V], there [1]",
        "a period of 0.002 s, not 0.001 s: compared every 0.002 s",
        "no moves to compare",
    ]
    told = comparison.content(done)
    assert [r["period_s"] for r in told["recordings"]] == [1e-3, 2e-3]
    assert told["columns"]["laser"]["largest_at_s"] == [4e-3]
    assert told["structure"] == [
        {"compared_every_s": 2e-3, "only_first": ("motor",), "only_here": ("x",),
         "units": {"fan": ("1", "V")}},
    ]  # fmt: skip


def test_other_moves_are_not_compared() -> None:
    """Of another stage or target, or none at all."""
    mine = [move(0), move(1), move(2)]
    other = [move(0, 0.6), move(1, target=900.0)]
    done = found(mine, other, laser=[[0.0, 1.0], [0.0, 2.0]])
    assert done.moves[0].difference("settling_s", 1) == pytest.approx(0.1)
    assert [m.results[1] is None for m in done.moves] == [False, True, True]
    lines = _comparison_words.table(done)
    assert lines[0][3:5] == ("0.500 s", "+0.100") and lines[1][4] == "other move"
    texts = [text for _, text in _comparison_words.remarks(done)]
    assert "2 of 3 moves differ or are missing here" in texts


def test_a_move_that_never_settles_is_said() -> None:
    done = found([move(0, None), move(1)], [move(0, 0.6), move(1, None)])
    lines = _comparison_words.table(done)
    assert lines[0][3:5] == ("never", "now 0.600 s") and lines[1][3:5] == ("0.500 s", "never")


def test_the_page_has_the_columns_that_vary(tmp_path: Path) -> None:
    """The main ones, and others unless they are constant."""
    comparison.write(tmp_path / "out", found([], [], laser=[[0.0, 1.0], [0.0, 2.0]]))
    text = (tmp_path / "out" / comparison.PAGE).read_text()
    assert '"laser"' in text and '"fan"' not in text


def test_names_are_all_different() -> None:
    """The folders' or files'; the whole paths where those agree."""
    names = comparison._names
    assert names([Path("r/a"), Path("r/b/recording.h5"), Path("c.h5")]) == ["a", "b", "c"]
    assert names([Path("r/a"), Path("s/a")]) == ["r/a", "s/a"]
    assert names([Path("r/a")] * 2) == ["r/a", "r/a (2)"]
