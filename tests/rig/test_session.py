"""A rig as a run sees it: one reading a period, time from zero, safe at every way out."""

from __future__ import annotations

import pytest

from macromicro.errors import InputError
from macromicro.rig.session import Fixture, Session
from macromicro.types import SAFE, Outputs, Sample


class Plain:
    """A rig that notes what is done to it; its clock began long ago."""

    channels = ("encoder",)

    def __init__(self, broken: bool = False) -> None:
        self.clock, self.time, self.done = self, 100.0, []
        self.broken = broken

    def now(self) -> float:
        return self.time

    def wait(self, dt: float) -> None:
        self.time += dt

    def read(self) -> Sample:
        self.done.append("read")
        return Sample(self.time, float(len(self.done)), 0.0, 0.0, 0.0, 0.0)

    def write(self, outputs: Outputs) -> None:
        self.done.append(outputs)

    def stop(self) -> None:
        self.done.append("stop")
        if self.broken:
            raise OSError("no answer")

    def __enter__(self) -> Plain:
        self.done.append("enter")
        return self

    def __exit__(self, *what: object) -> None:
        self.done.append("exit")


def test_one_reading_a_period_and_time_from_the_start() -> None:
    rig = Plain()
    session = Session(rig, 1e-3)
    first = session.read()
    assert session.read() == first and first.t == 0.0 and rig.done == ["read"]
    session.clock.wait(1e-3)
    assert session.read().t == pytest.approx(1e-3) and rig.done == ["read", "read"]
    assert session.clock.now() == pytest.approx(1e-3)
    session.restart()
    again = session.read()  # the same period, counted anew
    assert again.t == 0.0 and rig.done == ["read", "read"]


def test_entered_inside_itself_it_is_left_once() -> None:
    rig = Plain()
    with Session(rig, 1e-3) as session:
        with session:
            session.write(SAFE._replace(motor=4.0))
        assert rig.done[-1] == "stop" and "exit" not in rig.done
    assert rig.done.count("enter") == rig.done.count("exit") == 1
    assert rig.done[-2:] == ["stop", "exit"]


def test_it_is_left_even_if_stopping_fails() -> None:
    rig = Plain(broken=True)
    with pytest.raises(OSError, match="no answer"), Session(rig, 1e-3):
        pass
    assert rig.done[-1] == "exit"


def test_rest_is_spent_with_outputs_safe() -> None:
    """And then the laser's zero is set; without a rest nothing is done to the rig."""
    rig = Plain()
    session = Session(rig, 1e-3)
    session.cold(0.0)
    assert rig.done == []
    session.cold(0.02)
    assert rig.time == pytest.approx(100.021)
    assert rig.done[0] == rig.done[-1] == "stop"
    assert [d for d in rig.done if isinstance(d, Outputs)] == [SAFE._replace(laser_reset=1.0)]


def test_what_is_missing_is_named() -> None:
    fixture = Fixture("mine", "bench", lambda seed: Plain(), ("encoder",), 1e-3)
    assert fixture.has("encoder") and not fixture.has("encoder", "laser")
    fixture.need("this", "encoder")
    with pytest.raises(InputError, match="this needs hall, laser of the"):
        fixture.need("this", "encoder", "hall", "laser")
