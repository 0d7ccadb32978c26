"""A machine of one stage: the other's requests are refused, its own work as ever."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from macromicro.control import calibration
from macromicro.control.live import alone, targets
from macromicro.control.live import messages as m
from macromicro.control.live.alone import possible
from macromicro.control.live.messages import Accepted, Refused
from macromicro.control.live.parameters import STAGES, Live, prepare
from macromicro.control.live.state import begin, uncertainty
from macromicro.control.live.transitions import distrust
from macromicro.control.settings import Control
from macromicro.control.supervisor import Plan
from macromicro.types import Sample

from .bench import DT, PITCH, Machine

NAN = math.nan
TABLE = calibration.default_calibration()
CARRIAGE, STAGE = (m.MACRO,), (m.MICRO,)


def made(stages: tuple[str, ...], control: Control | None = None, **begun: Any) -> Machine:
    machine = Machine(control=control)
    machine.p = prepare(Live(), control, stages=stages)
    machine.s = begin(machine.p, **begun)
    return machine


def volts(contraction: float) -> float:
    """The Hall voltage of a contraction [m]."""
    low, high = (0.0, 5.0)
    rising = calibration.position(TABLE, high) > calibration.position(TABLE, low)
    for _ in range(60):
        middle = 0.5 * (low + high)
        below = (calibration.position(TABLE, middle) < contraction) == rising
        low, high = (middle, high) if below else (low, middle)
    return middle


def show(machine: Machine, encoder: float = NAN, hall: float = NAN, seconds: float = DT) -> None:
    """Samples of what stands still; a Hall sensor that lives has noise."""
    for k in range(round(seconds / DT)):
        t = machine.s.time + DT
        machine.show(Sample(t, encoder, hall + 1e-6 * (k % 2), NAN, NAN, NAN))


def plan(*stages: int) -> Plan:
    count = len(stages)
    targets = np.array([100.0 if s == 0 else 1e-3 for s in stages])
    return Plan(np.full(count, NAN), np.array(stages), targets, np.zeros(count), NAN)


@pytest.mark.parametrize(
    ("channels", "stages"),
    [(("encoder",), CARRIAGE), (("hall", "laser"), STAGE), (("hall", "encoder"), STAGES),
     (("laser", "extend"), ())],
)  # fmt: skip
def test_a_stage_is_there_where_its_sensor_is(
    channels: tuple[str, ...], stages: tuple[str, ...]
) -> None:
    assert alone.stages(channels) == stages


def gain(*paths: Any) -> m.SetGains:
    return m.SetGains(tuple((path, 0.01) for path in paths))


FINE = (
    m.MoveMicro(1e-3), m.Jog("micro", 1e-4), m.Programme(plan(0, 1)), m.Programme(plan(1)),
    gain("micro_law"),
    gain("ctrl_limit"), gain("p.kp"), gain("pi.kp"), gain("pi_antiwindup.kp"),
)  # fmt: skip
COARSE = (
    m.Home(), m.MoveMacro(10), m.Jog("macro", 1e-3), m.Programme(plan(1, 0)), m.Programme(plan(0)),
    gain("macro_law"),
    gain("pd_tuned.now"), gain("sequence.wait"), gain("pi.kp", "dead_zone"),
)  # fmt: skip
EITHER = (
    m.Enable(), m.Disable(), m.Stop(), m.EmergencyStop(), m.Zero(), m.Fan(True), m.MoveTo(0.01),
    m.MoveBy(0.0), m.SetLimits(None), m.ClearFault(True), m.Jog("both", 0.0), m.Jog(["macro"], 0.0),
    m.Programme(3),
    m.SetGains(3), gain(3), gain("no.such"), m.SetGains((3,)), m.SetGains(((),)),
)  # fmt: skip


@pytest.mark.parametrize(
    ("stages", "requests", "words"),
    [(CARRIAGE, FINE, "no micro-stage: its rig measures no hall"),
     (STAGE, COARSE, "no macro-stage: its rig measures no encoder")],
)  # fmt: skip
def test_what_is_asked_of_the_other_stage_is_refused(
    stages: tuple[str, ...], requests: tuple[Any, ...], words: str
) -> None:
    """Whatever the mode, in words, and nothing has changed."""
    machine = made(stages)
    for request in requests:
        before = machine.s
        reply = machine.ask(request)
        assert isinstance(reply, Refused) and words in reply.reason, request
        assert reply.remedy == "use the stage that it has" and machine.s is before
    mine = (m.Home(), m.Programme(plan(0))) if stages == CARRIAGE else (m.Programme(plan(1)),)
    for request in (*EITHER, *mine):
        assert alone.refusal(stages, request) is None, request
    for request in (*FINE, *COARSE, *EITHER):
        assert alone.refusal(STAGES, request) is None


def test_a_carriage_alone_goes_to_the_nearest_count() -> None:
    machine = made(CARRIAGE, coordinate=0.0, trusted=True)
    show(machine, 0.0)
    assert isinstance(machine.ask(m.Enable()), Accepted)
    assert isinstance(machine.ask(m.MoveTo(10.6 * PITCH)), Accepted)
    assert machine.s.motion is not None and machine.s.motion.kind == "move to"
    show(machine, 0.0)
    assert machine.command[:2] == (11.0, 1.0) and machine.out.motor > 0.0
    show(machine, 11.0, seconds=3.0)
    assert (machine.mode, machine.ends[-1].outcome) == ("ready", "done")
    assert machine.s.seen.position == 11.0 * PITCH  # no contraction beside it
    assert uncertainty(machine.p, machine.s) == 0.5 * PITCH
    assert machine.out.ctrl == 0.0 and machine.command.micro_active == 0.0
    assert isinstance(machine.ask(m.MoveBy(-PITCH)), Accepted)
    assert machine.s.motion is not None and machine.s.motion.coarse == 10.0
    machine.ask(m.EmergencyStop())
    machine = made(CARRIAGE, coordinate=0.0, trusted=True)
    show(machine, 0.0)
    machine.ask(m.Enable())
    far = machine.ask(m.MoveTo(0.2169))
    assert isinstance(far, Refused) and "macro position" in far.reason


def test_without_homing_a_carriage_alone_goes_nowhere() -> None:
    machine = made(CARRIAGE)
    show(machine, 0.0)
    machine.ask(m.Enable())
    reply = machine.ask(m.MoveTo(0.01))
    assert isinstance(reply, Refused) and reply.remedy == "home first"
    assert distrust(machine.s, "x") == (machine.s, ())  # it was not trusted before
    assert isinstance(machine.ask(m.Home()), Accepted)


@pytest.mark.parametrize("kind", [m.MoveTo, m.MoveMicro])
def test_a_micro_stage_alone_is_where_it_is(kind: Any) -> None:
    """Its place is known from the start, and cannot be lost: not by an emergency stop on the
    way, nor by counts that were missed."""
    machine = made(STAGE, coordinate=7.0, trusted=False)
    show(machine, hall=volts(0.2e-3))
    assert machine.s.seen.position == pytest.approx(0.2e-3, abs=1e-8)
    assert (machine.s.seen.encoder, machine.s.frame.offset) == (0.0, 0.0)
    assert math.isfinite(uncertainty(machine.p, machine.s))
    machine.ask(m.Enable())
    assert isinstance(machine.ask(kind(1e-3)), Accepted)
    show(machine, hall=volts(0.5e-3))
    assert machine.out.ctrl > 0.0 and machine.out.motor == machine.command.macro_active == 0.0
    machine.ask(m.EmergencyStop())
    assert machine.s.frame.trusted and machine.mode == "disabled"
    machine.ask(m.Enable())
    assert isinstance(machine.ask(kind(1e-3)), Accepted)
    show(machine, hall=volts(1e-3), seconds=1.5)
    assert (machine.mode, machine.ends[-1].outcome) == ("holding", "done")
    assert machine.s.target.whole == (1e-3 if kind is m.MoveTo else pytest.approx(NAN, nan_ok=True))
    beyond = machine.ask(m.MoveTo(4e-3))
    assert isinstance(beyond, Refused) and "micro position" in beyond.reason


def test_nothing_drives_a_carriage_that_is_not_there() -> None:
    """Even where the macro-stage is to be held while the micro-stage has its turn."""
    held = Control()._replace(sequence=Control().sequence._replace(park=0))
    machine = made(STAGE, held)
    show(machine, hall=volts(0.2e-3))
    machine.ask(m.Enable())
    machine.ask(m.MoveMicro(1e-3))
    machine.s = machine.s._replace(drive=machine.s.drive._replace(macro_reference=50.0))
    show(machine, hall=volts(0.5e-3))
    assert machine.out.motor == 0.0 and machine.command.macro_active == 0.0
    assert machine.out.ctrl > 0.0 and machine.command.micro_active == 1.0


@pytest.mark.parametrize("stages", [CARRIAGE, STAGE, STAGES])
def test_what_is_offered_is_of_the_stages_there(stages: tuple[str, ...]) -> None:
    found = possible(m.MODES.index("ready"), moving=False, trusted=True, stages=stages)
    assert (m.MoveMicro in found) == (m.MICRO in stages)
    assert {m.Home, m.MoveMacro} & found == ({m.Home, m.MoveMacro} if m.MACRO in stages else set())
    assert {m.Jog, m.MoveTo, m.MoveBy, m.Programme} <= found


@pytest.mark.parametrize(("place", "count"), [(0.49, 0.0), (0.51, 1.0), (-0.51, -1.0), (2.5, 3.0)])
def test_the_nearest_count(place: float, count: float) -> None:
    assert alone.nearest(place * 2e-5, 2e-5) == count


XY, THREE = ("x", "y"), ("x", "y", "z")


def test_several_stages_are_known_by_the_channels_of_their_encoders() -> None:
    assert alone.channel("x") == "x_count"
    assert alone.stages(map(alone.channel, THREE)) == THREE
    assert alone.stages(("encoder", "laser")) == (m.MACRO,)
    assert alone.several(XY) and not alone.several((m.MACRO, m.MICRO))


@pytest.mark.parametrize("request_", [m.MoveTo(0.1), m.SetLimits(), m.Jog(m.MACRO, 0.01)])
def test_several_stages_have_no_place_of_their_own(request_: Any) -> None:
    two, three = alone.refusal(XY, request_), alone.refusal(THREE, request_)
    assert two is not None and two.reason == "this machine has two axes"
    assert three is not None and three.reason == "this machine has 3 stages"
    assert two.remedy == three.remedy == "name a point, or one of them"
    assert alone.refusal((m.MACRO,), request_) is None


@pytest.mark.parametrize("request_", [m.MovePoint({"x": 0.1, "y": 0.1}), m.Jog("x", 0.01)])
def test_points_and_axes_are_those_of_several_stages(request_: Any) -> None:
    assert alone.refusal(XY, request_) is None
    refused = alone.refusal((m.MACRO,), request_)
    assert refused is not None and refused.reason == "this machine has no axes x and y"


def test_a_carriage_alone_which_is_held_steps_from_its_target() -> None:
    machine = made(CARRIAGE, coordinate=0.0, trusted=True)
    show(machine, 0.0)
    machine.ask(m.Enable())
    machine.ask(m.MoveMacro(100))
    show(machine, 70.0)
    machine.ask(m.Stop())
    machine.s = machine.s._replace(target=machine.s.target._replace(macro=100.0))
    assert targets.coarse_origin(machine.p, machine.s) == 100.0
