"""The judge finds what is planted in a recording."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from macromicro.control.live.messages import DISABLED, FAULT, HOLDING, READY
from macromicro.recorder import Recorder
from macromicro.serve.shared import COLUMNS, INDEX
from soak.judge import Verdict, judge

Change = Callable[[np.ndarray], None]


def verdict(path: Path, change: Change, **more: Any) -> Verdict:
    block = np.zeros((len(COLUMNS), 100))
    block[INDEX["t"]] = np.arange(100) * 1e-3
    block[INDEX["mode"]] = HOLDING
    block[INDEX["ctrl"]] = 1.5
    change(block)
    with Recorder(path, COLUMNS, 100, 1e-3, {}) as recorder:
        recorder.append(block)
    return judge(path, **more)


def test_a_good_recording_has_nothing(tmp_path: Path) -> None:
    def motions(block: np.ndarray) -> None:
        block[INDEX["motion"], 10:40] = 1
        block[INDEX["motion"], 50:60] = 2

    found = verdict(tmp_path / "a.h5", motions)
    assert found == Verdict(100, 0, 0, 0, 0, (), frozenset({1, 2}))


def test_a_led_stage_is_held_when_ready_and_shows_an_effort_a_row_late(tmp_path: Path) -> None:
    def change(off: int) -> Change:
        def changed(block: np.ndarray) -> None:
            block[INDEX["mode"]] = READY
            block[INDEX["motor"]] = 7.0
            block[INDEX["ctrl"]] = 0.0
            block[INDEX["mode"], 50:] = DISABLED
            block[INDEX["motor"], off:] = 0.0

        return changed

    assert verdict(tmp_path / "a.h5", change(51), most=10.0, led=True).unsafe == 0
    assert verdict(tmp_path / "b.h5", change(52), most=10.0, led=True).unsafe == 1
    assert verdict(tmp_path / "c.h5", change(51), most=6.0, led=True).illegal == 51


def planted(name: str) -> Change:
    def change(block: np.ndarray) -> None:
        if name == "gaps":
            block[INDEX["t"], 50:] += 1e-3
        elif name == "illegal":
            block[INDEX["motor"], 7] = 5.1
        elif name == "torn":
            block[INDEX["motion"], [3, 5]] = 1
        elif name == "left on":
            block[INDEX["fault"], 20:] = 3
        elif name == "off":
            block[INDEX["mode"], 20:30] = DISABLED
        elif name == "ready":
            block[INDEX["mode"], 20:30] = READY
        else:
            block[INDEX["mode"], 20:] = FAULT
            block[INDEX["ctrl"], 20:] = 0.0
            block[INDEX["fan"], 20:] = 1.0

    return change


@pytest.mark.parametrize(
    ("name", "field", "number"),
    [("gaps", "gaps", 1), ("illegal", "illegal", 1), ("torn", "torn", 1), ("left on", "unsafe", 80),
     ("off", "unsafe", 10), ("ready", "unsafe", 10), ("fan", "unsafe", 80)],
)  # fmt: skip
def test_what_is_wrong_is_counted(name: str, field: str, number: int, tmp_path: Path) -> None:
    assert getattr(verdict(tmp_path / "a.h5", planted(name)), field) == number


def test_faults_are_listed_as_they_began_and_clock_faults_are_no_gaps(tmp_path: Path) -> None:
    def change(block: np.ndarray) -> None:
        block[INDEX["ctrl"]] = 0.0
        block[INDEX["fault"], 10:20] = 3
        block[INDEX["fault"], 30:40] = 14
        block[INDEX["t"], 30:40] += 3600.0

    found = verdict(tmp_path / "a.h5", change)
    assert (found.faults, found.gaps, found.unsafe) == ((3, 14), 0, 0)


@pytest.mark.parametrize("what", ["stands", "none"])
def test_a_clock_that_stands_is_no_gap_and_hides_none(tmp_path: Path, what: str) -> None:
    def clock(lost: int) -> Change:
        def change(block: np.ndarray) -> None:
            block[INDEX["t"], 60:] += lost * 1e-3
            block[INDEX["t"], 30:50] = block[INDEX["t"], 29] if what == "stands" else np.nan

        return change

    assert verdict(tmp_path / "a.h5", clock(0)).gaps == 0
    assert verdict(tmp_path / "b.h5", clock(2)).gaps == 1
