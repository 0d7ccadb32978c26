"""What breaks on a machine of one stage ends soon, in a reason, and ends trust."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Finished, Refused

from .bed import Bed

MACHINES = Path(__file__).parents[3] / "examples" / "machines"
ENDLESS = """
machine = "rotary"
[load]
ends = "none"
inertia = "0.012 kg*m^2"
"""


class Broken(Bed):
    """A stage on a rig of a user's, whose sensor and actuator can be broken while it runs."""

    def __init__(self, file: Path) -> None:
        super().__init__(file, real=True)
        self.per_count, self.gain, self.dither = 1.0, 1.0, 0.0
        self.jump, self.silent = 0.0, False
        self.true: float | None = None
        self.count, self.effort = 0.0, 0.0
        self._chance = np.random.default_rng(1)
        self._read, self._write = self.twin.read, self.twin.write
        self.twin.read, self.twin.write = self.read, self.write  # type: ignore[method-assign]
        self.run(2)

    def read(self) -> Any:
        seen = self._read()
        true = seen.encoder
        self.count += 0.0 if self.true is None else (true - self.true) * self.per_count
        if self.true is None:
            self.count = true
        self.true = true
        self.count += self.jump
        self.jump = 0.0
        shown = float(round(self.count)) + float(self._chance.random() < self.dither)
        return seen._replace(encoder=math.nan if self.silent else shown)

    def write(self, outputs: Any) -> None:
        self.effort = outputs.motor
        self._write(outputs._replace(motor=outputs.motor * self.gain))

    @property
    def moved(self) -> float:
        """Where the stage truly is, m or rad."""
        assert self.true is not None
        return self.true * float(self.tree.encoder.pitch)

    @property
    def off(self) -> float:
        """How far the position shown is from the true one."""
        return float(self.machine.view().position) - self.moved

    @property
    def trusted(self) -> bool:
        return bool(self.machine.view().trusted)


def ready(name: str) -> Broken:
    bed = Broken(MACHINES / f"{name}.toml")
    assert isinstance(bed.ask(m.Enable()), Accepted)
    if bed.machine.searches:
        assert bed.end(m.Home()).outcome == m.DONE
    return bed


@pytest.mark.parametrize(
    ("name", "dead"),
    [
        ("printer", "encoder"),
        ("servo", "motor"),
        pytest.param("screw", "encoder", marks=pytest.mark.slow),
        pytest.param("stage", "motor", marks=pytest.mark.slow),
    ],
)
def test_a_homing_without_encoder_or_motor_ends_soon_with_the_reason(name: str, dead: str) -> None:
    """Nor is the stage driven to its other end, which it would lean on for minutes."""
    bed = Broken(MACHINES / f"{name}.toml")
    bed.per_count, bed.gain = (0.0, 1.0) if dead == "encoder" else (1.0, 0.0)
    bed.ask(m.Enable())
    began, start = bed.twin.tick, bed.moved
    end = bed.end(m.Home())
    assert end.outcome == m.FAULTED and not bed.trusted
    assert bed.fault is not None and bed.fault.name in ("stuck", "following error")
    assert (bed.twin.tick - began) * bed.twin.dt < 3.0
    assert bed.effort == 0.0
    bed.run(200)
    way = bed.tree.load.stop_high - bed.tree.load.stop_low
    assert abs(bed.moved - start) < 0.25 * way


@pytest.mark.parametrize("name", ["printer", pytest.param("servo", marks=pytest.mark.slow)])
def test_a_slow_jog_without_encoder_ends_soon(name: str) -> None:
    bed = Broken(MACHINES / f"{name}.toml")
    bed.per_count = 0.0
    bed.ask(m.Enable())
    start = bed.moved
    end = bed.end(m.Jog("macro", bed.machine.guide.touch.speed))
    assert end.outcome in (m.STALLED, m.FAULTED)
    assert end.outcome == m.FAULTED or "encoder or motor" in end.evidence["reason"]
    bed.run(500)
    assert abs(bed.effort) < bed.tree.guard.lean
    assert abs(bed.moved - start) < 0.3 * (bed.tree.load.stop_high - bed.tree.load.stop_low)


@pytest.mark.parametrize("sign", [pytest.param(1.0, marks=pytest.mark.slow), -1.0])
def test_a_stop_behind_a_dead_encoder_does_not_drive_the_carriage_on(sign: float) -> None:
    """Held at a reading that stood, it ran on by up to 73 mm."""
    bed = ready("printer")
    bed.end(m.MoveTo(0.1))
    bed.ask(m.Jog("macro", 0.038 * sign))
    bed.run(150)
    before = bed.moved
    bed.per_count = 0.0
    bed.run(40)
    assert isinstance(bed.ask(m.Stop()), Accepted)
    bed.run(600)
    assert bed.fault is None and not bed.trusted and bed.effort == 0.0
    assert abs(bed.moved - before) < 10e-3
    bed.per_count = 1.0
    assert bed.end(m.Home()).outcome == m.DONE and bed.trusted


@pytest.mark.parametrize("name", ["printer", pytest.param("servo", marks=pytest.mark.slow)])
def test_a_stop_without_a_fault_ends_no_trust(name: str) -> None:
    bed = ready(name)
    travel = bed.tree.travel
    for share in (0.8, 0.2, 0.5):
        bed.ask(m.MoveTo(travel.low + share * (travel.high - travel.low)))
        bed.run(120)
        bed.ask(m.Stop())
        bed.run(300)
        assert bed.machine.view().motion == 0 and bed.trusted


@pytest.mark.parametrize(
    ("name", "enabled"),
    [("printer", True), ("screw", False), pytest.param("servo", True, marks=pytest.mark.slow)],
)
def test_a_jump_at_rest_ends_trust_until_it_is_homed(name: str, enabled: bool) -> None:
    bed = ready(name)
    before = bed.off
    if not enabled:
        bed.ask(m.Disable())
        bed.run(200)
    bed.jump = 500.0
    bed.run(5)
    assert bed.fault is not None and bed.fault.name == "position jump" and not bed.trusted
    bed.clear()
    bed.ask(m.Enable())
    middle = 0.5 * (bed.tree.travel.low + bed.tree.travel.high)
    reply = bed.ask(m.MoveTo(middle))
    assert isinstance(reply, Refused) and "not known" in reply.reason
    bed.run(20)
    assert bed.end(m.Home()).outcome == m.DONE and bed.trusted
    assert bed.off == pytest.approx(before, abs=2.0 * bed.machine.guide.touch.give)


@pytest.mark.parametrize("mode", ["enabled", "disabled", "fault"])
def test_a_silent_encoder_ends_trust_in_every_mode(mode: str) -> None:
    bed = ready("printer")
    if mode == "disabled":
        bed.ask(m.Disable())
    elif mode == "fault":  # one that says nothing of the place
        bed.notices += bed.machine.fail("control periods missed", {}, False)
        assert bed.trusted
    bed.silent = True
    bed.run(30)
    if mode == "fault":  # whoever holds the fault asks the guard beside it
        assert "while a fault was latched" in bed.led.overlooked()
    else:
        assert bed.fault is not None and bed.fault.name == "encoder silent" and not bed.trusted


@pytest.mark.parametrize(
    "name",
    [
        "printer", "disc",
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("servo", "stage", "emps")),
    ],
)  # fmt: skip
def test_a_count_of_dither_keeps_no_axis_from_its_stop(name: str) -> None:
    """And it finds it where it finds it without."""
    bed = Broken(MACHINES / f"{name}.toml")
    bed.dither = 0.1
    bed.ask(m.Enable())
    end = bed.end(m.Home())
    assert end.outcome == m.DONE and bed.fault is None
    assert bed.off == pytest.approx(ready(name).off, abs=2.0 * bed.machine.guide.touch.give)


def test_a_piezo_that_is_switched_off_swings_without_a_fault() -> None:
    bed = ready("piezo-800um")
    assert bed.end(m.MoveTo(3e-4)).outcome == m.DONE
    bed.ask(m.Disable())
    bed.run(2500)
    assert bed.fault is None and bed.trusted
    bed.jump = 5e-5 / bed.tree.encoder.pitch
    bed.run(5)
    assert bed.fault is not None and bed.fault.name == "position jump"


def test_a_wire_whose_sensor_is_frozen_is_not_heated() -> None:
    bed = ready("wire-150um")
    assert bed.end(m.MoveTo(1e-3)).outcome == m.DONE
    bed.per_count = 0.0
    assert bed.end(m.MoveTo(2e-3)).outcome == m.FAULTED
    assert bed.fault is not None and bed.fault.name == "position frozen"
    assert not bed.trusted
    bed.run(50)
    assert bed.effort == 0.0
    bed.clear()  # and is so at once, while the cause is there
    bed.run(2)
    assert bed.fault is not None and bed.fault.name == "position frozen" and not bed.trusted
    bed.per_count = 1.0
    bed.run(10)
    bed.clear()
    bed.run(300)
    assert bed.fault is None and bed.trusted  # it is absolute


def test_a_wire_that_does_not_contract_is_heated_no_longer_than_one_that_does() -> None:
    bed = ready("wire-150um")
    bed.gain = 0.0
    bed.ask(m.MoveTo(2e-3))
    heated = 0
    while bed.fault is None and heated < 5000:
        bed.run(1)
        heated += abs(bed.effort) > 9.0
    assert bed.fault is not None and bed.fault.name == "stuck"
    assert heated * bed.period < 2.1
    bed.run(2)
    assert bed.effort == 0.0


@pytest.mark.parametrize("request_", [pytest.param(m.Stop(), marks=pytest.mark.slow), m.LinkLost()])
def test_a_wire_that_is_stopped_or_left_is_let_go(request_: Any) -> None:
    bed = ready("wire-150um")
    assert bed.end(m.MoveTo(1e-3)).outcome == m.DONE
    bed.run(20)
    assert bed.effort > 0.0  # held
    bed.ask(m.MoveTo(3e-3))
    bed.run(100)
    bed.ask(request_)
    bed.run(5)
    assert bed.effort == 0.0 and bed.machine.view().motion == 0
    bed.run(1000)
    assert bed.effort == 0.0 and bed.fault is None
    assert bed.end(m.MoveTo(1e-3)).outcome == m.DONE


def test_where_an_axis_without_a_reference_stands_becomes_its_zero(tmp_path: Path) -> None:
    file = tmp_path / "endless.toml"
    file.write_text(ENDLESS)
    bed = Broken(file)
    assert isinstance(bed.ask(m.Enable()), Accepted) and bed.trusted
    reply = bed.ask(m.Home())
    assert isinstance(reply, Refused) and "known" in reply.reason
    assert bed.end(m.MoveTo(1.0)).outcome == m.DONE
    bed.jump = 5000.0
    bed.run(5)
    assert bed.fault is not None and not bed.trusted
    bed.clear()
    bed.run(2)
    assert not bed.trusted
    bed.ask(m.Enable())
    bed.run(5)
    assert isinstance(bed.ask(m.MoveTo(0.5)), Refused)
    assert isinstance(bed.ask(m.Home()), Accepted)
    bed.run(2)
    assert bed.trusted and bed.machine.view().position == pytest.approx(0.0, abs=0.01)
    start = bed.moved
    assert bed.end(m.MoveTo(0.5)).outcome == m.DONE
    assert bed.moved - start == pytest.approx(0.5, abs=0.01)


def test_what_a_law_did_is_no_doubt_of_the_place() -> None:
    bed = ready("printer")
    bed.run(5)
    control = bed.rig.control
    control.watches[0] = control.watch._replace(fault=1, value=11.0, limit=10.0)  # illegal effort
    bed.run(2)
    assert bed.fault is not None and bed.fault.name == "illegal effort" and bed.trusted
    bed.jump = 500.0  # a jump meanwhile is one
    bed.run(2)
    lost = bed.led.overlooked()
    assert "while a fault was latched" in lost
    ends = [n for n in bed.notices if isinstance(n, Finished)]
    assert [e.outcome for e in ends] == [m.DONE]  # of homing


@pytest.mark.parametrize("name", ["wire-150um", "piezo-100um"])
def test_a_motion_that_is_cut_off_costs_no_place_that_the_sensor_knows(name: str) -> None:
    bed = ready(name)
    bed.ask(m.MoveTo(0.5 * bed.tree.travel.high))
    bed.run(3)
    assert bed.machine.view().motion
    bed.ask(m.EmergencyStop())
    bed.run(5)
    assert bed.trusted and bed.effort == 0.0
    bed.ask(m.Enable())
    bed.run(5)
    assert bed.end(m.MoveTo(0.3 * bed.tree.travel.high)).outcome == m.DONE
    bed.ask(m.MoveTo(0.5 * bed.tree.travel.high))
    bed.run(3)
    bed.notices += bed.machine.fail("control periods missed", {}, False)
    assert bed.trusted
