"""The live machine of one stage: gains and programmes are taken by the rules of its file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from macromicro.control.live import messages as m
from macromicro.control.live.leading import REST, Course, Guided
from macromicro.control.live.messages import Accepted, Change, Event, Refused
from macromicro.machines.parts import START
from macromicro.serve import settings
from macromicro.serve.persist import Restored
from macromicro.serve.stage import guide
from macromicro.serve.stage._machine import Led
from macromicro.serve.stage.rig import Simulated
from macromicro.types import SAFE, Command

SCREW = Path(__file__).parents[3] / "examples" / "machines" / "screw.toml"


class Machine:
    """A simulated screw under the live machine, its place known."""

    def __init__(self) -> None:
        found = settings.load(SCREW)
        assert found is not None
        self.settings, tree = found, found.tree
        self.rig = Simulated(found.machine, tree, (found.live.pitch,), 0)
        self.led = Led(
            guide.parameters(found.machine, tree),
            guide.guide(found.machine, tree),
            1e-3,
            tree,
            self.rig.control.take,
        )
        self.led.begin(self.rig.read(), Restored(True, 0.0, "known"))
        self.notices: list[Any] = []
        self.run(2)
        assert self.ask(m.Enable()) == Accepted(0)
        self.run(2)

    def run(self, periods: int) -> None:
        for _ in range(periods):
            self.notices += self.led.step(self.rig.read(), 1e-3)[2]
            self.rig.drive(self.led.courses)

    def ask(self, request: Any) -> m.Reply:
        reply, notices = self.led.accept(request)
        self.notices += notices
        return reply


@pytest.fixture(scope="module")
def screw() -> Machine:
    return Machine()


def test_new_gains_are_the_laws_from_the_next_period_on(screw: Machine) -> None:
    was = screw.settings.controller.position
    law, seen = screw.rig.control, []
    whole = law._period
    law._period = lambda bench, loops, *rest: (
        seen.append(loops[0].gains),
        whole(bench, loops, *rest),
    )[1]
    screw.run(1)
    memory = law._memory[0]
    change = m.SetGains((("position", 0.5 * was), ("notch.depth", 0.25)))
    assert screw.led.refusal(change) is None and seen[-1].position == was
    assert screw.ask(change) == Accepted(
        0, (Change("position", was, 0.5 * was), Change("notch.depth", 0.1, 0.25))
    )
    assert law._memory[0] is memory
    screw.run(1)
    assert seen[-1].position == 0.5 * was and seen[-1].notch.depth == 0.25
    told = [n for n in screw.notices if isinstance(n, Event) and n.kind == "gains"]
    assert told[-1].evidence["position"] == {"old": was, "new": 0.5 * was}
    screw.ask(m.SetGains((("position", was), ("notch.depth", 0.1))))
    screw.run(1)
    assert seen[-1] == screw.settings.controller


@pytest.mark.parametrize("changes", [
    (), None, (("nothing", 1.0),), (("position", -1.0),), (("position", "1"),),
    (("velocity", 1e6),), (("controller.position", 1.0),),
])  # fmt: skip
def test_gains_that_a_file_may_not_have_change_nothing(screw: Machine, changes: Any) -> None:
    reply = screw.ask(m.SetGains(changes))
    assert isinstance(reply, Refused) and reply.reason and reply.remedy
    assert screw.led.refusal(m.SetGains(changes)) == reply
    assert screw.rig.control._gains == [screw.settings.controller]


def test_a_velocity_loop_that_the_delays_do_not_allow_is_told_with_the_rule(
    screw: Machine,
) -> None:
    reply = screw.ask(m.SetGains((("velocity", 1e6),)))
    assert isinstance(reply, Refused)
    assert "controller.velocity" in reply.reason and "timing.delay" in reply.remedy


def test_gains_and_programmes_wait_for_the_end_of_a_motion() -> None:
    screw = Machine()
    plan = screw.settings.programmes.named("usual", screw.settings.live.limits).plan
    assert isinstance(screw.ask(m.MoveTo(0.05)), Accepted)
    screw.run(20)
    for request in (m.SetGains((("position", 1.0),)), m.Programme(plan)):
        reply = screw.ask(request)
        assert isinstance(reply, Refused) and reply.reason == "a motion is under way"
        assert screw.led.refusal(request) == reply


def test_a_programme_follows_its_plan_and_is_refused_where_it_leads_too_far() -> None:
    screw = Machine()
    plan = screw.settings.programmes.named("usual", screw.settings.live.limits).plan
    assert screw.led.refusal(m.Programme(plan)) is None
    reply = screw.ask(m.Programme(plan._replace(target=plan.target + 0.1)))
    assert isinstance(reply, Refused) and "soft limits" in reply.reason
    assert isinstance(screw.led.refusal(m.Programme(None)), Refused)
    assert screw.ask(m.Programme(plan)) == Accepted(1)
    screw.run(4000)
    (end,) = [n for n in screw.notices if isinstance(n, m.Finished)]
    assert (end.id, end.outcome) == (1, m.DONE)
    tolerance = screw.settings.tree.arrival.tolerance
    assert screw.rig.read().encoder * screw.rig.pitches[0] == pytest.approx(0.0, abs=tolerance)


def test_without_trust_no_programme_begins() -> None:
    screw = Machine()
    plan = screw.settings.programmes.named("usual", screw.settings.live.limits).plan
    screw.led.begin(screw.rig.read(), Restored(False, float("nan"), "unknown"))
    screw.run(2)
    screw.ask(m.Enable())
    screw.run(2)
    reply = screw.ask(m.Programme(plan))
    assert isinstance(reply, Refused) and "home" in f"{reply.reason} {reply.remedy}"


def test_a_command_tells_the_set_point_in_counts() -> None:
    screw = Machine()
    assert isinstance(screw.ask(m.MoveTo(0.01)), Accepted)
    screw.run(4000)
    command, outputs, _ = screw.led.step(screw.rig.read(), 1e-3)
    assert command == Command(6000.0, 1.0, 0.0, 0.0, 0.0) and outputs == SAFE  # of 1.67 um each
    place = screw.led.course.aim.position
    assert place == pytest.approx(0.01, abs=1e-9)
    assert screw.led.course.aim == REST._replace(position=place)
    screw.ask(m.Disable())
    command, _, _ = screw.led.step(screw.rig.read(), 1e-3)
    assert command.macro_active == 0.0


def test_before_the_first_period_and_anew_nothing_is_led() -> None:
    screw = Machine()
    assert screw.led.course.on
    screw.led.begin(screw.rig.read(), Restored(True, 0.0, "known"))
    assert screw.led.course == Course() and screw.led._g == Guided()
    found, tree = screw.settings, screw.settings.tree
    lead = guide.guide(found.machine, tree)
    fresh = Led(guide.parameters(found.machine, tree), lead, 1e-3, tree, lambda gains: None)
    assert fresh.course == Course() and fresh.view().mode == m.DISABLED
    assert fresh.speed == lead.velocity


def test_homing_is_for_a_sensor_that_counts(screw: Machine) -> None:
    assert screw.led.searches and screw.led.refusal(m.Home()) is None
    tree, found = screw.settings.tree, screw.settings
    sure = guide.guide(found.machine, tree)._replace(touch=None)
    led = Led(guide.parameters(found.machine, tree), sure, 1e-3, tree, lambda gains: None)
    led.begin(screw.rig.read(), Restored(False, float("nan"), "unknown"))
    reply, notices = led.accept(m.Home())
    assert isinstance(reply, Refused) and "absolute" in reply.reason and notices == ()
    assert led.view().trusted == 1.0
    assert led.accept(m.Stop())[0] == Accepted(0)


def test_moves_go_at_the_speed_that_was_set_from_the_next_one_on() -> None:
    """Which the set point reaches and never passes; a jog has its own."""
    screw = Machine()
    most = screw.settings.facts.speeds["macro"]
    assert screw.led.refusal(m.SetSpeed("macro", 0.1 * most)) is None
    assert screw.ask(m.SetSpeed("macro", 0.1 * most, "me")) == Accepted()
    told = [n for n in screw.notices if isinstance(n, Event) and n.kind == "speed"]
    assert told[-1].evidence == {"speed_m_per_s": 0.1 * most, "client": "me"}

    def fastest(request: Any, periods: int) -> float:
        assert isinstance(screw.ask(request), Accepted)
        found = 0.0
        for _ in range(periods):
            screw.run(1)
            found = max(found, abs(screw.led.course.aim.velocity))
        return found

    assert fastest(m.MoveTo(0.06), 400) == pytest.approx(0.1 * most, rel=1e-6)
    refused = screw.ask(m.SetSpeed("macro", most))
    assert refused == Refused("a motion is under way", "wait for its end, or stop it")
    while screw.led.state.motion is not None:
        screw.run(10)
    assert fastest(m.Jog("macro", 0.25 * most), 300) == pytest.approx(0.25 * most, rel=1e-6)
    screw.ask(m.Jog("macro", 0.0))
    while screw.led.state.motion is not None:
        screw.run(10)
    screw.led.begin(screw.rig.read(), Restored(True, 0.0, "known"))
    assert screw.led.speed == most


@pytest.mark.parametrize(
    ("stage", "share", "words"),
    [
        ("macro", 1.01, "is not a valid speed of its moves"),
        ("macro", 0.0, "is not a valid speed of its moves"),
        ("macro", -0.5, "is not a valid speed of its moves"),
        ("macro", float("nan"), "is not a finite number"),
        ("micro", 0.5, "no micro-stage"),
        ("x", 0.5, "no axes x and y"),
        (None, 0.5, "None is not a stage"),
    ],
)
def test_a_speed_that_moves_cannot_have_is_refused(
    screw: Machine, stage: Any, share: float, words: str
) -> None:
    request = m.SetSpeed(stage, share * screw.settings.facts.speeds["macro"])
    reply = screw.ask(request)
    assert isinstance(reply, Refused) and words in reply.reason and reply.remedy
    assert screw.led.refusal(request) == reply
    assert screw.led.speed == screw.settings.facts.speeds["macro"]


class Sure:
    """The screw as a stage that need not home: absolute, or counted from where it started."""

    def __init__(self, screw: Machine, *, counts: bool) -> None:
        tree, found = screw.settings.tree, screw.settings
        if counts:
            tree = tree._replace(homing=tree.homing._replace(on=START))
        lead = guide.guide(found.machine, screw.settings.tree)._replace(touch=None)
        parameters = guide.parameters(found.machine, screw.settings.tree)
        self.led = Led(parameters, lead, 1e-3, tree, lambda gains: None)
        self.rig = screw.rig
        self.led.begin(self.rig.read(), Restored(False, float("nan"), "unknown"))

    @property
    def trusted(self) -> bool:
        return self.led.view().trusted == 1.0

    def ask(self, request: Any) -> tuple[m.Reply, list[str]]:
        """The reply, and the kinds of the events."""
        reply, notices = self.led.accept(request)
        return reply, [notice.kind for notice in notices if isinstance(notice, Event)]

    def move(self) -> None:
        """Be on the way to another place."""
        self.led.step(self.rig.read(), 1e-3)
        assert self.ask(m.Enable())[0] == Accepted(0)
        for _ in range(2):
            self.led.step(self.rig.read(), 1e-3)
        assert isinstance(self.ask(m.MoveTo(0.05))[0], Accepted)
        self.led.step(self.rig.read(), 1e-3)


ABSOLUTE = "this machine's place is known: by an absolute sensor, or from where it was switched on"


def test_an_absolute_sensor_knows_the_place_again_when_a_fault_is_cleared(screw: Machine) -> None:
    sure = Sure(screw, counts=False)
    sure.led.fail("the sensor is silent", {}, position_lost=True)
    assert sure.ask(m.Stop()) == (Accepted(0), []) and not sure.trusted
    refused, told = sure.ask(m.Home())
    assert isinstance(refused, Refused) and refused.reason == ABSOLUTE and told == []
    _, told = sure.ask(m.ClearFault())  # the cause is still there
    assert not sure.trusted and "trust" not in told
    reply, told = sure.ask(m.ClearFault(gone=True))
    assert reply == Accepted(0) and sure.trusted and told[-1] == "trust"
    sure.move()
    sure.led.fail("too fast", {}, position_lost=False)
    assert sure.trusted
    reply, told = sure.ask(m.ClearFault(gone=True))
    assert reply == Accepted(0) and sure.trusted and "trust" not in told


def test_a_stage_of_a_kind_that_never_homes_is_absolute(screw: Machine) -> None:
    sure = Sure(screw, counts=False)
    piezo = settings.load(SCREW.with_name("piezo-100um.toml"))
    assert piezo is not None
    sure.led._tree = piezo.tree
    refused, _ = sure.ask(m.Home())
    assert isinstance(refused, Refused) and refused.reason == ABSOLUTE


def test_a_count_from_the_start_is_lost_with_its_sensor_until_a_zero_is_set(screw: Machine) -> None:
    sure = Sure(screw, counts=True)
    refused, _ = sure.ask(m.Home())
    assert sure.trusted and isinstance(refused, Refused) and refused.reason == ABSOLUTE
    sure.led.fail("too fast", {}, position_lost=False)
    assert sure.trusted
    sure.ask(m.ClearFault(gone=True))
    sure.led.fail("the sensor is silent", {}, position_lost=True)
    assert not sure.trusted
    reply, told = sure.ask(m.ClearFault(gone=True))
    assert reply == Accepted(0) and not sure.trusted and "trust" not in told
    refused, _ = sure.ask(m.Home())  # it is switched off
    assert isinstance(refused, Refused) and not sure.trusted
    sure.led.step(sure.rig.read(), 1e-3)
    assert sure.ask(m.Enable())[0] == Accepted(0)
    sure.led.step(sure.rig.read(), 1e-3)
    reply, told = sure.ask(m.Home())
    assert reply == Accepted(0) and sure.trusted and told == ["trust"]
    for _ in range(2):  # what does not touch the sensor costs nothing, again
        sure.led.fail("too fast", {}, position_lost=False)
        assert sure.trusted
        sure.ask(m.ClearFault(gone=True))
    sure.led.lose("it was moved by hand")
    assert not sure.trusted


def test_a_machine_that_homes_loses_its_place_with_an_interruption() -> None:
    screw = Machine()
    assert isinstance(screw.ask(m.MoveTo(0.05)), Accepted)
    screw.run(50)
    screw.led.fail("too fast", {}, position_lost=False)
    assert screw.led.view().trusted == 0.0
    assert isinstance(screw.ask(m.ClearFault(gone=True)), Accepted)
    assert screw.led.view().trusted == 0.0


@pytest.mark.parametrize("moved", [0.0, 0.9, -0.9, 1.1, -1.1])  # of what counts as standing
def test_a_push_that_is_let_go_where_it_began_costs_the_place(screw: Machine, moved: float) -> None:
    led, sure = screw.led, Sure(screw, counts=True)
    led.begin(screw.rig.read(), Restored(True, 0.0, "known"))
    assert led.guide.touch is not None
    long = led.guide.touch.reveal + 1e-3
    sample, way = screw.rig.read(), moved * screw.settings.tree.guard.still / led.pitch
    for leaning, shift in ((0.0, 0.0), (long, way), (0.0, way), (0.0, 0.0)):
        for each in (led, sure.led):
            each.leaning = lambda leaning=leaning: leaning  # type: ignore[misc]
            each.step(sample._replace(encoder=sample.encoder + shift), 1e-3)
    assert led.view().trusted == float(abs(moved) > 1.0)
    assert sure.trusted  # nothing to lean on was ever looked for
    led.leaning = lambda: 0.0


def test_places_are_told_in_metres_of_the_frame() -> None:
    screw = Machine()
    led, pitch, offset = screw.led, screw.rig.pitches[0], 60.0
    led.begin(screw.rig.read(), Restored(True, offset, "known"))
    sample = screw.rig.read()
    led.step(sample, 1e-3)
    at = sample.encoder * pitch
    assert led.leaning() == 0.0 and led.aim == pytest.approx(at)
    assert math.isnan(led.goal) and math.isnan(led.view().target)
    screw.ask(m.Enable())
    screw.run(2)
    assert isinstance(screw.ask(m.MoveTo(0.05)), Accepted)
    screw.run(10)
    assert led.goal == pytest.approx(0.05 + offset * pitch, abs=pitch)
    assert led.view().target == pytest.approx(0.05, abs=1e-9)
    screw.run(8000)
    assert math.isnan(led.goal) and led.aim == pytest.approx(0.05 + offset * pitch, abs=pitch)
    assert isinstance(screw.ask(m.Jog("macro", 0.01)), Accepted)
    screw.run(100)
    assert led.view().target == pytest.approx(led.aim - offset * pitch, abs=1e-12)
    assert led.view().target > 0.05 + 10.0 * pitch


def test_a_file_says_whether_a_move_replaces_one(screw: Machine) -> None:
    led = screw.led
    settings = led._p.settings
    assert led.supersedes is (settings.supersede == 1)
    led._p = led._p._replace(settings=settings._replace(supersede=1 - settings.supersede))
    assert led.supersedes is (settings.supersede == 0)
    led._p = led._p._replace(settings=settings)


def test_the_greatest_speed_may_be_a_rounding_above(screw: Machine) -> None:
    most = screw.settings.facts.speeds["macro"]
    assert screw.ask(m.SetSpeed("macro", most * (1.0 + 5e-10))) == Accepted()
    assert screw.ask(m.SetSpeed("macro", most)) == Accepted()
