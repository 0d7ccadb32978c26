"""Two rigs as the loop drives them: the simulated pair's moves, lines, limits and times."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import pytest
from tests.serve.group.bed import PLOTTER, Bed

from macromicro.control.live import messages as m
from macromicro.machines.guard_words import OTHER_AXIS
from macromicro.machines.rig import CompiledTwin
from macromicro.types import SAFE

LINED = """machine = "xy"
[x.switches]
limits = "both"
home = "below"
[x.homing]
on = "home+index"
[x.amplifier]
enable = "line"
fault = "line"
enable_time = "10 ms"
[x.encoder]
index_pulse = "turn"
[x.timing]
period = "0.25 ms"
delay = "0.05 ms"
[y.timing]
period = "0.25 ms"
delay = "0.05 ms"
"""


def test_rigs_are_moved_as_the_simulated_pair(tmp_path: Path) -> None:
    """Four periods of both laws in each of the loop; noise is all that differs."""
    rigs, pair = Bed(real=True), Bed()
    assert rigs.rig.control.number == pair.rig.control.number == 4
    for bed in (rigs, pair):
        assert bed.done(m.MovePoint({"x": 0.05, "y": 0.03})).outcome == m.DONE
        assert isinstance(bed.ask(m.MovePoint({"x": 0.15, "y": 0.01})), m.Accepted)
        bed.run(150)
        bed.ask(m.Stop())
        bed.run(2000, to_end=True)
        assert bed.mode == "stopped"
    assert len(rigs.places) == len(pair.places)
    assert rigs.aims == pair.aims
    for mine, theirs in zip(rigs.places, pair.places, strict=True):
        assert mine == pytest.approx(theirs, abs=2e-6)


def test_time_passes_for_both_at_once_whether_they_are_led_or_not() -> None:
    bed = Bed(PLOTTER, real=True)
    for request in (m.Jog("x", 0.01), m.Disable()):
        assert isinstance(bed.ask(request), m.Accepted)
        before = [twin.tick for twin in bed.twins]
        bed.run(5)
        assert [twin.tick - n for twin, n in zip(bed.twins, before, strict=True)] == [20, 20]
    assert all(twin._outputs.motor == 0.0 for twin in bed.twins)


@pytest.mark.slow
class Noted(CompiledTwin):
    """Notes in which order the two are driven."""

    order: ClassVar[list[int]] = []

    def __init__(self, kind: Any, tree: Any, seed: int) -> None:
        super().__init__(kind, tree, seed)
        self.number = seed

    def write(self, outputs: Any) -> None:
        self.order.append(self.number)
        super().write(outputs)


def test_two_that_are_off_pass_each_control_period_together() -> None:
    bed = Bed(PLOTTER, real=True, twin=Noted)
    bed.ask(m.Disable())
    bed.run(2)
    Noted.order.clear()
    bed.run(1)
    assert Noted.order == [0, 1] * bed.rig.control.number


def test_one_that_is_off_or_waits_keeps_the_effort_off_both() -> None:
    bed = Bed()
    x, y = bed.pair.courses
    x = x._replace(aim=x.aim._replace(position=x.aim.position + 1e-3))
    bed.rig.drive((x, y))
    assert bed.rig.control.efforts[0] != 0.0
    for other, enable in ((y._replace(waiting=True), 1.0), (y._replace(on=False), 0.0)):
        bed.rig.drive((x, other))
        assert bed.rig.control.efforts == [0.0, 0.0] and bed.rig.control.enable == enable


def test_a_fault_of_one_that_is_off_is_told_to_the_other() -> None:
    bed = Bed()
    bed.ask(m.Disable())
    bed.run(300)
    control, (x, y) = bed.rig.control, bed.rig._seen()
    bed.rig._read = (x, y._replace(position=y.position + 0.01))
    bed.rig.drive(bed.pair.courses)
    assert control.tripped and control.faulty == 1
    assert [watch.fault == OTHER_AXIS for watch in control.watches] == [True, False]


def test_lines_are_read_guarded_and_homed_on(tmp_path: Path) -> None:
    (tmp_path / "lined.toml").write_text(LINED)
    bed = Bed(tmp_path / "lined.toml", known=False, real=True)
    x, y = bed.twins
    assert bed.done(m.Home()).outcome == m.DONE
    assert bed.pair._leds[0].state.frame.offset == 0.0  # the index pulse is where 0 is
    end = bed.done(m.MovePoint({"x": 0.05, "y": 0.03}))
    assert end.outcome == m.DONE and bed.place == pytest.approx((0.05, 0.03), abs=1e-4)
    assert bed.rig.lines[0].enabled == 1.0 and bed.rig.lines[1].enabled == 1.0
    assert isinstance(bed.ask(m.MovePoint({"x": 0.1, "y": 0.06})), m.Accepted)
    bed.run(60)
    assert x._outputs.motor != 0.0 and y._outputs.motor != 0.0
    x.injected["drive_fault"] = 1.0
    bed.run(200)
    assert bed.rig.control.tripped and bed.rig.control.faulty == 0
    assert x._outputs.motor == y._outputs.motor == 0.0 and x._outputs.enable == 0.0


class Later(CompiledTwin):
    """Its clock began long before, at another time on each axis."""

    made = 0

    def __init__(self, *what: Any) -> None:
        super().__init__(*what)
        Later.made += 1
        self.began = 1000.0 * Later.made

    def read(self) -> Any:
        return super().read()._replace(t=self.began + self.tick * self.dt)


def test_time_begins_with_the_first_reading_of_each() -> None:
    bed = Bed(real=True, twin=Later)
    assert [twin.began for twin in bed.twins] == [1000.0, 2000.0]
    assert bed.done(m.MovePoint({"x": 0.05, "y": 0.03})).outcome == m.DONE
    seen = bed.rig.read()
    assert seen.t == bed.rig.shown[1].t == pytest.approx(bed.twins[0].tick * bed.twins[0].dt)
    bed.twins[1].pitch = -1.0  # it counts the wrong way
    assert isinstance(bed.ask(m.MovePoint({"x": 0.02, "y": 0.02})), m.Accepted)
    bed.run(500)
    assert bed.rig.control.tripped and bed.rig.control.faulty == 1
    assert seen.t < bed.rig.control.watches[1].time <= bed.rig.read().t


def test_soft_limits_of_each_hold() -> None:
    bed = Bed(real=True)
    refused = bed.ask(m.MovePoint({"x": 0.05, "y": 0.09}))
    assert isinstance(refused, m.Refused) and refused.reason.startswith("y: position 90")


class Stuck(OSError):
    pass


def test_both_are_stopped_and_left_whatever_the_first_does() -> None:
    bed = Bed(real=True)
    assert isinstance(bed.ask(m.MovePoint({"x": 0.05, "y": 0.03})), m.Accepted)
    x, y = bed.twins
    left = []
    with pytest.raises(Stuck), bed.rig:
        bed.run(30)
        assert x._outputs.motor != 0.0 and y._outputs.motor != 0.0

        def stuck() -> None:
            raise Stuck

        x.stop = stuck  # type: ignore[method-assign]
        for name, twin in (("x", x), ("y", y)):
            twin.__class__ = type("Left", (type(twin),), {
                "__exit__": lambda self, *error, name=name: left.append(name)
            })  # fmt: skip
        with pytest.raises(Stuck):
            bed.rig.stop()
        assert y._outputs == SAFE
    assert sorted(left) == ["x", "y"]


def test_one_that_is_not_to_be_entered_leaves_none_open() -> None:
    bed = Bed(real=True)
    x, y = bed.twins
    left = []

    def entered(self: object) -> None:
        raise Stuck

    y.__class__ = type("Shut", (type(y),), {"__enter__": entered})
    x.__class__ = type("Left", (type(x),), {"__exit__": lambda self, *error: left.append("x")})
    with pytest.raises(Stuck), bed.rig:
        raise AssertionError
    assert left == ["x"]
