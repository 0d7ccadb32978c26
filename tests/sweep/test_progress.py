"""What a person sees of a sweep."""

from __future__ import annotations

import io
import sys

import pytest

from macromicro.sweep import progress
from macromicro.sweep.progress import Pace, ranges, span
from macromicro.sweep.results import Range, Written


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
    monkeypatch.setattr(progress.time, "monotonic", lambda: now)
    pace = Pace()
    pace.begin(100, 20)
    now = 150.0
    pace.add(10, 0)
    assert pace.words() == "30 of 100"
    now = 154.0
    pace.add(20, 3)
    assert pace.words() == "50 of 100, 3 impossible, 5/s, 10 s left"


def test_plain_lines_where_there_is_no_terminal(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One at the beginning, and then not more than one in `EVERY` seconds."""
    now = 0.0
    monkeypatch.setattr(progress.time, "monotonic", lambda: now)
    with progress.progress() as shown:
        shown.begin(1000, 10)
        for _ in range(25):
            now += 1.0
            shown.report(10, 0)
    said = capsys.readouterr().err.splitlines()
    assert said == [
        "1000 variants, 10 finished before",
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
    with progress.progress() as shown:
        shown.begin(40, 0)
        shown.report(40, 2)
    text = terminal.getvalue()
    assert "100 %" in text and "40 of 40, 2 impossible" in text


def test_ranges_of_the_metrics() -> None:
    written = Written(10, 2, "", {"a": Range(10, 1.0, 2.0, 3.0), "b": Range(7, -1.0, 0.5, 2.0)})
    assert list(ranges(written, {"a": "s", "b": "", "c": "m"})) == [
        "a  1 to 3 s, mean 2",
        "b  -1 to 2, mean 0.5, a number in 7 of 10",
        "c  never a number",
    ]
