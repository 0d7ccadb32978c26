"""The bar on stderr."""

from __future__ import annotations

import io
import sys

import pytest

from macromicro.drawing import bar
from macromicro.drawing.bar import Pace, progress, progress_bar, span


def test_it_shows_share_and_description_on_stderr_and_goes() -> None:
    with progress_bar() as shown:
        task = shown.add_task("[one] left", total=4.0)
        shown.update(task, advance=1.0)
        assert shown.console.stderr
        assert shown.tasks[0].percentage == 25.0
        texts = [column.render(shown.tasks[0]) for column in (shown.columns[0], shown.columns[2])]
        assert [str(text).strip() for text in texts] == ["25 %", "[one] left"]
    assert shown.live.transient


@pytest.mark.parametrize(
    "seconds, words",
    [
        (0.2, "0 s"),
        (59.4, "59 s"),
        (59.6, "1 min 0 s"),
        (3599.0, "59 min 59 s"),
        (18_660.0, "5 h 11 min"),
        (276_480.0, "3.2 days"),
    ],
)
def test_span(seconds: float, words: str) -> None:
    assert span(seconds) == words


def test_rate_and_time_left_are_of_this_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """From the first block on, which may have waited for a compiler: 20 in 4 s, 50 left in 10 s."""
    now = 100.0
    monkeypatch.setattr(bar.time, "monotonic", lambda: now)
    pace = Pace()
    pace.begin(100, 20)
    now = 150.0
    pace.add(10, 0)
    assert pace.words() == "30 of 100"
    now = 154.0
    pace.add(20, 3)
    assert pace.words() == "50 of 100, 3 infeasible, 5/s, 10 s left"


def test_plain_lines_where_there_is_no_terminal(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One at the beginning, and then not more than one in `EVERY` seconds."""
    now = 0.0
    monkeypatch.setattr(bar.time, "monotonic", lambda: now)
    with progress("fake", "variants") as shown:
        shown.begin(1000, 10)
        for _ in range(25):
            now += 1.0
            shown.add(10, 0)
    said = capsys.readouterr().err.splitlines()
    assert said == [
        "fake: 1000 variants, 10 finished before",
        "110 of 1000, 10/s, 1 min 29 s left",
        "210 of 1000, 10/s, 1 min 19 s left",
    ]


def test_a_bar_in_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "100")
    with progress("fake", "variants") as shown:
        shown.begin(40, 0)
        shown.add(40, 2)
    text = terminal.getvalue()
    assert "100 %" in text and "40 of 40, 2 infeasible" in text


def test_what_counts_up_by_itself_needs_no_beginning(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = 0.0
    monkeypatch.setattr(bar.time, "monotonic", lambda: now)
    with progress("tuning", "designs") as shown:
        shown.reach(10, 40, "least cost 3")
        now = 20.0
        shown.reach(20, 40, "least cost 2")
    assert capsys.readouterr().err.splitlines() == [
        "tuning: 40 designs",
        "20 of 40, least cost 2, 0.5/s, 40 s left",
    ]
