"""A virtual machine that serves one program alone: it runs late where a real one is stopped."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from macromicro import connect
from macromicro.serve.alone import Alone
from macromicro.serve.hosts import HOST
from macromicro.serve.settings import ServeSettings, allow_missed_periods, patient
from tests import warm
from tests.serve.quick import TEXT
from tests.systems import linux


def test_it_waits_longer_where_nobody_said_how_long() -> None:
    late = patient(ServeSettings())
    assert (late.miss_share, late.loop_timeout, late.parent_timeout) == (1.0, 10.0, 10.0)
    assert late._replace(miss_share=0.1, loop_timeout=0.5, parent_timeout=1.0) == ServeSettings()


def test_a_twin_that_is_served_to_all_may_miss_periods_unless_its_file_says_how_many() -> None:
    late = allow_missed_periods(ServeSettings())
    assert late.miss_share == 1.0 and late._replace(miss_share=0.1) == ServeSettings()
    own = ServeSettings(miss_share=0.3)
    assert allow_missed_periods(own) == own


@pytest.mark.parametrize(
    ("name", "value"), [("miss_share", 0.3), ("loop_timeout", 2.0), ("parent_timeout", 3.0)]
)
def test_what_a_file_says_stays(name: str, value: float) -> None:
    assert getattr(patient(ServeSettings(**{name: value})), name) == value


def children() -> set[int]:
    """The processes that this one has begun."""
    tasks = Path("/proc/self/task").iterdir()
    return {int(pid) for task in tasks for pid in (task / "children").read_text().split()}


@linux
@pytest.mark.slow
def test_a_computer_that_stands_for_a_second_stops_no_move(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text(TEXT, encoding="utf-8")
    before = children()
    twin = Alone(str(file))
    try:
        with connect(HOST, twin.start(), token=twin.token) as machine:
            machine.enable()
            machine.home()
            motion = machine.move_to("42 mm", wait=False)
            (loop,) = children() - before - {warm.LOOPS.pid}
            os.kill(loop, signal.SIGSTOP)
            time.sleep(1.0)  # longer than ServeSettings().loop_timeout
            os.kill(loop, signal.SIGCONT)
            motion.wait()
            assert machine.state.position == pytest.approx(0.042, abs=4e-5)
    finally:
        twin.stop()
