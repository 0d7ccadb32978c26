"""The guard: what it stops, on what evidence, and that nothing illegal ever passes."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro import loop
from macromicro.control import calibration
from macromicro.control import settings as control_settings
from macromicro.control.live.parameters import Live
from macromicro.control.supervisor import begin
from macromicro.kernel import compiled
from macromicro.plant import bench
from macromicro.plant.bench import Bench, Sensors
from macromicro.rig import codes, guard
from macromicro.rig.guarded import Guarded
from macromicro.rig.limits import LIVE, Limits
from macromicro.rig.twin import Twin
from macromicro.settings import Settings
from macromicro.simulate import plan
from macromicro.types import SAFE, Command, Outputs, Sample

from ..test_loop import MACRO, MICRO, programme

GUARD = guard.prepare(Limits(), calibration.default_calibration())
DT = 1e-3
DEFAULT = Settings()
anything = st.floats(allow_nan=True, allow_infinity=True)
QUIET = Command(0.0, 0.0, 0.0, 0.0, 0.0)


class Faulty(Twin):
    """A twin whose samples or outputs an injector may spoil."""

    def __init__(self, spoil: Callable[[Sample], Sample], settings_: Settings) -> None:
        plant = bench.prepare(settings_.bench, settings_.sensors)
        super().__init__(plant, 0, measure=compiled(bench.measure), advance=compiled(bench.advance))
        self.spoil = spoil
        self.written: list[Outputs] = []

    def read(self) -> Sample:
        return self.spoil(super().read())

    def write(self, outputs: Outputs) -> None:
        self.written.append(outputs)
        super().write(outputs)


def drive(
    spoil: Callable[[Sample], Sample],
    *moves: tuple[int, float, float],
    settings_: Settings = DEFAULT,
) -> tuple[Guarded, Faulty]:
    """Run a programme on a spoiled twin under the guard."""
    quick = settings_.controller._replace(
        sequence=settings_.controller.sequence._replace(wait=0.1, patience=6.0)
    )
    control = control_settings.prepare(quick)
    rig = Faulty(spoil, settings_)
    safe = Guarded(rig, guard.prepare(settings_.guard, control.calibration), DT)
    loop.run(safe, control, plan(programme(*moves)), DT, begin(0.0))
    return safe, rig


@settings(max_examples=200)
@given(st.lists(st.tuples(anything, anything, anything, anything), min_size=1, max_size=5))
def test_no_illegal_output_passes_whatever_a_controller_returns(
    asked: list[tuple[float, float, float, float]],
) -> None:
    """Every output written is finite and within the board's range; a fault latches."""
    watch = guard.fresh()
    tripped = False
    for k, four in enumerate(asked):
        sample = Sample(k * DT, 100.0, 2.5 + 0.01 * k, 0.0, 0.0, 0.0)
        watch, given_ = guard.step(GUARD, watch, sample, QUIET, Outputs(*four), DT)
        assert abs(given_.motor) <= 5.0
        assert 0.0 <= given_.ctrl <= 5.0
        assert given_.fan in (0.0, 1.0) and given_.laser_reset in (0.0, 1.0)
        if tripped:
            assert given_ == SAFE
        tripped = tripped or watch.fault != codes.OK
        if not all(math.isfinite(v) for v in four):
            assert tripped and given_ == SAFE


def test_illegal_outputs_name_their_evidence() -> None:
    sample = Sample(0.0, 0.0, 2.5, 0.0, 0.0, 0.0)
    watch, given_ = guard.step(GUARD, guard.fresh(), sample, QUIET, Outputs(7.5, 0.0, 0.0, 0.0), DT)
    assert given_ == SAFE
    assert (watch.fault, watch.value, watch.limit) == (codes.ILLEGAL, 7.5, 5.0)
    watch, _ = guard.step(GUARD, guard.fresh(), sample, QUIET, Outputs(0.0, -0.1, 0.0, 0.0), DT)
    assert (watch.fault, watch.value) == (codes.ILLEGAL, -0.1)


def after(t: float, change: Callable[[Sample], Sample]) -> Callable[[Sample], Sample]:
    """Spoil samples from time `t` on."""
    return lambda s: change(s) if s.t >= t else s


class Frozen:
    """Holds one channel at its value at time `t`."""

    def __init__(self, t: float, channel: str) -> None:
        self.t, self.channel, self.held = t, channel, math.nan

    def __call__(self, s: Sample) -> Sample:
        if s.t < self.t:
            return s
        if math.isnan(self.held):
            self.held = getattr(s, self.channel)
        return s._replace(**{self.channel: self.held})


FAR = (MACRO, 2000.0, 0.5)
FINE = (MICRO, 2.0e-3, 1.5)
CASES = {
    "encoder frozen": (Frozen(0.1, "encoder"), (FAR,), codes.STUCK, 0.1, 0.3),
    "encoder reversed": (
        lambda s: s._replace(encoder=-s.encoder),
        (FAR,),
        codes.MACRO_LOST,
        0.0,
        0.2,
    ),
    "encoder silent": (
        after(0.2, lambda s: s._replace(encoder=math.nan)),
        (FAR,),
        codes.ENCODER_SILENT,
        0.2,
        0.01,
    ),
    "Hall silent": (
        after(0.3, lambda s: s._replace(hall=math.nan)),
        (FINE,),
        codes.HALL_SILENT,
        0.3,
        0.01,
    ),
    "Hall frozen": (Frozen(0.3, "hall"), (FINE, FINE), codes.HALL_FROZEN, 0.3, 0.52),
    "Hall off the scale": (
        after(0.3, lambda s: s._replace(hall=5.0 - 1e-4 * (s.t % 0.01))),
        (FINE,),
        codes.HALL_RANGE,
        0.3,
        0.12,
    ),
    "encoder jumps": (
        after(0.1, lambda s: s._replace(encoder=s.encoder + 200.0)),
        (FAR,),
        codes.ENCODER_JUMP,
        0.1,
        0.0,
    ),
    "Hall noisy": (
        after(0.3, lambda s: s._replace(hall=s.hall + 0.1 * math.cos(3e6 * s.t))),
        (FINE,),
        codes.HALL_NOISY,
        0.3,
        0.05,
    ),
    "clock ahead": (
        after(0.2, lambda s: s._replace(t=s.t + 3600.0)),
        (FAR,),
        codes.CLOCK,
        3600.2,
        0.0011,
    ),
    "clock back": (
        after(0.2, lambda s: s._replace(t=s.t - 0.1)),
        (FAR,),
        codes.CLOCK,
        0.1,
        0.0011,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_spoiled_sensor_stops_the_rig_in_time(name: str) -> None:
    """Stops on following error, on a silent or frozen sensor; outputs safe at once."""
    spoil, moves, fault, since, within = CASES[name]
    rig, inner = drive(spoil, *moves)
    assert rig.watch.fault == fault
    assert since <= rig.watch.time <= since + within
    assert inner.written[-1] == SAFE
    assert inner._outputs == SAFE


def test_heat_without_motion_stops_a_broken_wire() -> None:
    """A wire that does not contract: full heat, no motion at the Hall sensor."""
    start = Settings()
    # A stress shift beyond any temperature: the wires heat and stay extended. The
    # following error alone would stop it, too, so that is opened wide here.
    broken = start._replace(
        bench=start.bench._replace(wire=start.bench.wire._replace(shift=1e4)),
        guard=start.guard._replace(micro_margin=1.0),
    )
    rig, inner = drive(lambda s: s, (MICRO, 2.0e-3, 5.0), settings_=broken)
    assert rig.watch.fault == codes.NO_MOTION
    assert rig.watch.time < 2.5
    assert rig.watch.value > start.guard.warm
    assert inner.written[-1] == SAFE


def test_over_temperature_is_estimated_from_ctrl_alone() -> None:
    """CTRL held high heats the estimate past its limit although every sensor is well."""
    watch, t = guard.fresh(), 0.0
    command = Command(0.0, 0.0, 2.9e-3, 1.0, 2.9e-3)
    while watch.fault == codes.OK and t < 10.0:
        hall = 2.5 + 0.002 * math.sin(37.0 * t) + 1.1  # moves like noise, near 3 mm
        watch, _ = guard.step(
            GUARD,
            watch,
            Sample(t, 0.0, hall, 0.0, 0.0, 0.0),
            command,
            Outputs(0.0, 1.9, 0.0, 0.0),
            DT,
        )
        t += DT
    assert watch.fault == codes.TOO_HOT
    assert watch.value > watch.limit == Limits().hottest
    assert 0.3 < watch.time < 5.0


def test_a_whole_programme_of_big_and_small_moves_trips_nothing() -> None:
    """No false alarm: full travel both ways, full contraction, slow return."""
    rig, _ = drive(
        lambda s: s,
        (MACRO, 2800.0, 0.0),
        (MICRO, 3.8e-3, 2.0),
        (MICRO, 0.3e-3, 2.0),
        (MICRO, 0.0, 2.0),
        (MACRO, 0.0, 0.0),
        (MACRO, 3.0, 0.0),
        (MICRO, 0.5e-3, 2.0),
    )
    assert rig.watch.fault == codes.OK


def test_leaving_the_rig_by_an_exception_leaves_it_safe() -> None:
    plant = bench.prepare(Bench(), Sensors())
    twin = Twin(plant, 0, measure=compiled(bench.measure), advance=compiled(bench.advance))
    rig = Guarded(twin, GUARD, DT)

    def fail() -> None:
        with rig:
            rig.read()
            rig.write(Outputs(3.0, 1.5, 1.0, 0.0))
            assert twin._outputs.motor == 3.0
            raise RuntimeError("controller failed")

    with pytest.raises(RuntimeError):
        fail()
    assert twin._outputs == SAFE


def test_a_rig_whose_stop_fails_is_left_all_the_same() -> None:
    """Its own exit is the last chance to make it safe."""

    class Faulty(Twin):
        left = False

        def stop(self) -> None:
            raise OSError("board gone")

        def __exit__(self, *_: object) -> None:
            self.left = True

    faulty = Faulty(bench.prepare(Bench(), Sensors()), 0)
    with pytest.raises(OSError, match="board gone"), Guarded(faulty, GUARD, DT):
        pass
    assert faulty.left


def watched(
    samples: list[Sample], motor: float, limits: Limits | None = None
) -> tuple[guard.Watch, int]:
    """The guard's state after these samples under a constant push, and at which it tripped."""
    p = guard.prepare(Limits() if limits is None else limits, calibration.default_calibration())
    watch = guard.fresh()
    for k, sample in enumerate(samples):
        watch, _ = guard.step(p, watch, sample, QUIET, Outputs(motor, 0.0, 0.0, 0.0), DT)
        if watch.fault != codes.OK:
            return watch, k
    return watch, -1


def moving(counts: list[float]) -> list[Sample]:
    return [Sample(k * DT, c, 2.5 + 1e-3 * (k % 2), 0.0, 0.0, 0.0) for k, c in enumerate(counts)]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_encoder_that_counts_against_the_motor_stops_it(sign: float) -> None:
    runaway = moving([-2.0 * sign * k for k in range(300)])
    watch, at = watched(runaway, 3.5 * sign)
    assert (watch.fault, at) == (codes.ENCODER_AGAINST, 126)
    assert (watch.value, watch.limit) == (252.0, 250.0)


def test_braking_and_coasting_are_no_reversal() -> None:
    against = [-2.0 * k for k in range(120)]  # 238 counts against the push, then along it
    along = [against[-1] + 2.0 * k for k in range(1, 100)]
    assert watched(moving(against + along + against[:100]), 3.5)[1] == -1
    assert watched(moving([-2.0 * k for k in range(500)]), 1.0)[1] == -1


def test_pushes_that_pause_add_up() -> None:
    p, watch = guard.prepare(Limits(), calibration.default_calibration()), guard.fresh()
    for k, sample in enumerate(moving([-2.0 * k for k in range(400)])):
        push = 3.4 if k % 4 else 0.0  # as homing limits the speed
        watch, _ = guard.step(p, watch, sample, QUIET, Outputs(push, 0.0, 0.0, 0.0), DT)
    assert watch.fault == codes.ENCODER_AGAINST


def test_a_live_machine_leans_no_longer_than_homing_does() -> None:
    still = moving([5.0] * 1500)
    assert watched(still, 3.0, LIVE)[0].fault == codes.STUCK
    tripped = watched(still, 3.0, LIVE)[1] * DT
    assert Live().homing.leans < tripped == pytest.approx(LIVE.leant, abs=2 * DT)
    pushed = watched(still, 4.0, LIVE)[1] * DT
    assert pushed == pytest.approx(0.1, abs=2 * DT)
    assert watched(still, 3.0)[1] == -1
    assert watched(still, 2.8, LIVE)[1] == -1


def test_a_single_spike_and_a_fast_stage_are_no_noise() -> None:
    spike = moving([0.0] * 300)
    spike[100] = spike[100]._replace(hall=4.0)
    assert watched(spike, 0.0)[1] == -1
    fast = [s._replace(hall=0.5 + 0.008 * k) for k, s in enumerate(moving([0.0] * 500))]
    assert watched(fast, 0.0)[1] == -1


def test_what_was_missed_is_no_jump() -> None:
    """A loop that lost 50 ms finds the carriage where it ran meanwhile."""
    run = moving([7.0 * k for k in range(200)])
    assert watched(run[:100] + run[150:], 0.0)[1] == -1
    silent = [s._replace(encoder=math.nan) if 100 <= k < 104 else s for k, s in enumerate(run)]
    assert watched(silent, 0.0)[1] == -1


@pytest.mark.parametrize("told", [math.nan, 0.05])
def test_a_clock_that_stands_or_is_no_number_is_a_fault(told: float) -> None:
    samples = moving([0.0] * 400)
    stands = [s if k < 50 else s._replace(t=told) for k, s in enumerate(samples)]
    watch, tripped = watched(stands, 0.0)
    assert watch.fault == codes.CLOCK_STANDS
    assert 149 <= tripped <= 152  # guard.clock is 0.1 s
    assert watched([*stands[:140], *samples[140:]], 0.0)[1] == -1
