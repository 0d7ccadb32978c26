"""Triggered captures: every kind of trigger, found in rows that come in pieces of any size."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control.live.messages import Finished
from macromicro.errors import InputError
from macromicro.place import LENGTH
from macromicro.serve import shared
from macromicro.serve.capturing import (
    COMPLETE,
    WAITING,
    Capture,
    Captured,
    Trigger,
    Wanted,
    check,
)

FORM = shared.telemetry_of((LENGTH,), ("",))  # a stage with lines
COLUMNS, SCALES, _ = FORM
INDEX = {name: k for k, name in enumerate(FORM.names)}
DT = 1e-3


class Ring:
    """A ring in which a test writes rows; "position" rises by 1 um a row from -1 mm on."""

    def __init__(self, **columns: Callable[[int], float]) -> None:
        self.shared = shared.Shared.create(6000, FORM)
        self.columns = {"t": lambda n: n * DT, "position": lambda n: n * 1e-3 - 1.0, **columns}
        self.written = 0
        self.ended: dict[int, Finished] = {}

    def write(self, rows: int) -> None:
        for _ in range(rows):
            row = [0.0] * len(COLUMNS)
            for name, value in self.columns.items():
                row[INDEX[name]] = value(self.written)
            self.shared.put(row)
            self.written += 1

    def capture(self, wanted: Wanted) -> Capture:
        return Capture(check(wanted, COLUMNS, DT), COLUMNS, SCALES, DT, self.written)

    def run(self, wanted: Wanted, pieces: int = 37, most: int = 4000) -> Captured:
        capture = self.capture(wanted)
        for _ in range(most // pieces):
            self.write(pieces)
            capture.look(self.shared, self.ended.get)
            if capture.captured is not None:
                return capture.captured
        raise AssertionError(capture.state)


def motion(n: int) -> float:
    """Motion 3 from row 500 to 800, motion 4 from there to 1100."""
    return 3.0 if 500 <= n < 800 else 4.0 if 800 <= n < 1100 else 0.0


@pytest.mark.parametrize(
    ("trigger", "row"),
    [
        (Trigger("now"), 200),
        (Trigger("edge", "position", "rising", 0.25), 1250),
        (Trigger("edge", "macro_count", "falling", 0.5), 900),
        (Trigger("edge", "macro_count", "either", 0.5), 700),
        (Trigger("level", "position", "rising", -0.9), 200),
        (Trigger("level", "macro_count", "rising", 0.5), 700),
        (Trigger("begin"), 500),
        (Trigger("end"), 800),
        (Trigger("fault"), 1000),
        (Trigger("limit"), 1100),
    ],
)
@pytest.mark.parametrize("pieces", [1, 37])
def test_each_trigger_finds_its_row(trigger: Trigger, row: int, pieces: int) -> None:
    ring = Ring(
        motion=motion,
        fault=lambda n: 5.0 * (n >= 1000),
        macro_position=lambda n: float(700 <= n < 900),
    )
    ring.ended = {3: Finished(3, "done", 0, 0, {}), 4: Finished(4, "limit", 0, 0, {})}
    ring.write(200)
    trigger = trigger._replace(signal=trigger.signal.replace("macro_count", "macro_position"))
    found = ring.run(Wanted(("position", "motion"), trigger, 0.1, 0.05), pieces)
    assert found.time == pytest.approx(row * DT)
    assert found.names == ("t", "position", "motion") and found.units == ("s", "mm", "1")
    assert found.values.shape == (3, 151) and found.values[0, 100] == 0.0
    assert found.values[1] == pytest.approx((np.arange(row - 100, row + 51)) * 1e-3 - 1.0)


def test_a_limit_switch_is_a_limit_and_an_end_is_waited_for() -> None:
    ring = Ring(motion=lambda n: 3.0 * (n < 50), limit_high=lambda n: float(n > 300))
    capture = ring.capture(Wanted(("position",), Trigger("limit"), 0.0, 0.01))
    ring.write(100)
    capture.look(ring.shared, ring.ended.get)
    assert capture.state == WAITING  # how motion 3 has ended is not told yet
    ring.write(300)
    capture.look(ring.shared, ring.ended.get)
    assert capture.state == WAITING
    ring.ended[3] = Finished(3, "stopped", 0, 0, {})
    capture.look(ring.shared, ring.ended.get)
    assert capture.captured is not None and capture.captured.time == pytest.approx(0.301)


@given(
    st.lists(st.sampled_from([0.0, 1.0, 2.0]), min_size=2, max_size=60),
    st.integers(1, 20),
    st.sampled_from(["rising", "falling", "either"]),
)
def test_no_edge_is_missed_between_two_looks(values: list[float], pieces: int, slope: str) -> None:
    ring = Ring(motor=lambda n: values[n] if n < len(values) else math.nan)
    capture = ring.capture(Wanted(("motor",), Trigger("edge", "motor", slope, 1.0), 0.0, 0.0))
    for _ in range(len(values) // pieces + 1):
        ring.write(pieces)
        capture.look(ring.shared, ring.ended.get)
    ups = [k for k in range(1, len(values)) if values[k - 1] < 1.0 <= values[k]]
    downs = [k for k in range(1, len(values)) if values[k - 1] > 1.0 >= values[k]]
    wanted = min({"rising": ups, "falling": downs, "either": ups + downs}[slope], default=-1)
    assert (capture.state == COMPLETE) is (wanted >= 0)
    if capture.captured is not None:
        assert capture.captured.time == pytest.approx(wanted * DT)


def test_a_repeated_one_begins_again_behind_its_rows() -> None:
    ring = Ring(motor=lambda n: float(n % 100 >= 50))
    wanted = Wanted(("motor",), Trigger("edge", "motor", "rising", 0.5), 0.01, 0.12, repeat=True)
    capture, times = ring.capture(wanted), []
    for _ in range(300):
        ring.write(3)
        capture.look(ring.shared, ring.ended.get)
        if capture.captured is not None and capture.captured.time not in times:
            times.append(capture.captured.time)
    assert times == pytest.approx([0.05, 0.25, 0.45, 0.65])
    assert capture.number == 4 and capture.state != COMPLETE


def test_a_ring_that_has_gone_on_and_a_new_loop_begin_again() -> None:
    ring = Ring(motion=lambda n: float(n > 10))
    capture = ring.capture(Wanted(("motion",), Trigger("begin"), 0.0, 3.0))
    ring.write(20)
    capture.look(ring.shared, ring.ended.get)
    assert capture.state == "triggered"
    ring.write(9000)
    capture.look(ring.shared, ring.ended.get)
    assert capture.state == WAITING and capture.captured is None
    other = Ring()
    other.write(50)
    capture.look(other.shared, other.ended.get)
    assert capture.state == WAITING


LONG = (shared.ROWS - 4000) * DT


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        (Wanted(()), "1 to 8 names"),
        (Wanted(("t",) * 9), "1 to 8 names"),
        (Wanted(("velocity",)), "position"),
        (Wanted(("t",), Trigger("edge", "", "rising")), "position"),
        (Wanted(("t",), Trigger("noon")), "now, edge, level, begin, end, fault, limit"),
        (Wanted(("t",), Trigger("edge", "t", "flat")), "rising, falling, either"),
        (Wanted(("t",), Trigger("level", "t", "either")), "rising, falling"),
        (Wanted(("t",), Trigger("edge", "t", "rising", math.nan)), "a finite number"),
        (Wanted(("t",), before=-1.0), f"0 to {LONG:g} s"),
        (Wanted(("t",), after=math.inf), f"0 to {LONG:g} s"),
        (Wanted(("t",), before=LONG, after=1.0), f"at most {LONG:g} s together"),
    ],
)
def test_what_is_accepted_is_told(wanted: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        check(wanted, COLUMNS, DT)
