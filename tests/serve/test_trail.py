"""Who ordered what: each entry whole, on one line, and no more of them than a disk bears."""

from __future__ import annotations

import logging
import math

import pytest

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Event, Finished, Refused
from macromicro.control.live.parameters import SoftLimits
from macromicro.serve._ledger import BURST, Trail


def told(caplog: pytest.LogCaptureFixture) -> list[tuple[int, str]]:
    return [(record.levelno, record.getMessage()) for record in caplog.records]


@pytest.fixture(autouse=True)
def heard(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "macromicro.serve")


def test_orders_faults_and_ends_have_their_levels(caplog: pytest.LogCaptureFixture) -> None:
    trail = Trail()
    trail.order(1.0, "scpi 127.0.0.1:7", m.MoveTo(0.042), Accepted(3))
    trail.order(1.1, "web ::1 #2", m.Enable(), Refused("no control", "take it"))
    trail.event(Event(1.2, "mode", "moving-macro", "fault", "stuck", {"client": "x", "n": 1}))
    trail.end(Finished(3, m.FAULTED, 0.01, 1e-5, {}), 1.3)
    trail.client("token", "scpi 127.0.0.1:7", "this is not the token")
    assert told(caplog) == [
        (
            logging.INFO,
            "order: MoveTo by scpi 127.0.0.1:7 (position 0.042, replace False, motion 3)",
        ),
        (logging.INFO, "order: Enable by web ::1 #2 (refused no control)"),
        (logging.ERROR, "mode: stuck by x (from moving-macro, to fault, n 1)"),
        (logging.WARNING, "end: motion 3 fault (position_m 0.01)"),
        (logging.WARNING, "token: this is not the token by scpi 127.0.0.1:7"),
    ]


def test_what_is_noted_is_in_the_units_that_people_read(caplog: pytest.LogCaptureFixture) -> None:
    trail = Trail()
    own = SoftLimits()
    trail.order(1.0, "own", m.MoveMicro(1.5e-3), Accepted(3))
    trail.order(1.0, "own", m.SetGains((("pi.kp", 1500.0), ("no.such", 1.0))), Accepted())
    trail.order(1.0, "own", m.SetLimits(own), Accepted())
    facts = {"pi.kp": {"old": 3000.0, "new": 1500.0}}
    trail.event(Event(1.2, "gains", "ready", "ready", "set gains", facts))
    changed = {"micro_high": {"old": 3.5e-3, "new": 3e-3}, "whole_high": {"old": 0.2, "new": 0.1}}
    trail.event(Event(1.2, "limits", "ready", "ready", "set limits", changed))
    lines = [line for _, line in told(caplog)]
    assert "(position 1.5, replace False, motion 3)" in lines[0]
    assert "('pi.kp', 1.5), ('no.such', 1.0)" in lines[1]
    assert "micro_high=3.5, " in lines[2] and "whole_high=0.2169" in lines[2]
    assert "pi.kp old 3.0, new 1.5" in lines[3]
    assert "micro_high old 3.5, new 3.0, whole_high old 0.2, new 0.1" in lines[4]


def test_what_clients_choose_is_escaped_and_cut(caplog: pytest.LogCaptureFixture) -> None:
    trail = Trail()
    trail.client("client", "a\n<0>b\x1b[2J" + "x" * 5000, "connected")
    (_, line), *_ = told(caplog)
    assert line.isprintable() and "\\n<0>b\\x1b[2J" in line and len(line) < 1100


def test_a_flood_is_cut_off_and_hides_nothing_that_was_done(
    caplog: pytest.LogCaptureFixture,
) -> None:
    trail = Trail()
    trail.begin()
    for _ in range(3 * int(BURST)):
        trail.order(1.0, "pest", m.Enable(), Refused("no control", ""))
    assert BURST <= len(caplog.records) < BURST + 50
    trail.order(2.0, "own", m.Home(), Accepted(1))
    trail.event(Event(2.0, "mode", "ready", "homing", "home", {}))
    lines = [line for _, line in told(caplog)[-3:]]
    assert lines[0].endswith("entries left out")
    assert lines[1] == "order: Home by own (motion 1)" and lines[2].startswith("mode: home")
    found = trail.take()
    assert found[-2].who == "own" and math.isclose(found[-2].t, 2.0) and not trail.take()
    trail.end_recording()
    trail.order(3.0, "own", m.Home(), Accepted(2))
    assert not trail.take()
