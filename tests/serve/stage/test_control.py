"""A stage's own law and guard under the live machine: what they are given, and a real stage."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest

from macromicro.control.live.leading import REST, Aim, Course
from macromicro.errors import InputError
from macromicro.machines import composite, guarding, period, sequence, stage
from macromicro.machines import machine as machines
from macromicro.machines.guarding import Limits
from macromicro.machines.lines import Held, Wired
from macromicro.machines.period import Bench, Part, Stages
from macromicro.machines.sequence import MOVING, Progress
from macromicro.machines.signals import Sample
from macromicro.machines.stage import Bounds
from macromicro.serve import faults, settings
from macromicro.serve.stage import _control as controls
from macromicro.serve.stage._control import Control, Resting, last_pulse, loop_of
from macromicro.serve.stage.rig import Simulated

PRINTER = Path(__file__).parents[3] / "examples" / "machines" / "printer.toml"


class One:
    """The control of a machine of one stage."""

    def __init__(self, every: Control) -> None:
        self.every = every

    def run(self, course: Course, params: Any, state: Any, seen: Sample, noise: Any) -> Any:
        (after,) = self.every.run((course,), Bench((params,)), (state,), (seen,), (noise,))
        return after

    @property
    def effort(self) -> float:
        return self.every.efforts[0]

    @property
    def captured(self) -> float:
        return self.every.captured[0]

    def __getattr__(self, name: str) -> Any:
        return getattr(self.every, name)


class Driven:
    """A simulated printer under its law, without a loop."""

    def __init__(self) -> None:
        found = settings.load(PRINTER)
        assert found is not None
        self.tree = found.tree
        self.rig = Simulated(found.machine, found.tree, (found.live.pitch,), 0)
        self.control = One(self.rig.control)

    def run(self, course: Course, seconds: float) -> float:
        for _ in range(round(seconds / 1e-3)):
            self.rig.drive((course,))
        return self.rig.read().encoder * self.rig.pitches[0]


def test_the_law_follows_its_course_and_off_it_gives_nothing() -> None:
    stage = Driven()
    course = Course(True, REST._replace(position=1e-3), restart=1)
    assert stage.run(course, 0.5) == pytest.approx(1e-3, abs=stage.tree.arrival.tolerance)
    assert stage.control.effort != 0.0
    stage.run(course._replace(on=False), 0.01)
    assert stage.control.effort == 0.0


@pytest.mark.parametrize(
    ("shown", "last"),
    [([], math.nan), ([math.nan] * 2, math.nan), ([math.nan, 3.0, math.nan, 7.0, math.nan], 7.0)],
)
def test_the_last_pulse_of_a_period_counts(shown: list[float], last: float) -> None:
    assert last_pulse(np.array(shown)) == pytest.approx(last, nan_ok=True)


def test_a_course_limits_the_effort() -> None:
    stage = Driven()
    stage.run(Course(True, REST._replace(position=2e-3), effort=0.2, restart=1), 0.05)
    assert abs(stage.control.effort) == pytest.approx(0.2)
    assert stage.rig.read().encoder == 0.0  # less than its friction


def test_the_guard_of_the_machine_trips_and_is_renewed() -> None:
    stage = Driven()
    stage.run(Course(True, REST, high=-1e-3, restart=1), 0.002)
    watch = stage.control.watch
    assert watch.fault == 4 and stage.control.effort == 0.0
    stage.run(Course(True, REST, restart=1), 0.01)
    assert stage.control.effort == 0.0  # latched
    words = faults.describe(faults.STAGE + watch.fault, watch.value, watch.limit, watch.time)
    assert words.code == 204 and words.name == "above the soft limit"
    stage.control.renew()
    stage.run(Course(True, REST._replace(position=1e-3), restart=2), 0.05)
    assert stage.control.watch.fault == 0 and stage.control.effort != 0.0


def test_a_law_that_begins_anew_forgets_what_it_has_gathered() -> None:
    stage = Driven()
    course = Course(True, REST._replace(position=2e-4), restart=1)
    stage.run(course, 0.01)
    before = stage.control._memory[0].integral
    assert before > 0.0
    stage.run(course._replace(aim=REST, restart=2), 0.001)
    assert abs(stage.control._memory[0].integral) < 0.1 * abs(before)
    # Off and on again it begins anew, whatever the number.
    stage.run(course, 0.01)
    stage.run(course._replace(on=False), 0.001)
    stage.run(course._replace(aim=REST), 0.001)
    assert abs(stage.control._memory[0].integral) < 0.1 * abs(before)


class Gains(NamedTuple):
    """Of a law that pushes with no more than `limit`."""

    limit: float = 3.0


class Free(NamedTuple):
    """Of a law without a limit."""

    stiffness: float = 1.0


class Watched:
    """Control whose loops are scripted: they tell what they were given."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, gains: Any, **given: Any) -> None:
        self.loops: list[tuple[Any, ...]] = []
        self.coasts: list[tuple[Any, ...]] = []
        self.compiled: list[Any] = []
        self.begun = 0
        self.written, self.fault = 4, guarding.OK
        printer = machines.load(PRINTER)[0]
        self.machine = printer._replace(law=printer.law._replace(start=self.start), **given)
        self.tree = SimpleNamespace(
            law="mine",
            timing=SimpleNamespace(period=0.25e-3),
            guard=Limits(),
            encoder=SimpleNamespace(pitch=1e-4),
            arrival="arrival",
            controller=gains,
            motion=SimpleNamespace(velocity=0.5),
        )
        self.made: list[str] = []
        kind = self.machine.kind
        stages = Stages((kind,), (printer.law,))
        rows = [*(c.name for c in period.columns(stages)), "law_speed"]
        self.row = rows.index("effort")
        self.pulses = rows.index("index_count") if kind.lines else None
        self.shown = [math.nan] * 4

        def known(name: str, loop: Any) -> Any:
            return lambda *which, **how: (self.made.append(name), loop)[1]

        def compiled(loop: Any) -> Any:
            self.compiled.append(loop)
            return loop

        monkeypatch.setattr(controls, "gains", lambda tree: tree.controller)
        monkeypatch.setattr(period, "columns", lambda *_: [SimpleNamespace(name=n) for n in rows])
        monkeypatch.setattr(period, "in_place", known("in_place", self.loop))
        monkeypatch.setattr(period, "period", known("period", self.loop))
        monkeypatch.setattr(stage, "opened", known("opened", self.free))
        monkeypatch.setattr(controls, "compiled", compiled)

    def control(self, kind: Any = None) -> One:
        own = None if kind is None else composite.stages(self.machine)._replace(kinds=(kind,))
        return One(Control(self.machine, self.tree, own))

    def start(self, gains: Any, seen: Sample) -> tuple[Any, ...]:
        self.begun += 1
        return ("memory", self.begun, gains, seen)

    def loop(self, bench: Any, loops: Any, run: Any, noise: Any, out: Any, dt: float) -> Any:
        (params,), (loop,), (part,), (draws,) = bench.stages, loops, run.parts, noise
        self.loops.append((params, loop, run, draws.copy(), dt))
        out[:] = 9.0
        out[-1] = [1.0, 2.0, 3.0, 4.0]
        out[self.row] = [0.1, 0.2, 0.3, 0.4]
        if self.pulses is not None:
            out[self.pulses] = self.shown
        watch = part.watch._replace(fault=self.fault)
        memory, held = (*part.memory, "later"), part.held._replace(low=part.held.low + 1.0)
        after = Part("driven", memory, watch, held)
        return run._replace(parts=(after,)), self.written

    def free(self, params: Any, state: Any, bounds: Any, efforts: Any, *rest: Any) -> Any:
        noise, out, dt = rest
        assert out.shape == (2, len(noise))
        self.coasts.append((params, state, bounds, efforts.tolist(), noise.copy(), dt))
        return "coasted", len(noise), 0


def test_the_law_follows_each_piece_of_the_course_within_a_period() -> None:
    """Here the speed changes after 0.3 ms of four control periods of 0.25 ms."""
    stage = Driven()
    aim, after = Aim(1e-3, 0.1, 0.0, 0.0), Aim(1.03e-3, 0.0, 0.0, 0.0)
    course = Course(True, aim, later=((0.3e-3, after),))
    loop = loop_of(course, None, stage.tree, Wired(), (0.0, 0.1e-3, 0.3e-3))
    begun = Progress(MOVING, 0, 0, 0.5, math.nan, 0)
    found = []
    for k in range(4):
        t = 0.5 + 0.25e-3 * k
        progress = begun._replace(piece=sequence.piece_at(loop.plan, begun, t))
        found.append(sequence.aim(loop.plan, progress, t).position)
    assert found == pytest.approx([1e-3, 1.025e-3, 1.03e-3, 1.03e-3], abs=1e-12)


def test_the_set_point_at_a_time_is_that_of_the_last_piece_before_it() -> None:
    aim, after = Aim(1e-3, 0.1, 0.0, 0.0), Aim(0.5e-3, -0.2, 0.0, 0.0)
    begins = (0.0, 0.1e-3, 0.3e-3, 0.4e-3)
    rows = controls.pieces(Course(True, aim, later=((0.3e-3, after),)), begins)
    assert rows[:, 0].tolist() == list(begins)
    assert rows[:, 1] == pytest.approx([1e-3, 1.01e-3, 0.5e-3, 0.48e-3])


def fresh_at(seen: Sample) -> guarding.Watch:
    """A guard that has forgotten a fault, and not where the stage was seen last."""
    known = {"heard": seen.t, "place": seen.position, "repeated": seen.t, "then": seen.t}
    return guarding.fresh()._replace(**known)


NOISE = np.arange(8.0).reshape(4, 2)
SEEN = Sample(0.5, 0.02)
AIM = Aim(0.03, 0.1, 0.2, 0.3)
COURSE = Course(True, AIM, -0.5, 0.6, math.inf, 7)


def test_loop_and_law_are_given_the_course(monkeypatch: pytest.MonkeyPatch) -> None:
    made = Watched(monkeypatch, Gains())
    control = made.control()
    assert control.effort == 0.0 and control.dt == 0.25e-3
    assert repr(control.watch) == repr(guarding.fresh())
    assert control.places[0] is made.machine.kind.place
    assert control.run(COURSE, "params", "state", SEEN, NOISE) == "driven"
    params, loop, run, noise, dt = made.loops[0]
    assert (params, dt) == ("params", 0.25e-3) and np.array_equal(noise, NOISE)
    assert loop.gains == Gains(3.0) and loop.arrival == "arrival"
    assert loop.guard == Limits()._replace(low=-0.5, high=0.6)
    plan = loop.plan
    assert plan.start.tolist() == [0.0] and plan.target.tolist() == [0.03]
    assert plan.hold.tolist() == plan.length.tolist() == [math.inf]
    assert plan.first.tolist() == [0, 1] and plan.pieces.tolist() == [[0.0, 0.03, 0.1, 0.2, 0.3]]
    assert plan.origin == 0.03 and math.isnan(plan.end)
    (part,) = run.parts
    assert (run.tick, part.stage) == (2000, "state")
    assert repr(run.progress) == repr(Progress(MOVING, 0, 0, 0.5, math.nan, 0))
    assert part.memory == ("memory", 1, Gains(3.0), SEEN)
    assert repr(part.watch) == repr(guarding.fresh())
    assert control.effort == 0.4 and made.coasts == []


def test_before_the_place_is_known_the_guard_is_stricter(monkeypatch: pytest.MonkeyPatch) -> None:
    made = Watched(monkeypatch, Gains())
    control = made.control()
    for course in (COURSE._replace(speed=0.1, leant=0.04), COURSE._replace(speed=7.0, leant=2.0)):
        control.run(course, "params", "state", SEEN, NOISE)
    strict, wide = (loop.guard for _, loop, *_ in made.loops)
    assert strict.speed == pytest.approx(0.1 + 3.0 * 1e-4 / 0.01) and strict.leant == 0.04
    assert wide.speed == Limits().speed and wide.leant == 2.0


def test_the_sensor_is_watched_while_nothing_is_driven(monkeypatch: pytest.MonkeyPatch) -> None:
    made = Watched(monkeypatch, Gains())
    made.tree.guard = Limits(leap=1.0, still=1e-3)
    for course in (COURSE._replace(on=False), COURSE._replace(waiting=True)):
        control = made.control()
        control.run(course, "params", "state", SEEN, NOISE)
        control.run(course, "params", "state", Sample(0.501, 0.0219), NOISE)
        assert control.watch.fault == guarding.OK
        control.run(course, "params", "state", Sample(0.502, 0.0241), NOISE)
        assert control.watch.fault == guarding.JUMP and guarding.blind(control.watch)
        control.renew()
        control.run(course, "params", "state", Sample(0.503, 0.0241), NOISE)
        assert control.watch.fault == guarding.OK and control.enable == float(course.waiting)


@pytest.mark.parametrize("driven", [True, False])
def test_a_stage_that_was_driven_is_given_its_time_to_come_to_rest(
    monkeypatch: pytest.MonkeyPatch, driven: bool
) -> None:
    made = Watched(monkeypatch, Gains())
    made.tree.guard = Limits(leap=1.0, still=1e-3)
    control, off = made.control(), COURSE._replace(on=False)
    for t, course in ((0.5, off), (0.7, off), (0.701, COURSE if driven else off)):
        control.run(course, "params", "state", SEEN._replace(t=t), NOISE)
    control.run(off, "params", "state", Sample(0.702, SEEN.position + 1.9e-3), NOISE)
    assert control.watch.fault == (guarding.OK if driven else guarding.JUMP)


def test_a_law_takes_other_gains_and_keeps_its_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    made = Watched(monkeypatch, Gains())
    control = made.control()
    control.run(COURSE, "params", "state", SEEN, NOISE)
    tree = vars(control.every._trees[0]) | {"controller": Gains(1.5)}
    control.take(SimpleNamespace(**tree))
    control.run(COURSE, "params", "state", SEEN, NOISE)
    assert [loop.gains for _, loop, *_ in made.loops] == [Gains(3.0), Gains(1.5)]
    assert made.begun == 1 and made.loops[1][2].parts[0].memory[-1] == "later"


@pytest.mark.parametrize("written", [2, 4])
def test_what_the_law_remembers_is_shown_as_of_its_last_period(
    monkeypatch: pytest.MonkeyPatch, written: int
) -> None:
    made = Watched(monkeypatch, Gains())
    control = made.control()
    assert control.own == []
    made.written = written
    control.run(COURSE, "params", "state", SEEN, NOISE)
    assert control.own == [float(written)]
    control.run(COURSE._replace(on=False), "params", "state", SEEN, NOISE)
    assert control.own == []


def test_what_the_guard_cuts_coasts_for_the_rest_and_stays_off(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = Watched(monkeypatch, Gains())
    control = made.control()
    made.written, made.fault = 2, guarding.LOST
    assert control.run(COURSE, "params", "state", SEEN, NOISE) == "coasted"
    assert control.effort == 0.2 and control.watch.fault == guarding.LOST
    params, state, bounds, efforts, noise, dt = made.coasts[0]
    assert (params, state, dt) == ("params", "driven", 0.25e-3)
    assert bounds == Bounds(-math.inf, math.inf, math.inf)
    assert efforts == [0.0, 0.0] and np.array_equal(noise, NOISE[2:])
    assert control.run(COURSE, "params", "state", SEEN, NOISE) == "coasted"
    assert control.effort == 0.0 and len(made.loops) == 1
    assert made.coasts[1][3] == [0.0] * 4 and made.coasts[1][1] == "state"
    control.renew()
    assert repr(control.watch) == repr(fresh_at(SEEN))
    made.written, made.fault = 4, guarding.OK
    assert control.run(COURSE, "params", "state", SEEN, NOISE) == "driven"


def test_the_law_begins_anew_with_another_number_and_after_it_was_off(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = Watched(monkeypatch, Gains())
    control = made.control()
    for course in (COURSE, COURSE, COURSE._replace(restart=8), COURSE._replace(restart=8)):
        control.run(course, "params", "state", SEEN, NOISE)
    begun = [run.parts[0].memory[1] for _, _, run, _, _ in made.loops]
    assert begun == [1, 1, 2, 2]
    assert made.loops[1][2].parts[0].memory[-1] == "later"  # it goes on from what it has gathered
    off = COURSE._replace(on=False, restart=8)
    assert control.run(off, "params", "state", SEEN, NOISE) == "coasted"
    assert control.effort == 0.0
    control.run(COURSE._replace(restart=8), "params", "state", SEEN, NOISE)
    assert made.loops[-1][2].parts[0].memory == ("memory", 3, Gains(3.0), SEEN)


@pytest.mark.parametrize(("effort", "limit"), [(0.5, 0.5), (5.0, 3.0), (math.inf, 3.0)])
def test_the_course_lowers_the_laws_limit(
    monkeypatch: pytest.MonkeyPatch, effort: float, limit: float
) -> None:
    made = Watched(monkeypatch, Gains())
    made.control().run(COURSE._replace(effort=effort), "params", "state", SEEN, NOISE)
    assert made.loops[0][1].gains == Gains(limit) == made.loops[0][2].parts[0].memory[2]


def test_a_law_without_a_limit_is_for_machines_that_know_their_place(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with pytest.raises(InputError, match=r"law: 'mine'.*`limit`"):
        Watched(monkeypatch, Free()).control()
    made = Watched(monkeypatch, Free(), touch=None)
    made.control().run(COURSE, "params", "state", SEEN, NOISE)
    assert made.loops[0][1].gains == Free()
    Watched(monkeypatch, Gains(), touch=None).control()


def test_a_simulated_stage_is_compiled_and_a_real_rig_is_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = Watched(monkeypatch, Gains())
    made.control()
    assert made.made == ["in_place", "opened"] and made.compiled == [made.free]
    made = Watched(monkeypatch, Gains())
    made.control(made.machine.kind._replace(name="a rig"))
    assert made.made == ["period", "opened"] and made.compiled == []


class Lined(Watched):
    """The same of a rig with lines, which tells what its drive was switched to."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.switched: list[tuple[Any, ...]] = []
        kind = machines.load(PRINTER)[0].kind
        names = ("limit_low", "index_count", "enable")
        lined = kind._replace(lines=names, switch=self.switch)
        super().__init__(monkeypatch, Gains(), kind=lined)

    def switch(self, params: Any, state: Any, enable: float) -> Any:
        self.switched.append((params, state, enable))
        return "switched"

    def control(self, kind: Any = None) -> One:
        return super().control(self.machine.kind._replace(name="a rig"))


@pytest.mark.parametrize(
    ("shown", "written", "pulse"),
    [
        ([7.0, 3.0, math.nan, math.nan], 4, 3.0),  # the first was seen at the period's begin
        ([7.0, math.nan, math.nan, 5.0], 4, 5.0),
        ([7.0, math.nan, 5.0, math.nan], 2, math.nan),  # that was of another period
    ],
)
def test_a_pulse_within_a_period_is_kept_until_the_next_one(
    monkeypatch: pytest.MonkeyPatch, shown: list[float], written: int, pulse: float
) -> None:
    made = Lined(monkeypatch)
    control = made.control()
    assert math.isnan(control.captured)
    made.shown, made.written = shown, written
    control.run(COURSE, "params", "state", SEEN, NOISE)
    assert control.captured == pytest.approx(pulse, nan_ok=True)
    control.run(COURSE._replace(on=False), "params", "state", SEEN, NOISE)
    assert math.isnan(control.captured)
    bare = Watched(monkeypatch, Gains()).control()
    bare.run(COURSE, "params", "state", SEEN, NOISE)
    assert math.isnan(bare.captured)


def test_the_drive_is_switched_by_its_enable_line(monkeypatch: pytest.MonkeyPatch) -> None:
    made = Lined(monkeypatch)
    control = made.control()
    assert control.enable == 0.0
    off, waiting = COURSE._replace(on=False), COURSE._replace(waiting=True)
    for course, enable in ((off, 0.0), (waiting, 1.0), (COURSE, 1.0), (off, 0.0), (COURSE, 1.0)):
        control.run(course, "params", "state", SEEN, NOISE)
        assert control.enable == enable
    # A stage that is driven all the while is switched by its own loop.
    assert made.switched == [("params", "state", enable) for enable in (0.0, 1.0, 0.0)]
    assert [state for _, state, *_ in made.coasts] == ["switched"] * 3
    made.fault, made.written = guarding.LOST, 2
    for state, course in (("driven", COURSE), ("state", COURSE), ("state", waiting)):
        control.run(course, "params", "state", SEEN, NOISE)
        assert control.enable == 0.0 and made.switched[-1] == ("params", state, 0.0)


def test_the_lines_are_guarded_from_where_the_law_was_switched_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = Lined(monkeypatch)
    control = made.control()
    off = COURSE._replace(on=False)
    for course in (COURSE, COURSE, COURSE._replace(homing=True), off, COURSE):
        control.run(course, "params", "state", SEEN, NOISE)
    assert [run.parts[0].held.low for _, _, run, *_ in made.loops] == [0.0, 1.0, 2.0, 0.0]
    assert repr(made.loops[-1][2].parts[0].held) == repr(Held())
    leave = 2.0 * 0.1 * 0.5  # twice a tenth of the greatest speed
    assert [loop.wired for _, loop, *_ in made.loops] == [
        Wired(pytest.approx(leave), 0.0, homing) for homing in (0, 0, 1, 0)
    ]
    bare = Watched(monkeypatch, Gains())
    bare.control().run(COURSE, "params", "state", SEEN, NOISE)
    assert bare.loops[0][1].wired == Wired()


def test_a_law_that_begins_without_a_time_is_left_to_its_guard(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = Watched(monkeypatch, Gains())
    made.control().run(COURSE, "params", "state", SEEN._replace(t=math.nan), NOISE)
    assert made.loops[0][2].tick == 0


@pytest.mark.parametrize(
    ("tree", "leap", "surge"),
    [
        # Way within a millisecond and what counts as none: 0.4 m/s, or 100 m/s^2, and 1 mm.
        ({"homing": 0}, 0.4, math.inf),
        ({"homing": 0}, 0.4, 100.0),
        ({}, 0.05 * 0.4, math.inf),
        ({}, 0.05 * 0.4, 10.0),
    ],
)
@pytest.mark.parametrize("start", [0.0, 7.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_stage_that_rests_is_watched_more_closely_than_one_that_comes_to_rest(
    tree: dict[str, Any], leap: float, surge: float, start: float, sign: float
) -> None:
    """One that homes may be pushed by hand: as fast as ever, but with less acceleration."""
    limits = Limits(leap=0.4, surge=0.0 if surge == math.inf else surge, still=1e-3)
    way = {False: 0.4e-3, True: leap * 1e-3}
    if surge < math.inf:
        way = {False: min(0.4e-3, surge * 1e-6), True: min(leap * 1e-3, 0.2 * surge * 1e-6)}
    for periods, rests in ((100, False), (102, True), (300, True)):
        for factor, fault in ((0.99, guarding.OK), (1.01, guarding.JUMP)):
            resting, watch = Resting(SimpleNamespace(guard=limits, **tree)), guarding.fresh()
            for k in range(periods):
                watch = resting.look(watch, Sample(start + k * 1e-3, 0.02))
            place = 0.02 + sign * (1e-3 + factor * way[rests])
            watch = resting.look(watch, Sample(start + periods * 1e-3, place))
            assert watch.fault == fault, (periods, factor)


@pytest.mark.parametrize("jump", [0.9, 1.1])
def test_a_stage_that_swings_when_it_is_let_go_comes_to_rest_when_that_has_ended(
    jump: float,
) -> None:
    """By more between two readings than one at rest may move; for 0.3 s."""
    limits = Limits(leap=0.4, still=1e-6)
    resting, watch = Resting(SimpleNamespace(guard=limits)), guarding.fresh()
    strict, tick = 0.05 * 0.4e-3 + 1e-6, 0
    for k in range(300):
        watch = resting.look(watch, Sample(k * 1e-3, 0.02 + (k % 2) * 1.2 * strict))
        assert watch.fault == guarding.OK
    for tick in range(300, 402):  # the last one moved at 0.299 s
        watch = resting.look(watch, Sample(tick * 1e-3, 0.02))
        assert watch.fault == guarding.OK
    watch = resting.look(watch, Sample((tick + 1) * 1e-3, 0.02 + jump * strict))
    assert (watch.fault == guarding.JUMP) == (jump > 1.0)


def test_that_lasts_as_long_as_it_swings() -> None:
    """A tenth of a second behind its last quick motion a jump may still be one."""
    limits = Limits(leap=0.4, still=1e-6)
    resting, watch = Resting(SimpleNamespace(guard=limits)), guarding.fresh()
    for k in range(390):
        place = 0.02 + (k % 2) * 25e-6 * (k < 300)
        watch = resting.look(watch, Sample(k * 1e-3, place))
    watch = resting.look(watch, Sample(0.39, 0.02 + 25e-6))
    assert watch.fault == guarding.OK


STRICT = 0.05 * 0.4e-3 + 1e-6  # m a period of 1 ms, of a stage at rest with the limits below


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_stage_that_creeps_either_way_is_not_at_rest(sign: float) -> None:
    limits = Limits(leap=0.4, still=1e-6)
    resting, watch = Resting(SimpleNamespace(guard=limits)), guarding.fresh()
    for k in range(300):
        watch = resting.look(watch, Sample(k * 1e-3, 0.02 + sign * 1.2 * STRICT * k))
        assert watch.fault == guarding.OK


def test_what_noise_may_show_does_not_delay_its_rest() -> None:
    """A swing within `still` is none."""
    limits = Limits(leap=0.4, still=1e-3)
    resting, watch = Resting(SimpleNamespace(guard=limits)), guarding.fresh()
    for k in range(103):
        watch = resting.look(watch, Sample(k * 1e-3, 0.02 + (k % 2) * 0.5e-3))
    watch = resting.look(watch, Sample(0.103, 0.02 + 1e-3 + 0.5 * 0.4e-3))
    assert watch.fault == guarding.JUMP


def test_a_jump_at_rest_does_not_count_as_a_swing() -> None:
    """A second one, smaller than a stage in motion may make, is noticed too."""
    limits = Limits(leap=0.4, still=1e-6)
    resting, watch = Resting(SimpleNamespace(guard=limits)), guarding.fresh()
    for k in range(110):
        watch = resting.look(watch, Sample(k * 1e-3, 0.02))
    for k in (1, 2):
        assert watch.missed == 0.0
        watch = resting.look(watch, Sample((109 + k) * 1e-3, 0.02 + 2.0 * STRICT * k))
        assert watch.fault == guarding.JUMP
    assert watch.missed == 1.0
