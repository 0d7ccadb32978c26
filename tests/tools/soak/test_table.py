"""The table: medians, leaks, and its place in a document."""

from __future__ import annotations

import math
from collections import Counter
from types import SimpleNamespace
from typing import Any

import pytest

from soak import table
from soak.campaign import Round
from soak.victim import Load


def loads(slope: float, files: int = 0) -> list[tuple[float, Load]]:
    """`slope` [MB] a sample for the server; a descriptor more every sample, or none."""
    return [
        (float(k), Load(round(1e6 * (90 + slope * k)), 15 + files * k, 200_000_000, 8))
        for k in range(40)
    ]


def test_what_grows_is_a_leak_and_what_stands_is_none() -> None:
    assert table.leaks(loads(0.01)) == []
    assert "memory grew" in table.leaks(loads(1.0))[0]
    assert "descriptors" in table.leaks(loads(0.0, files=1))[0]
    assert table.growth(loads(1.0))[0] == pytest.approx(20.0)
    assert math.isnan(table.growth(loads(0.0)[:5])[0])


def campaign(**rest: Any) -> Any:
    subject = SimpleNamespace(name="slide")
    given = {"verdicts": [], "loads": loads(0.0), "outcomes": Counter(), "homings": 0, "checked": 0,
             "missed": 0.0, "busy": 0, "unseen": [], "scale": 1e3, "unit": "MM",
             "victim": SimpleNamespace(subject=subject)}  # fmt: skip
    return SimpleNamespace(**{**given, **rest})


def test_a_row_for_each_fault_and_a_line_for_what_is_unexplained() -> None:
    rounds = [
        Round("encoder-jump", "MOVE", 11, 0.0, "It jumped.", "fault"),
        Round("encoder-jump", "MOVE", 11, 0.002, "It jumped.", "fault"),
        Round("laser-lost", "MOVE", 0, math.nan, "", "done"),
        Round("none", "MOVE", 0, math.nan, "", "done"),
    ]
    text = table.part(campaign(unseen=[0.007]), rounds, ["a surprise"])
    assert "**Slide**" in text
    assert "| encoder-jump | 2 | 2 | 1.0 | 2.0 | It jumped. |" in text
    assert "| 1 | 0 | - | - | nothing |" in text and "| none |" not in text
    assert "1 times, at most 7 mm off" in text
    assert "- Unexplained: 1." in text and "- **unexplained**: a surprise" in text
