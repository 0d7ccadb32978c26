"""The table in the terminal."""

from __future__ import annotations

import re

import pytest

from macromicro.report import terminal, two_stage
from macromicro.runs.job import Ended


@pytest.mark.parametrize("columns", [40, 60, 80, 200])
def test_no_cell_is_cut_up_in_a_narrow_terminal(
    columns: int, ended: Ended, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", str(columns))
    terminal.show(two_stage.report(ended, ""), ended.job.out)
    shown = re.sub(r"\x1b\[[0-9;]*m", "", capsys.readouterr().out).splitlines()
    for line in two_stage.table(ended):
        assert any(all(cell in text for cell in line.cells) for text in shown), line.cells
    assert max(map(len, shown[: len(two_stage.table(ended)) + 2])) <= max(columns, 80)
