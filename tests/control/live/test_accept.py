"""Every request in every mode: accepted, or refused with a reason and without effect."""

from __future__ import annotations

import math
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused
from macromicro.control.live.parameters import SoftLimits
from macromicro.control.supervisor import Plan
from macromicro.types import SAFE

from .bench import PITCH, Machine, homed
from .follower import QUICK, Follower, ready

PLAN = Plan(np.array([math.nan]), np.array([0]), np.array([30.0]), np.array([0.0]), math.nan)
REQUESTS: dict[str, Any] = {
    "enable": m.Enable(), "disable": m.Disable(), "home": m.Home(), "move to": m.MoveTo(0.01),
    "move by": m.MoveBy(0.001), "move macro": m.MoveMacro(100), "move micro": m.MoveMicro(1e-3),
    "macro by": m.MoveMacroBy(3), "micro by": m.MoveMicroBy(1e-4),
    "jog": m.Jog("macro", 0.01), "follow": m.Follow("macro", 0.1), "end follow": m.EndFollow(),
    "stop": m.Stop(), "emergency": m.EmergencyStop(),
    "speed": m.SetSpeed("macro", 0.01), "zero": m.Zero(),
    "fan": m.Fan(True), "programme": m.Programme(PLAN),
    "gains": m.SetGains((("pd_tuned.now", 0.013),)), "clear": m.ClearFault(True),
    "lost": m.LinkLost("stop"), "limits": m.SetLimits(),
    "move point": m.MovePoint({"x": 0.01, "y": 0.01}), "move axis": m.MoveAxis("x", 0.01),
    "move point by": m.MovePointBy({"x": 0.01, "y": 0.01}), "move axis by": m.MoveAxisBy("x", 0.01),
}  # fmt: skip
ALWAYS = {"disable", "stop", "emergency", "lost"}
MOTIONS = {"home", "move to", "move by", "move macro", "move micro", "macro by", "micro by", "jog"}
MOTIONS |= {"programme", "follow"}
QUIET = {"fan", "zero", "gains", "limits"}
ACCEPTED = {
    "disabled": ALWAYS | QUIET | {"enable"},
    "ready": ALWAYS | QUIET | MOTIONS,
    "stopped": ALWAYS | QUIET | MOTIONS,
    "holding": ALWAYS | QUIET | MOTIONS,
    "homing": ALWAYS | {"fan"},
    "moving-macro": ALWAYS | {"fan"},
    "settling": ALWAYS | {"fan"},
    "moving-micro": ALWAYS | {"fan"},
    "fault": ALWAYS | {"clear", "gains", "limits"},
}


def in_mode(mode: str) -> Follower:
    f = ready()
    if mode == "disabled":
        f.ask(m.Disable())
    elif mode == "homing":
        f.ask(m.Home())
    elif mode in ("moving-macro", "settling"):
        f.ask(m.MoveMacro(300))
        f.until(mode)
    elif mode in ("moving-micro", "holding"):
        f.ask(m.MoveMicro(1e-3))
        f.until(mode)
    elif mode == "fault":
        f.fault()
    elif mode == "stopped":
        f.ask(m.MoveMacro(300))
        f.tick()
        f.ask(m.Stop())
        f.run(0.5)
    assert f.mode == mode
    return f


def test_all_requests_are_listed() -> None:
    assert {type(r) for r in REQUESTS.values()} == set(m.Request.__args__)
    assert set(ACCEPTED) == set(m.MODES)


@pytest.mark.parametrize("name", REQUESTS)
@pytest.mark.parametrize("mode", m.MODES)
def test_every_mode_and_request(mode: str, name: str) -> None:
    f = in_mode(mode)
    before = f.s
    reply = f.ask(REQUESTS[name])
    assert isinstance(reply, Accepted) == (name in ACCEPTED[mode])
    if isinstance(reply, Refused):
        assert reply.reason and reply.remedy
        assert f.s is before
    elif name in MOTIONS:
        assert reply.id == before.given + 1
    else:
        assert reply.id == 0


@pytest.mark.parametrize("request_", REQUESTS.values())
def test_messages_pickle(request_: Any) -> None:
    f = ready()
    reply = f.ask(request_)
    again = pickle.loads(pickle.dumps((request_, reply, f.events, f.ends)))
    assert type(again[0]) is type(request_)
    assert repr(again) == repr((request_, reply, f.events, f.ends))


def test_nothing_is_accepted_before_the_first_sample() -> None:
    machine = Machine()
    for request in (m.Enable(), m.Zero(), m.Home()):
        assert isinstance(machine.ask(request), Refused)


@pytest.mark.parametrize("name", ["move to", "move by", "move macro", "move micro", "programme"])
def test_without_trust_only_homing_and_creeping(name: str) -> None:
    f = ready(trusted=False)
    reply = f.ask(REQUESTS[name])
    assert isinstance(reply, Refused) and reply.remedy == "home first"
    fast = f.ask(m.Jog("macro", 0.04))
    assert isinstance(fast, Refused) and "not homed" in fast.reason
    assert isinstance(f.ask(m.Zero()), Accepted)
    assert isinstance(f.ask(m.Jog("macro", 0.01)), Accepted)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, "5", None, True, 1e9, -1e9])
@pytest.mark.parametrize("kind", [m.MoveTo, m.MoveBy, m.MoveMacro, m.MoveMicro])
def test_no_number_and_no_place_is_refused(kind: Any, value: Any) -> None:
    machine = homed()
    before = machine.s
    reply = machine.ask(kind(value))
    assert isinstance(reply, Refused) and reply.reason and reply.remedy
    assert machine.s is before
    assert machine.see() == SAFE
    assert isinstance(machine.ask(m.Jog("macro", value)), Refused)
    assert isinstance(machine.ask(m.Jog("micro", value)), Refused)


def test_soft_limits_are_inclusive() -> None:
    machine = homed()
    q = machine.p.settings.limits
    for kind, low, high, beyond in (
        (m.MoveMacro, q.macro_low, q.macro_high, 1.0),
        (m.MoveMicro, q.micro_low, q.micro_high, 1e-9),
        (m.MoveTo, q.whole_low, q.whole_high, 1e-9),
    ):
        for value, good in ((low, 1), (high, 1), (low - beyond, 0), (high + beyond, 0)):
            state = machine.s
            assert isinstance(machine.ask(kind(value)), Accepted) == bool(good), (kind, value)
            machine.s = state
    assert isinstance(machine.ask(m.MoveMacro(10.5)), Refused)


def test_the_macro_target_leaves_the_micro_stage_in_its_band() -> None:
    """Whatever of its tolerance the carriage uses up, the rest lies within 0.3 to 3.5 mm."""
    for target in np.linspace(-0.008, 0.216, 301):
        machine = homed()
        machine.ask(m.MoveTo(float(target)))
        assert machine.s.motion is not None
        if math.isnan(machine.s.motion.coarse):
            assert 0.3e-3 <= machine.s.motion.fine <= 3.5e-3
            continue
        for off in (-2.0, 0.0, 2.0):
            rest = (target - (machine.s.motion.coarse + off) * PITCH) * 1e3
            assert 0.3 - 1e-9 <= rest <= 3.5
        # No higher count would do, or there is none.
        assert (
            machine.s.motion.coarse == 2990.0
            or (target - (machine.s.motion.coarse + 3.0) * PITCH) * 1e3 < 0.3
        )


def test_what_the_micro_stage_reaches_alone_leaves_the_carriage() -> None:
    for target, alone in ((0.00029, False), (0.0003, True), (0.0035, True), (0.00351, False)):
        machine = homed()
        machine.ask(m.MoveTo(target))
        assert machine.mode == ("moving-micro" if alone else "moving-macro")


def test_a_new_motion_may_replace_one_where_configured() -> None:
    f = ready(live=QUICK._replace(supersede=1))
    first = f.ask(m.MoveMacro(300))
    f.run(0.003)
    second = f.ask(m.MoveTo(0.005))
    assert (first, second) == (Accepted(1), Accepted(2))
    assert [(e.id, e.outcome) for e in f.ends] == [(1, "superseded")]
    assert isinstance(f.ask(m.MoveMicro(1e-3)), Refused)  # the carriage moves
    assert isinstance(f.ask(m.Jog("micro", 1e-4)), Refused)
    f.until("holding")
    assert [(e.id, e.outcome) for e in f.ends] == [(1, "superseded"), (2, "done")]
    f.ask(m.Home())
    assert isinstance(f.ask(m.MoveMacro(0)), Refused)  # homing is never replaced


def test_no_motion_begins_while_the_carriage_comes_to_rest() -> None:
    f = ready(live=QUICK._replace(supersede=1))
    f.ask(m.MoveMacro(300))
    f.run(0.003)
    f.ask(m.Stop())
    reply = f.ask(m.MoveMacro(10))
    assert isinstance(reply, Refused) and "coming to rest" in reply.reason


def test_zero_resets_the_laser_once_and_leaves_the_coordinates() -> None:
    f = ready()
    place, offset = f.s.seen.position, f.s.frame.offset
    f.ask(m.Zero())
    assert f.s.frame.zero == place and f.s.frame.offset == offset
    assert [f.tick().laser_reset for _ in range(3)] == [1.0, 0.0, 0.0]


@pytest.mark.parametrize("name", ["move macro", "jog", "home", "programme", "disable"])
def test_what_follows_a_zero_at_once_leaves_it_its_reset(name: str) -> None:
    """Both may come within one period."""
    f = ready()
    f.ask(m.Zero())
    assert isinstance(f.ask(REQUESTS[name]), Accepted)
    f.ask(m.Stop())
    assert [f.tick().laser_reset for _ in range(3)] == [1.0, 0.0, 0.0]


def test_an_emergency_stop_and_a_fault_reset_nothing_any_more() -> None:
    f = ready()
    f.ask(m.Zero())
    f.ask(m.EmergencyStop())
    assert f.tick() == f.tick() == SAFE
    f.ask(m.Zero())
    f.fault()
    f.ask(m.ClearFault(True))
    assert f.tick() == f.tick() == SAFE


def test_the_fan_runs_as_told_until_an_emergency() -> None:
    f = ready()
    f.ask(m.Fan(True))
    assert f.tick().fan == 1.0
    f.ask(m.Fan(False))
    assert f.tick().fan == 0.0
    f.ask(m.Fan(True))
    f.ask(m.EmergencyStop())
    assert f.tick() == SAFE
    assert isinstance(f.ask(m.Fan("on")), Refused)  # type: ignore[arg-type]


@pytest.mark.parametrize(("action", "mode"), [("stop", "stopped"), ("hold", "holding")])
def test_a_lost_link_ends_the_motion_as_configured(action: str, mode: str) -> None:
    f = ready()
    f.ask(m.MoveMicro(1e-3))
    f.run(0.005)
    f.ask(m.LinkLost(action))
    assert (f.ends[-1].outcome, f.mode) == ("lost", mode)
    assert (f.tick().ctrl > 0.0) == (action == "hold")
    f = ready()
    f.ask(m.MoveMacro(300))
    f.run(0.003)
    f.ask(m.LinkLost(action))
    f.run(0.3)
    assert (f.ends[-1].outcome, f.mode) == ("lost", "stopped")
    assert f.out == SAFE


def test_a_stop_holds_the_micro_stage_where_it_is() -> None:
    f = ready()
    f.ask(m.MoveMicro(3e-3))
    f.run(0.002)
    here = f.s.seen.fine
    assert 0.0 < here < 2.0
    f.ask(m.Stop())
    assert (f.ends[-1].outcome, f.mode) == ("stopped", "holding")
    assert f.s.drive.micro_reference == here
    f.ask(m.Stop())  # and again: nothing more to stop
    assert f.mode == "holding" and len(f.ends) == 1


@pytest.mark.parametrize("change", [
    {"target": np.array([1e4])}, {"target": np.array([math.nan])}, {"hold": np.array([-1.0])},
    {"stage": np.array([2])}, {"stage": np.array([], dtype=int)}, {"hold": np.array([0.0, 1.0])},
    {"stage": np.array([1])},
])  # fmt: skip
def test_programmes_that_cannot_be_are_refused(change: dict[str, Any]) -> None:
    reply = ready().ask(m.Programme(PLAN._replace(**change)))
    assert isinstance(reply, Refused) and reply.reason and reply.remedy


def test_an_emergency_stop_on_the_way_tells_that_the_trust_is_gone() -> None:
    f = ready()
    f.ask(m.MoveMacro(300))
    f.run(0.003)
    f.events.clear()
    f.ask(m.EmergencyStop())
    assert [(e.kind, e.cause) for e in f.events] == [
        ("trust", "emergency stop on the way"), ("mode", "emergency stop"),
    ]  # fmt: skip
    assert f.events[0].evidence == {"trusted": False} and not f.s.frame.trusted
    f.ask(m.Enable())
    f.ask(m.Home())
    f.events.clear()
    f.ask(m.EmergencyStop())  # it was not trusted any more
    assert [e.kind for e in f.events] == ["mode"]


@pytest.mark.parametrize("begun", [1.8e-3, 0.0])
def test_a_stop_beyond_the_soft_limits_moves_nothing(begun: float) -> None:
    """It stands outside limits that were narrowed, or below the machine's own."""
    limits = QUICK.limits if begun else QUICK.limits._replace(micro_low=0.5e-3)
    f = ready(live=QUICK._replace(limits=limits))
    if begun:
        f.ask(m.MoveMicro(begun))
        f.until("holding")
        f.ask(m.SetLimits(limits._replace(micro_high=1e-3)))
    f.ask(m.MoveMicro(0.9e-3))
    f.run(0.001)
    here = f.s.seen.fine
    assert not f.s.limits.micro_low <= here <= f.s.limits.micro_high
    f.ask(m.Stop())
    f.run(0.1)
    assert (f.ends[-1].outcome, f.mode) == ("stopped", "holding")
    assert f.s.drive.micro_reference == here


class Odd:
    """It can neither be written nor compared."""

    def __repr__(self) -> str:
        raise RuntimeError

    def __eq__(self, other: object) -> bool:
        raise RuntimeError

    __hash__ = None  # type: ignore[assignment]


COLUMNS = st.one_of(
    st.sampled_from([None, [1.0], (), np.zeros((2, 2)), np.array(["a"]), np.array([None]),
                     np.ma.masked_array([0.0], [True]), np.array([True]), np.array([1j]),
                     np.array([1.0]), np.array([0]), np.array([0, 1]), np.array([math.inf]),
                     np.array([math.nan]), np.array([-math.inf]), np.array([2**63], dtype="u8"),
                     np.array([1.0], dtype="f2"), np.array([1.0], dtype=np.longdouble)]),
    st.floats(), st.integers(),
)  # fmt: skip
ANYTHING: st.SearchStrategy[Any] = st.recursive(
    st.one_of(
        st.none(), st.booleans(), st.floats(), st.integers(-(10**400), 10**400), st.text(),
        st.sampled_from([10**400, object(), 1j, np.array([1, 2]), {}, set(),
                         np.float64(0.5), np.int64(3), np.float32(math.inf), "macro", "micro",
                         "stop", "sequence.wait", "macro_law", "pd_tuned.now", "pid", QUICK.limits,
                         np.array(["macro", "micro"]), 0.0, 1.0, 1e308, -1e308, 5e-324]),
        st.builds(Plan, COLUMNS, COLUMNS, COLUMNS, COLUMNS, COLUMNS),
        st.builds(SoftLimits, *[st.one_of(st.floats(), st.sampled_from([10**400, "a", 1]))] * 6),
    ),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.lists(inner, max_size=3).map(tuple)),
    max_leaves=6,
)  # fmt: skip


@settings(max_examples=200)
@given(data=st.data(), mode=st.sampled_from(["ready", "holding", "moving-micro", "disabled"]))
def test_no_request_whatever_is_in_it_raises(data: st.DataObject, mode: str) -> None:
    kind = data.draw(st.sampled_from(m.Request.__args__))
    request = kind(*[data.draw(ANYTHING) for _ in kind._fields])
    f = in_mode(mode)
    before = f.s
    reply = f.ask(request)
    assert isinstance(reply, Accepted | Refused)
    if isinstance(reply, Refused):
        assert f.s is before and reply.reason and reply.remedy
    f.run(0.01)
    f.ask(m.Stop())
    f.run(0.01)


@pytest.mark.parametrize("change", [
    {"start": np.array([math.inf])}, {"start": np.array([-math.inf])}, {"end": math.inf},
    {"end": "x"}, {"end": None}, {"end": True}, {"end": 10**400}, {"stage": np.array([0.0])},
    {"stage": [0]}, {"start": None}, {"hold": np.array([None])},
    {name: np.zeros((2, 2), int) for name in ("start", "stage", "target", "hold")},
])  # fmt: skip
def test_programmes_without_columns_and_times_are_refused(change: dict[str, Any]) -> None:
    reply = ready().ask(m.Programme(PLAN._replace(**change)))
    assert isinstance(reply, Refused) and reply.reason and reply.remedy


@pytest.mark.parametrize("request_", [
    m.MoveTo(10**400), m.MoveBy(-(10**400)), m.MoveMacro(10**5000), m.MoveMicro(10**400),
    m.Jog("macro", 10**400), m.Jog(np.array(["macro"]), 0.01), m.LinkLost(np.array([1, 2])),
    m.SetGains((("sequence.wait", 10**400),)), m.SetGains((("macro_law", np.array([1, 2])),)),
    m.SetLimits(SoftLimits(macro_low=-(10**400))),
])  # fmt: skip
def test_numbers_beyond_floats_and_no_words_are_refused(request_: Any) -> None:
    f = ready()
    before = f.s
    reply = f.ask(request_)
    assert isinstance(reply, Refused) and reply.reason and reply.remedy
    assert f.s is before


@pytest.mark.parametrize("value", [Odd(), -(10**5000)], ids=["odd", "long"])
@pytest.mark.parametrize("kind", m.Request.__args__)
def test_what_can_be_neither_shown_nor_compared_is_refused(kind: Any, value: Any) -> None:
    f = ready()
    for count in range(len(kind._fields)):
        values = [value if k == count else "macro" for k in range(len(kind._fields))]
        before = f.s
        reply = f.ask(kind(*values))
        assert isinstance(reply, Accepted) or (f.s is before and reply.reason and reply.remedy)


def test_a_jog_gives_way_to_a_jog_of_the_same_stage_alone() -> None:
    f = ready()
    f.ask(m.Jog("macro", 0.02))
    f.run(0.01)
    for other in (m.MoveMacro(50), m.MoveTo(0.01), m.Jog("micro", 1e-4), m.Home()):
        reply = f.ask(other)
        assert isinstance(reply, Refused) and reply.reason == "a motion is under way"
    assert f.ask(m.Jog("macro", 0.01)) == Accepted(1)
    f.ask(m.Stop())
    reply = f.ask(m.Jog("macro", 0.01))
    assert isinstance(reply, Refused) and reply.reason == "the carriage is still coming to rest"


def test_targets_are_told_in_the_homed_frame() -> None:
    f = ready(coordinate=-30.0)
    f.ask(m.MoveTo(0.01))
    facts = f.events[-1].evidence
    assert facts["target_counts"] == f.s.motion.coarse - 30.0 < 140.0
    assert facts["target_m"] == 0.01
    f.ask(m.Stop())
    f.run(0.1)
    f.ask(m.MoveMacro(44))
    assert f.events[-1].evidence == {"target_counts": 44.0}


def test_what_stands_in_the_way_of_any_move_is_told_before_its_distance() -> None:
    f = in_mode("disabled")
    reply = f.ask(m.MoveBy(math.nan))
    assert isinstance(reply, Refused) and reply.reason == "the positioner is disabled"


def test_a_motion_under_way_is_told_before_the_carriage_that_moves() -> None:
    reply = in_mode("moving-macro").ask(m.MoveMicro(1e-3))
    assert isinstance(reply, Refused) and reply.reason == "a motion is under way"


def test_a_jog_of_the_other_stage_is_another_motion() -> None:
    f = ready(live=QUICK._replace(supersede=1))
    f.ask(m.Jog("micro", 1e-4))
    f.run(0.01)
    assert f.ask(m.Jog("macro", 0.02)) == Accepted(2)
    assert f.ends[-1].outcome == "superseded" and f.s.motion.kind == "jog macro"


def test_no_jog_begins_without_a_speed() -> None:
    f = ready()
    for stage in m.STAGES:
        reply = f.ask(m.Jog(stage, 0.0))
        assert isinstance(reply, Refused) and reply.remedy == "give a speed"
        assert f.s.motion is None


def test_nothing_replaces_homing() -> None:
    f = ready(live=QUICK._replace(supersede=1))
    f.ask(m.Home())
    f.tick()
    reply = f.ask(m.Jog("macro", 0.01))
    assert isinstance(reply, Refused) and reply.reason == "a motion is under way"
    assert f.mode == "homing"
