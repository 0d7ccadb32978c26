"""Whatever is asked and whatever the sensors say: what always holds."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.control import calibration
from macromicro.control.live import messages as m
from macromicro.control.live.messages import Finished, Refused
from macromicro.control.live.transitions import TRANSITIONS
from macromicro.control.supervisor import Plan
from macromicro.types import SAFE, Outputs, Sample

from .bench import DT, PITCH
from .follower import QUICK, QUICK_CONTROL, Follower, hall

TABLE = {(m.MODES[a], m.MODES[b], cause) for a, b, cause in TRANSITIONS}
WILD = st.sampled_from([math.nan, math.inf, -math.inf, 1e9, -1e9, 1e300, "5", None, True])
PLAN = Plan(
    np.array([math.nan] * 3), np.array([0, 1, 0]), np.array([30.0, 1e-3, 60.0]),
    np.array([0.0, 0.02, 0.0]), math.nan,
)  # fmt: skip
TIMED = Plan(
    np.array([0.0, 0.03, 0.06]), np.array([0, 1, 0]), np.array([30.0, 1e-3, 60.0]),
    np.array([0.03, 0.03, 0.04]), 0.1,
)  # fmt: skip
FINE_FIRST = Plan(
    np.array([math.nan] * 4), np.array([1, 0, 0, 1]), np.array([0.5e-3, 30.0, 60.0, 1e-3]),
    np.array([0.02, 0.0, 0.0, 0.02]), math.nan,
)  # fmt: skip
PLANS = (PLAN, TIMED, FINE_FIRST)


def about(low: float, high: float) -> st.SearchStrategy[object]:
    return st.one_of(st.floats(low, high), st.floats(low, high), st.floats(low, high), WILD)


ENDS = st.sampled_from([
    m.Stop(), m.Stop(), m.Jog("macro", 0.0), m.Jog("micro", 0.0), m.LinkLost("stop"),
    m.LinkLost("hold"), m.Disable(), m.EmergencyStop(),
])  # fmt: skip
STARTS = st.one_of(
    st.builds(m.MoveTo, st.floats(-0.009, 0.05)),
    st.builds(m.MoveBy, st.floats(-0.005, 0.005)),
    st.builds(m.MoveMacro, st.integers(-130, 400)),
    st.builds(m.MoveMicro, st.floats(0.0, 3.5e-3)),
    st.builds(m.Jog, st.just("macro"), st.sampled_from([-0.05, -0.01, 0.01, 0.05])),
    st.builds(m.Jog, st.just("micro"), st.sampled_from([-5e-4, 5e-4])),
    st.sampled_from([m.Programme(PLAN), m.Programme(TIMED), m.Home()]),
)
ODD = st.one_of(
    st.builds(m.MoveTo, about(-0.012, 0.05)),
    st.builds(m.MoveBy, about(-0.05, 0.05)),
    st.builds(m.MoveMacro, st.one_of(st.integers(-150, 400), WILD)),
    st.builds(m.MoveMicro, about(-0.5e-3, 4e-3)),
    st.builds(m.Jog, st.sampled_from(["macro", "micro", "third"]), about(-0.06, 0.06)),
    st.builds(m.SetGains, st.tuples(st.tuples(
        st.sampled_from(["pd_tuned.now", "pi_antiwindup.kp", "sequence.wait", "macro_law", "x"]),
        st.one_of(st.floats(-1.0, 5.0), st.sampled_from(["pid", "pd-tuned"]), WILD),
    ))),
    st.builds(m.Fan, st.booleans()),
    st.sampled_from([m.Zero(), m.ClearFault(True), m.ClearFault(False), m.LinkLost("dance"),
                     "a word"]),
)  # fmt: skip
FOLLOW = st.tuples(st.just("follow"), st.integers(1, 120))
SAMPLES = st.one_of(
    st.tuples(st.just("stand"), st.integers(1, 100)),
    st.tuples(st.sampled_from(["missing e", "missing h", "missing eh"]), st.integers(1, 10)),
    st.tuples(st.just("noise"), st.integers(1, 100)),
    st.tuples(st.just("jump"), st.integers(-300, 300)),
    st.tuples(st.sampled_from(["infinite", "fault"]), st.just(1)),
)
# Enabled again and again, so that one end is not the end of everything.
ROUND = st.tuples(STARTS, FOLLOW, st.one_of(STARTS, ENDS, FOLLOW), st.one_of(SAMPLES, FOLLOW))
UP = st.just((m.ClearFault(True), m.Enable(), m.Home(), ("follow", 350)))
PIECES = st.lists(st.one_of(ROUND, ROUND, ROUND, ODD.map(lambda a: (a,)), UP), max_size=12)
ACTIONS = PIECES.map(lambda pieces: [action for piece in pieces for action in piece])
MORE = settings(max_examples=150)


class Checked(Follower):
    """Holds every rule after every step and every request."""

    def __init__(self, supersede: int) -> None:
        super().__init__(live=QUICK._replace(supersede=supersede, gains_while_moving=supersede))
        self.rng = np.random.default_rng(0)
        self.fines: deque[float] = deque(maxlen=4)  # a window of good readings
        self.targets: dict[int, m.Request] = {}
        self.told = 0

    def show(self, sample: Sample) -> Outputs:
        if math.isfinite(sample.hall):
            self.fines.append(calibration.position(self.p.calibration, sample.hall))
        out = super().show(sample)
        if math.isnan(out.motor) or math.isnan(out.ctrl):  # as the guard does
            self.fault("illegal output")
            out = SAFE
        assert abs(out.motor) <= 5.0 and 0.0 <= out.ctrl <= 5.0
        assert out.fan in (0.0, 1.0) and out.laser_reset in (0.0, 1.0)
        assert all(math.isfinite(v) for v in self.command[:4])
        resting = self.s.motion is None and self.mode == "stopped"
        if self.mode in ("disabled", "ready", "fault") or resting:
            assert (out.motor, out.ctrl) == (0.0, 0.0)
            assert (self.command.macro_active, self.command.micro_active) == (0.0, 0.0)
        if self.mode == "fault":
            assert out == SAFE
        if not math.isfinite(sample.encoder):
            assert out.motor == 0.0 or self.mode == "homing"
        self.check()
        return out

    def ask(self, request: object) -> m.Reply:
        before = self.s
        reply = super().ask(request)
        if isinstance(reply, Refused):
            assert reply.reason and reply.remedy
            assert self.s is before
        elif reply.id:
            self.targets[reply.id] = request  # type: ignore[assignment]
            assert self.s.motion is None or self.s.motion.id == reply.id
        self.check()
        return reply

    def check(self) -> None:
        assert (self.s.motion is None) == (self.s.work is None)
        assert (self.mode in ("homing", "moving-macro", "settling", "moving-micro")) <= (
            self.s.motion is not None
        )
        for event in self.events:
            if event.kind == "mode":
                assert (event.from_mode, event.to_mode, event.cause) in TABLE
            else:
                assert event.from_mode == event.to_mode
        self.events.clear()
        for end in self.ends[self.told :]:
            assert end.outcome in m.OUTCOMES
            if end.outcome == m.DONE:
                self.truly_done(end)
        self.told = len(self.ends)

    def truly_done(self, end: Finished) -> None:
        """What was reported as done is so, by the readings alone."""
        band = self.p.settings.fine.band
        tolerance = self.s.laws.sequence.tolerance
        mean = sum(self.fines) / len(self.fines)
        place = self.s.seen.encoder - self.s.frame.offset
        asked = self.targets[end.id]
        assert self.s.frame.trusted and math.isfinite(end.position)
        if isinstance(asked, m.Home):
            assert abs(place - self.p.settings.homing.coordinate) <= tolerance
        elif isinstance(asked, m.MoveTo):
            assert abs(place * PITCH + mean - asked.position) <= band + 1e-9
        elif isinstance(asked, m.MoveMacro):
            assert abs(place - asked.counts) <= tolerance
        elif isinstance(asked, m.MoveMicro):
            assert abs(mean - asked.position) <= band + 1e-12
        elif isinstance(asked, m.Programme):
            last = asked.plan.target[-1]
            fine = bool(asked.plan.stage[-1])
            assert abs((mean if fine else place) - last) <= (band + 1e-12 if fine else tolerance)
        else:
            assert isinstance(asked, m.MoveBy)

    def live(self, what: str, number: int) -> None:
        """Some periods with the readings that `what` says."""
        if what == "jump":
            self.encoder += number
            number = 1
        for _ in range(number):
            if what == "stand":
                self.show(self.sample(math.floor(self.encoder), hall(self.fine)))
            elif what == "infinite":
                self.show(self.sample(math.inf, -math.inf))
            elif what == "fault":
                self.fault("stuck", pushed_s=0.3)
                self.check()
            elif what == "noise":
                self.tick(noise=float(self.rng.normal(0.0, 0.05)))
            else:
                self.tick(missing=what.partition(" ")[2])

    def sample(self, encoder: float, volts: float) -> Sample:
        return Sample(self.s.time + DT, encoder, volts, 0.0, 1.0, 0.0)


def play(actions: list[object], supersede: int) -> Checked:
    machine = Checked(supersede)
    for action in actions:
        if type(action) is tuple:
            machine.live(*action)
        else:
            machine.ask(action)
    return machine


@MORE
@given(ACTIONS, st.sampled_from([0, 1]))
def test_any_sequence_keeps_the_rules(actions: list[object], supersede: int) -> None:
    machine = play(actions, supersede)
    machine.ask(m.EmergencyStop())
    machine.tick()
    assert machine.mode in ("disabled", "fault")
    assert machine.out == SAFE
    # Exactly one end for each accepted motion, none for any other.
    assert sorted(end.id for end in machine.ends) == machine.begun


@MORE
@given(ACTIONS, st.sampled_from([0, 1]))
def test_any_sequence_after_homing_keeps_the_rules(actions: list[object], supersede: int) -> None:
    """From here the motions that need trust are reached."""
    start = [("follow", 1), m.Enable(), m.Home(), ("follow", 400)]
    machine = play([*start, *actions, ("follow", 400)], supersede)
    machine.ask(m.EmergencyStop())
    machine.tick()
    assert machine.out == SAFE
    assert sorted(end.id for end in machine.ends) == machine.begun


def test_the_sequences_above_do_reach_done() -> None:
    """The checks of what is done are not idle: every kind of motion gets there."""
    outcomes = {}
    for request in (m.Home(), m.MoveTo(0.02), m.MoveBy(0.0005), m.MoveMacro(50), m.MoveMicro(1e-3),
                    m.Programme(PLAN)):  # fmt: skip
        machine = play([("follow", 1), m.Enable(), m.Home(), ("follow", 600), request], 0)
        machine.live("follow", 1200)
        outcomes[type(request).__name__] = machine.ends[-1].outcome
        assert machine.ends[-1].id == 2
    assert set(outcomes.values()) == {"done"}, outcomes


def test_settings_of_the_sequences_are_valid() -> None:
    assert QUICK.problems() == [] and QUICK_CONTROL.problems() == []


def random_action(rng: np.random.Generator) -> object:
    """A request that can begin a motion, one that ends it, or some time."""

    def uniform(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    starts = (
        lambda: m.MoveTo(uniform(-0.009, 0.05)),
        lambda: m.MoveBy(uniform(-0.004, 0.004)),
        lambda: m.MoveMacro(int(rng.integers(-130, 400))),
        lambda: m.MoveMicro(uniform(0.0, 3.5e-3)),
        lambda: m.Jog("macro", uniform(-0.05, 0.05)),
        lambda: m.Jog("micro", uniform(-5e-4, 5e-4)),
        lambda: m.Programme(PLANS[int(rng.integers(3))]),
        m.Home,
    )
    ends = (m.Stop, m.Stop, lambda: m.Jog("macro", 0.0), lambda: m.Jog("micro", 0.0),
            lambda: m.LinkLost("stop"), lambda: m.LinkLost("hold"))  # fmt: skip
    offs = (m.Disable, m.EmergencyStop, lambda: ("fault", 1))
    trouble = (("stand", 60), ("stand", 250), ("missing e", 3), ("missing h", 4), ("noise", 80),
               ("jump", 8), ("jump", -300), ("infinite", 1))  # fmt: skip
    kind = rng.random()
    if kind < 0.35:
        return starts[int(rng.integers(len(starts)))]()
    if kind < 0.45:
        return ends[int(rng.integers(len(ends)))]()
    if kind < 0.48:
        return offs[int(rng.integers(len(offs)))]()
    if kind < 0.56:
        return trouble[int(rng.integers(len(trouble)))]
    return ("follow", int(rng.choice([1, 5, 12, 25, 60, 150])))


@given(st.integers(0, 2**32 - 1), st.sampled_from([0, 1]))
@pytest.mark.slow
def test_long_random_walks_keep_the_rules(seed: int, supersede: int) -> None:
    rng = np.random.default_rng(seed)
    up = [("follow", 1), m.ClearFault(True), m.Enable(), m.Home(), ("follow", 350)]
    actions: list[object] = []
    for _ in range(4):
        actions += [*up, *(random_action(rng) for _ in range(25))]
    machine = play(actions, supersede)
    machine.ask(m.EmergencyStop())
    machine.tick()
    assert machine.out == SAFE
    assert sorted(end.id for end in machine.ends) == machine.begun
