"""The procedures on any rig: the twin behind a face without a plant gives what the compiled
path gives, and a rig that fails ends safe."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Any, Self

import numpy as np
import pytest

from macromicro import hall_table
from macromicro.control import calibration
from macromicro.errors import InputError, MacromicroError
from macromicro.kernel import compiled
from macromicro.lab import drive
from macromicro.lab.machine import FLAGS, GuardTripped, approach, fill_gaps, play
from macromicro.plant import bench
from macromicro.programme import MACRO, MICRO, Programme
from macromicro.recorded import COLUMNS
from macromicro.recording import Recording
from macromicro.rig.fixtures import KILN_PERIOD
from macromicro.rig.guarded import IDLE
from macromicro.rig.limits import Limits
from macromicro.rig.session import BENCH, KILN, KINDS, Fixture
from macromicro.rig.twin import Twin
from macromicro.runs.programmed import on_rig, on_twin
from macromicro.runs.sequence import micro_steps
from macromicro.settings import Settings
from macromicro.thesis import all_procedures, collecting
from macromicro.thesis.chapter3 import hall_calibration
from macromicro.thesis.chapter4 import friction
from macromicro.thesis.chapter5 import electrothermal_runs, kiln_runs
from macromicro.thesis.chapter6 import laser_noise
from macromicro.thesis.procedure import Lab, needed
from macromicro.types import SAFE, Outputs, Sample

PLANT = bench.prepare(bench.Bench(), bench.Sensors())
ALL = KINDS[BENCH].channels


class Anonymous:
    """A rig that nobody knows to be the twin: no plant, no truth."""

    def __init__(
        self,
        channels: Sequence[str],
        seen: Callable[[Sample], Sample],
        state: bench.State | None,
        plant: bench.Plant = PLANT,
    ) -> None:
        self._plant = plant
        self._twin = Twin(
            plant, 0, state=state, measure=compiled(bench.measure), advance=compiled(bench.advance)
        )
        self._seen = seen
        self.channels = tuple(channels)
        self.clock = self._twin.clock
        self.written: list[Outputs] = []
        self.calls: list[str] = []

    def seeded(self, seed: int) -> Self:
        state = self._twin.state
        self._twin = Twin(
            self._plant,
            seed,
            state=state,
            measure=compiled(bench.measure),
            advance=compiled(bench.advance),
        )
        self.clock = self._twin.clock
        return self

    def read(self) -> Sample:
        sample = self._twin.read()
        lost = {c: math.nan for c in ALL if c in sample._fields and c not in self.channels}
        return self._seen(sample._replace(**lost))

    def write(self, outputs: Outputs) -> None:
        self.written.append(outputs)
        self._twin.write(outputs)

    def stop(self) -> None:
        self.calls.append("stop")
        self.written.append(SAFE)
        self._twin.stop()

    def __enter__(self) -> Self:
        self.calls.append("enter")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.calls.append("exit")


class Made:
    """A factory that keeps the rigs it made. `state`: how each begins; `seen`: what becomes of
    its samples."""

    def __init__(
        self,
        channels: Sequence[str] = ALL,
        seen: Callable[[Sample], Sample] = lambda s: s,
        state: bench.State | None = None,
        plant: bench.Plant = PLANT,
    ) -> None:
        self.channels, self.seen, self.state = tuple(channels), seen, state
        self.plant = plant
        self.rigs: list[Anonymous] = []

    def __call__(self, seed: int) -> Anonymous:
        self.rigs.append(Anonymous(self.channels, self.seen, self.state, self.plant).seeded(seed))
        return self.rigs[-1]

    def fixture(self, **more: Any) -> Fixture:
        known = {
            "table": calibration.default_calibration(),
            **more,
        }  # the twin has the calibrated sensor
        return Fixture("mine", BENCH, self, self.channels, 1e-3, **known)


def same(slow: Recording, fast: Recording) -> None:
    """`slow` has every column of `fast` but the true ones, and the same bits in them."""
    names = [c.name for c in fast.columns if not c.name.startswith("true_")]
    assert [c.name for c in slow.columns] == names
    assert len(slow) == len(fast)
    for name in names:
        assert slow[name].tobytes() == fast[name].tobytes(), name


# --- the same bits


def test_open_loop_of_the_macro_stage() -> None:
    volts = np.r_[np.full(200, 4.0), np.full(150, -3.2)]
    same(
        drive.open_loop(Made().fixture(), volts, 0.5),
        drive.open_loop(PLANT, volts, 0.5),
    )


@pytest.mark.parametrize("law", ["pid", "pd-initial", "pd-tuned"])
def test_closed_loop_of_the_macro_stage(law: str) -> None:
    aim = np.r_[np.full(300, 200.0), np.full(200, 60.0)]
    fast = drive.closed_loop(PLANT, drive.law(law), aim)
    same(drive.closed_loop(Made().fixture(), drive.law(law), aim), fast)
    assert np.ptp(fast["macro_position"]) > 30.0


def test_open_loop_of_the_micro_stage() -> None:
    ctrl = electrothermal_runs.course([(1.75, 0.8), (0.0, 0.2)])
    fast = drive.heated(PLANT, ctrl, 3, 10)
    same(drive.heated(Made().fixture(), ctrl, 3, 10), fast)
    assert fast["laser"].max() > 1000.0


def test_control_by_the_laser(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(laser_noise, "SETTLE_S", 0.5)
    monkeypatch.setattr(laser_noise, "WINDOW_S", 0.5)
    fast = laser_noise.control(PLANT, 1e-3, seed=4)
    same(laser_noise.control(Made().fixture(), 1e-3, seed=4), fast)
    # A rig without a Hall sensor can be controlled by the laser as well.
    bare = laser_noise.control(Made(["laser"]).fixture(), 1e-3, seed=4)
    assert bare["laser"].tobytes() == fast["laser"].tobytes()


def test_hall_calibration(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hall_table, "RAMP_S", 0.4)
    monkeypatch.setattr(hall_table, "REST_S", 0.2)
    fast = hall_calibration.ramps(PLANT, 1, 1)
    slow = hall_calibration.ramps(Made().fixture(), 1, 1)
    assert len(slow) == len(fast) == 2
    for one, other in zip(slow, fast, strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_rig_without_a_table_of_its_sensor_makes_no_micro_moves() -> None:
    """The shipped table is another sensor's: wrong places would be reported as reached."""
    rig = Made().fixture(table=None)
    with pytest.raises(InputError, match="collect --rig MODULE:FACTORY hall"):
        on_rig(rig)(micro_steps([1e-3], 1.0), Settings(), 0, False)
    macro = on_rig(rig)(programme((MACRO, 20.0, 0.1)), Settings(), 0, False)
    assert macro.attributes["finished"] == 1


def programme(*moves: tuple[int, float, float]) -> Programme:
    stage, target, hold = zip(*moves, strict=True)
    n = len(moves)
    return Programme(
        "t", np.full(n, np.nan), np.array(stage), np.array(target), np.array(hold), math.nan, ""
    )


def test_a_programme() -> None:
    sequence = Settings().controller.sequence._replace(wait=0.1, dwell=0.05)
    settings = Settings()._replace(controller=Settings().controller._replace(sequence=sequence))
    what = programme((MACRO, 60.0, 0.0), (MICRO, 0.4e-3, 0.3))
    fast = on_twin(what, settings, 5, True)
    slow = on_rig(Made().fixture())(what, settings, 5, True)
    same(slow, fast)
    assert slow.attributes["finished"] == 1 and "fault" not in slow.attributes
    assert slow.attributes["rig"] == "mine"
    assert set(fast["phase"]) >= {1, 2, 3}


# --- start conditions


def test_approach_comes_to_rest_within_a_count() -> None:
    """And changes nothing where the carriage stands there already."""
    for place in (0.0, 40.0, 137.0):
        made = Made()
        with made.fixture().open() as session:
            approach(made.fixture(), session, place)
            rig = made.rigs[0]
            before = rig.read().encoder
            for _ in range(100):
                rig.clock.wait(1e-3)
            assert rig.read().encoder == before
        assert abs(before - place) <= 1.0
        moved = any(w.motor != 0.0 for w in rig.written)
        assert moved == (place != 0.0)


def test_a_programme_s_approach_keeps_to_the_settings_of_its_law() -> None:
    """The motor of a rig may not stand the 5 V of the default settings."""
    made = Made(state=bench.initial(PLANT, 5e-3))
    controller = Settings().controller._replace(motor_limit=3.6)
    on_rig(made.fixture())(programme((MACRO, 1.0, 0.0)), Settings(controller=controller))
    assert 3.0 < max(abs(w.motor) for w in made.rigs[0].written) <= 3.6


def test_approach_gives_up_where_the_encoder_does_not_answer() -> None:
    fixture = Made(seen=lambda s: s._replace(encoder=0.0)).fixture()
    with fixture.open() as session, pytest.raises(GuardTripped, match=r"following|carriage"):
        approach(fixture, session, 500.0)


@pytest.mark.slow
def test_approach_takes_gains_and_pitch_of_the_settings() -> None:
    """On an encoder of 1 um the thesis' gains, in V per count, are 71 times too high."""
    changes = {"controller.macro_law": "terminal", "sensors.encoder.pitch": "1 um"}
    settings = Settings().with_(changes)
    plant = bench.prepare(settings.bench, settings.sensors)
    made = Made(plant=plant, state=bench.initial(plant, 0.02))
    run = on_rig(made.fixture())(programme((MACRO, 1000.0, 0.1)), settings, 0, False)
    assert run.attributes["finished"] == 1
    assert abs(run["macro_position"][0]) <= 1.0


def test_approach_stays_within_the_effort_of_the_settings() -> None:
    settings = Settings().with_("controller.motor_limit", "4 V")
    made = Made(state=bench.initial(PLANT, 0.02))
    on_rig(made.fixture())(programme((MACRO, 20.0, 0.1)), settings, 0, False)
    assert max(abs(w.motor) for w in made.rigs[-1].written) == 4.0


def test_a_run_starts_where_it_should_and_leaves_the_carriage_at_rest() -> None:
    made = Made()
    run = drive.open_loop(made.fixture(), np.full(60, 4.0), 80.5)
    x = run["macro_position"]
    assert abs(x[0] - 80.0) <= 1.0 and x[-1] > x[0] + 5.0
    np.testing.assert_allclose(run["t"], np.arange(60) * 1e-3, atol=1e-12)
    rig = made.rigs[0]
    before = rig.read().encoder
    for _ in range(50):
        rig.clock.wait(1e-3)
    assert rig.read().encoder == before


def test_a_real_rig_rests_and_zeroes_its_laser_before_a_cold_run() -> None:
    """Here a machine on which somebody moved the carriage after the last reset."""
    moved = bench.initial(PLANT, 2e-3)._replace(zero=0.0)
    made = Made(state=moved)
    run = drive.heated(made.fixture(rest=0.05), electrothermal_runs.step(0.0, 0.1))
    assert abs(run["laser"]).max() < 20.0  # um; without the reset 2 mm
    assert run["t"][0] == 0.0
    assert [w.laser_reset for w in made.rigs[0].written].count(1.0) == 1


# --- what goes wrong


def test_a_rig_without_the_channel_is_refused() -> None:
    """What is missing, who needs it, what the rig has, what would do."""
    made = Made(["encoder", "hall"])
    lab = Lab(rigs=(made.fixture(),))
    procedure = next(p for p in all_procedures() if p.name == "laser-noise")
    with pytest.raises(InputError) as caught:
        lab.check(procedure)
    text = str(caught.value)
    for word in ("laser-noise", "laser of the bench", "mine measures encoder, hall", "Use a rig"):
        assert word in text
    with pytest.raises(InputError, match="laser"):
        drive.heated(lab.bench(), electrothermal_runs.step(1.0, 0.1))
    with pytest.raises(InputError, match="encoder"):
        on_rig(Made(["hall"]).fixture())(programme((MACRO, 1.0, 0.0)), Settings(), 0, False)
    with pytest.raises(InputError, match="no kiln among"):
        lab.check(collecting.find("kiln"))
    lab.check(collecting.find("dead-zone"))
    assert not made.rigs  # nothing was opened


def failing(after: int, error: BaseException) -> Callable[[Sample], Sample]:
    left = [after]

    def seen(sample: Sample) -> Sample:
        left[0] -= 1
        if left[0] < 0:
            raise error
        return sample

    return seen


@pytest.mark.parametrize("error", [OSError("cable out"), KeyboardInterrupt()])
def test_a_rig_whose_reading_fails_ends_safe(error: BaseException) -> None:
    made = Made(seen=failing(30, error))
    with pytest.raises(type(error)):
        drive.open_loop(made.fixture(), np.full(200, 4.0), 0.5)
    rig = made.rigs[0]
    assert sum(w.motor == 4.0 for w in rig.written) == 30
    assert rig.written[-1] == SAFE and rig.calls[-2:] == ["stop", "exit"]
    made = Made(seen=failing(100, error))
    with pytest.raises(type(error)):
        on_rig(made.fixture())(micro_steps([1e-3], 1.0), Settings(), 0, True)
    assert made.rigs[0].written[-1] == SAFE and made.rigs[0].calls[-1] == "exit"


def test_the_guard_ends_an_open_loop_run() -> None:
    """An estimate above `guard.hottest`; the message says what to do."""
    made = Made()
    fixture = made.fixture(limits=Limits(hottest=60.0))
    with pytest.raises(GuardTripped, match=r"too high.*guard\.hottest"):
        drive.heated(fixture, electrothermal_runs.step(1.8, 2.0))
    rig = made.rigs[0]
    assert rig.written[-1] == SAFE
    assert 10 < sum(w.ctrl == 1.8 for w in rig.written) < 2000


def test_the_guard_ends_a_programme_s_recording() -> None:
    settings = Settings()._replace(guard=Limits(hottest=60.0))
    what = micro_steps([2e-3], 1.0)
    slow = on_rig(Made().fixture())(what, settings, 1, False)
    fast = on_twin(what, settings, 1)
    same(slow, fast)
    assert slow.attributes["finished"] == fast.attributes["finished"] == 0
    assert "too high" in str(slow.attributes["fault"])
    assert slow["ctrl"][-1] == 0.0 and slow["phase"][-1] == 5


def test_illegal_voltages_reach_no_rig() -> None:
    made = Made()
    with pytest.raises(GuardTripped, match="out of range"):
        play(
            made.fixture(),
            "a test",
            10,
            lambda k, sample: (IDLE, Outputs(7.0, 0.0, 0.0, 0.0)),
            start=0.0,
        )
    assert max(abs(w.motor) for w in made.rigs[0].written) == 0.0


def test_a_silent_encoder_gives_no_effort() -> None:
    """Closed loop: the law rests while a reading is missing, and the guard ends the run."""
    times: list[float] = []

    def seen(sample: Sample) -> Sample:
        times.append(sample.t)
        return sample._replace(encoder=math.nan) if len(times) > 20 else sample

    made = Made(seen=seen)
    with pytest.raises(GuardTripped, match="encoder"):
        drive.closed_loop(made.fixture(), drive.law("pd-tuned"), np.full(200, 500.0))
    rig = made.rigs[0]
    driven = [k for k, w in enumerate(rig.written) if w.motor != 0.0]
    assert len(driven) == 20 and rig.written[driven[0]].motor > 3.0
    assert len(rig.written) > driven[-1] + 5 and rig.written[-1] == SAFE


class Oven:
    """A kiln whose thermocouple breaks at 30 degC."""

    channels = ("thermocouple", "encoder")

    def __init__(self, seed: int) -> None:
        self.clock, self.tick, self.heater = self, 0, 0.0
        self.heated: list[float] = []

    def now(self) -> float:
        return self.tick * KILN_PERIOD

    def wait(self, dt: float) -> None:
        self.tick += 1

    def read(self) -> Any:
        from macromicro.rig.fixtures import KilnSample

        shown = 25.0 + 0.1 * self.tick
        return KilnSample(self.now(), shown if shown < 30.0 else math.nan, 0.0)

    def write(self, outputs: Any) -> None:
        self.heated.append(outputs.heater)

    def stop(self) -> None:
        self.heated.append(0.0)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *what: object) -> None:
        self.stop()


def test_a_broken_thermocouple_switches_the_heater_off() -> None:
    ovens: list[Oven] = []

    def make(seed: int) -> Oven:
        ovens.append(Oven(seed))
        return ovens[-1]

    fixture = Fixture("oven", KILN, make, Oven.channels, KILN_PERIOD)
    with pytest.raises(MacromicroError, match="thermocouple"):
        kiln_runs.run(fixture, [60.0, 40.0])
    heated = ovens[0].heated
    assert heated[:45] == [1.0] * 45 and not any(heated[51:])
    assert len(heated) < 51 + 40


# --- the lab


def test_a_lab_without_rigs_is_the_twin() -> None:
    lab = Lab()
    assert isinstance(lab.bench(), bench.Plant) and lab.runner() is on_twin
    for procedure in collecting.PROCEDURES:
        lab.check(procedure)


def test_a_lab_takes_the_first_rig_of_each_kind() -> None:
    one, two = Made().fixture(), Made().fixture()._replace(name="second")
    oven = Fixture("oven", KILN, Oven, Oven.channels, KILN_PERIOD)
    lab = Lab(Settings()._replace(guard=Limits(hottest=90.0)), rigs=(oven, one, two))
    found = lab.bench()
    assert isinstance(found, Fixture) and found.name == "mine"
    assert found.limits == Limits(hottest=90.0)  # the user's limits hold on a rig, too
    own = Lab(rigs=(Made().fixture(limits=Limits(hottest=120.0)),)).bench()
    assert isinstance(own, Fixture) and own.limits == Limits(hottest=120.0)
    assert lab.kiln() is oven
    with pytest.raises(InputError, match="no cycle among"):
        lab.cycle()


def test_every_procedure_names_channels_that_there_are() -> None:
    for procedure in [*all_procedures(), *collecting.PROCEDURES]:
        for kind, channels in needed(procedure.channels).items():
            assert set(channels) <= set(KINDS[kind].channels), procedure.name


def test_collected_on_a_rig(monkeypatch: pytest.MonkeyPatch) -> None:
    """A catalogue entry on a rig: no column of truth, and where it comes from."""
    monkeypatch.setattr(friction, "PULSES", (4.0,))
    monkeypatch.setattr(friction.pulse, "__defaults__", (10.0,))
    lab = Lab(seed=2, rigs=(Made(["encoder"]).fixture(),))
    found = collecting.find("drive").collect(lab)["drive"]
    assert [c.name for c in found.columns] == ["t", "macro_position", "motor", "run"]
    assert found.attributes == {"seed": 2, "bench": "mine"}
    assert np.ptp(found["macro_position"]) > 100.0


def test_missing_flags_are_the_last_known() -> None:
    nan = math.nan
    assert list(fill_gaps(np.array([nan, 1.0, nan, 0.0, nan]))) == [0.0, 1.0, 1.0, 0.0, 0.0]
    assert set(FLAGS) <= {c.name for c in COLUMNS if c.dtype == "i1"}
