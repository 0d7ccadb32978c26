"""The live machine of one stage: gains and programmes are taken by the rules of its file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from macromicro.control.live import messages as m
from macromicro.control.live.leading import REST, Course, Guided
from macromicro.control.live.messages import Accepted, Change, Event, Refused
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
