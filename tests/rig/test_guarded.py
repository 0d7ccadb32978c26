"""The guard around a rig watches the sensors that the rig has, and no others."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest

from macromicro.control import calibration
from macromicro.models.electrothermal import Heating
from macromicro.rig import codes, guard, guarded
from macromicro.rig.guard import Watch
from macromicro.rig.guarded import FIELDS, CompiledGuarded, Guarded, restored, store
from macromicro.rig.limits import Limits
from macromicro.types import SAFE, Command, Outputs, Sample

SENSORS = ("encoder", "hall")


def rig(channels: tuple[str, ...]) -> Any:
    """A rig that gives nothing but the time."""
    nan = math.nan
    return SimpleNamespace(
        channels=channels,
        read=lambda: Sample(0.0, nan, nan, nan, nan, nan),
        write=lambda outputs: None,
    )


@pytest.mark.parametrize("channels", [(), ("encoder",), ("hall",), SENSORS])
def test_only_a_sensor_that_is_there_can_fall_silent(channels: tuple[str, ...]) -> None:
    limits = guard.prepare(Limits(), calibration.default_calibration())
    watched = Guarded(rig(channels), limits, 1e-3)
    for _ in range(100):
        watched.write(SAFE._replace(ctrl=1.0))
    assert watched.tripped == bool(channels)
    if channels:
        silent = {"encoder": codes.ENCODER_SILENT, "hall": codes.HALL_SILENT}
        assert watched.watch.fault == silent[channels[0]]
        assert watched.given == SAFE


class Bench:
    """A rig whose readings wander, jump, freeze and fall silent, as a seed says."""

    channels = SENSORS

    def __init__(self, seed: int) -> None:
        self.random, self.k, self.given = np.random.default_rng(seed), 0, []
        self.count, self.hall = 0.0, 2.5

    def read(self) -> Sample:
        self.k += 1
        dice = self.random.random(4).tolist()
        self.count += round(4.0 * (dice[0] - 0.5)) + (900.0 if dice[1] > 0.998 else 0.0)
        self.hall += 0.004 * (dice[2] - 0.5)
        encoder = math.nan if dice[3] > 0.98 else self.count
        hall = math.nan if dice[3] < 0.02 else self.hall
        return Sample(self.k * 1e-3, encoder, hall, 0.0, 0.0, 0.0)

    def write(self, outputs: Outputs) -> None:
        self.given.append(outputs)


def asked(random: np.random.Generator) -> tuple[Command, Outputs]:
    heat, push = 2.0 * random.random(), 8.0 * (random.random() - 0.5)
    fan = 0.5 if random.random() > 0.9999 else float(random.random() > 0.5)
    command = Command(600.0, float(random.random() > 0.3), 1.5, float(random.random() > 0.3), 0.0)
    return command, Outputs(push, heat, fan, 0.0)


@pytest.fixture
def interpreted(monkeypatch: pytest.MonkeyPatch) -> None:
    """The coroutine itself, without a compiler."""
    monkeypatch.setattr(guarded, "compiled", lambda function: function)


@pytest.mark.usefixtures("interpreted")
@pytest.mark.parametrize("seed", range(2))
def test_the_coroutine_gives_the_bits_of_the_guard(seed: int) -> None:
    the_same_bits(seed, 700)


@pytest.mark.usefixtures("interpreted")
@pytest.mark.parametrize("channels", [(), ("encoder",), ("hall",), SENSORS])
def test_the_coroutine_expects_what_is_there(channels: tuple[str, ...]) -> None:
    limits = guard.prepare(Limits(), calibration.default_calibration())
    watched = CompiledGuarded(rig(channels), limits, 1e-3)
    assert (watched.tripped, watched.temperature) == (False, 25.0)
    for k in range(100):
        watched.write(SAFE._replace(ctrl=1.0))
        silent = watched.watch.seen
        aged = ((k + 1) * 1e-3 if name in channels else 1e-3 for name in SENSORS)
        assert (silent.encoder_age, silent.hall_age) == pytest.approx(tuple(aged))
    assert watched.tripped == bool(channels)
    doubtful = "the Hall sensor is silent" if "hall" in channels else ""
    assert watched.doubt == doubtful


@pytest.mark.usefixtures("interpreted")
def test_every_output_comes_back_in_its_place() -> None:
    limits = guard.prepare(Limits(), calibration.default_calibration())
    shown: Any = rig(SENSORS)
    shown.read = lambda: Sample(0.001, 5.0, 2.5, 7.0, 1.0, 0.0)
    watched = CompiledGuarded(shown, limits, 1e-3)
    for outputs in (Outputs(1.25, 1.5, 1.0, 0.0), Outputs(-2.5, 0.5, 0.0, 1.0)):
        watched.read()
        watched.expect(Command(6.0, 1.0, 1.7, 1.0, 1.6))
        watched.write(outputs)
        assert watched.given == outputs
    watch = watched.watch
    assert (watch.seen.encoder, watch.seen.hall, watch.seen.time) == (5.0, 2.5, 0.001)
    assert (watch.macro.reference, watch.micro.reference) == (6.0, 1.7)


Shown = tuple[guard.Watch, Sample, Command, Outputs, float]
KINDS = (Guarded, CompiledGuarded)


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch, interpreted: None) -> list[Shown]:
    """What the guard is shown, period by period."""
    seen: list[Shown] = []
    step = guard.step

    def kept(p: guard.Guard, *rest: Any) -> tuple[guard.Watch, Outputs]:
        seen.append(rest)
        return step(p, *rest)

    monkeypatch.setattr(guard, "step", kept)
    return seen


def counting(channels: tuple[str, ...] = SENSORS) -> Any:
    """A rig whose k-th sample is told by its time; it keeps what it is given."""
    kept = SimpleNamespace(channels=channels, reads=0, given=[])

    def read() -> Sample:
        kept.reads += 1
        return Sample(1e-3 * kept.reads, 5.0, 2.5, 0.007, 1.0, 0.25)

    kept.read, kept.write = read, kept.given.append
    kept.stop = lambda: kept.given.append("stop")
    return kept


LIMITS = guard.prepare(Limits(), calibration.default_calibration())


@pytest.mark.parametrize("kind", KINDS)
def test_the_guard_is_shown_all_that_was_read_that_is_asked_for_and_that_is_to_be_written(
    shown: list[Shown], kind: type[Guarded]
) -> None:
    watched = kind(counting(), LIMITS, 2e-3)
    command, outputs = Command(6.0, 1.0, 1.7, 0.0, 1.6), Outputs(1.25, 1.5, 1.0, 0.0)
    sample = watched.read()
    watched.expect(command)
    watched.write(outputs)
    assert [tuple(s[1:]) for s in shown] == [(sample, command, outputs, 2e-3)]
    other = Command(-6.5, 0.0, 0.3, 1.0, 0.4)
    sample = watched.read()
    watched.expect(other)
    watched.write(SAFE)
    assert tuple(shown[1][1:]) == (sample, other, SAFE, 2e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_each_write_is_judged_by_its_own_sample_and_by_its_own_order(
    shown: list[Shown], kind: type[Guarded]
) -> None:
    """Where nothing was read it is measured; where nothing was ordered nothing is under control."""
    inside = counting()
    watched = kind(inside, LIMITS, 1e-3)
    watched.expect(Command(6.0, 1.0, 1.7, 1.0, 1.6))
    watched.read()
    watched.write(SAFE)
    watched.write(SAFE)
    watched.read()
    watched.read()
    watched.write(SAFE)
    assert inside.reads == 4
    assert [s[1].t for s in shown] == [1e-3, 2e-3, 4e-3]
    assert [s[2] for s in shown[1:]] == [Command(0.0, 0.0, 0.0, 0.0, 0.0)] * 2


class Switched(NamedTuple):
    """What a rig shows that has a limit switch, in an order of its own and without a laser."""

    t: float
    limit_low: float
    encoder: float
    hall: float
    extend: float
    contract: float


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.usefixtures("interpreted")
def test_of_a_rig_that_shows_more_it_takes_its_own_channels(kind: type[Guarded]) -> None:
    inside = counting()
    inside.read = lambda: Switched(0.5, 1.0, 7.0, 2.5, 0.0, 1.0)
    watched = kind(inside, LIMITS, 1e-3)
    sample = watched.read()
    assert isinstance(sample, Sample)
    assert sample[:3] == (0.5, 7.0, 2.5) and math.isnan(sample.laser) and sample[4:] == (0.0, 1.0)
    watched.write(SAFE._replace(motor=1.0))
    assert watched.given.motor == 1.0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.usefixtures("interpreted")
def test_what_has_passed_is_written_and_a_stop_is_safe(kind: type[Guarded]) -> None:
    inside = counting()
    watched = kind(inside, LIMITS, 1e-3)
    assert watched.given == SAFE and watched.channels == SENSORS
    outputs = Outputs(1.25, 1.5, 1.0, 0.0)
    watched.write(outputs)
    assert watched.given == outputs and inside.given == [outputs]
    watched.stop()
    assert watched.given == SAFE and inside.given == [outputs, "stop"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.usefixtures("interpreted")
def test_an_illegal_output_trips_it_for_good_until_another_watch_is_taken_on(
    kind: type[Guarded],
) -> None:
    inside = counting()
    watched = kind(inside, LIMITS, 1e-3)
    assert not watched.tripped and watched.temperature == LIMITS.limits.ambient
    for volts in (99.0, 1.0):
        watched.write(SAFE._replace(motor=volts))
        assert watched.tripped and watched.watch.fault == codes.ILLEGAL
    assert inside.given == [SAFE, SAFE]
    warm = guard.fresh()._replace(heat=guard.Heat(Heating(30.0, 1.0, 2.0), 0.5, 0.0))
    watched.watch = warm
    assert not watched.tripped and repr(watched.watch) == repr(warm)  # NaN equals NaN
    assert watched.temperature == guard.temperature(LIMITS.limits, warm) != LIMITS.limits.ambient
    watched.watch = warm._replace(fault=codes.ILLEGAL)
    assert watched.tripped
    watched.watch = warm
    watched.write(SAFE._replace(motor=1.0))
    assert inside.given[-1] == SAFE._replace(motor=1.0) and not watched.tripped
    assert watched.temperature == guard.temperature(LIMITS.limits, watched.watch)
    assert watched.temperature != guard.temperature(LIMITS.limits, warm)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.usefixtures("interpreted")
def test_a_rig_with_its_own_loop_gets_each_order_until_a_fault(kind: type[Guarded]) -> None:
    """And says what it has put out, which is not what was written."""
    inside = counting()
    orders: list[Command] = []
    inside.aim, inside.put_out = orders.append, Outputs(0.5, 1.25, 1.0, 0.0)
    watched = kind(inside, LIMITS, 1e-3)
    order = Command(6.0, 1.0, 1.7, 0.0, 1.6)
    watched.expect(order)
    watched.write(SAFE._replace(motor=1.0))
    assert orders == [order] and watched.given == inside.put_out
    watched.expect(order)
    watched.write(SAFE._replace(motor=99.0))
    assert watched.tripped and orders == [order] and watched.given == SAFE


@pytest.mark.parametrize("seed", range(8))
def test_the_compiled_guard_gives_the_bits_of_the_guard(seed: int) -> None:
    the_same_bits(seed, 4000)


def the_same_bits(seed: int, periods: int) -> None:
    """As `Guarded`, with all that can be looked at, and another watch taken on."""
    limits = guard.prepare(Limits(), calibration.default_calibration())
    plain, fast = (kind(Bench(seed), limits, 1e-3) for kind in (Guarded, CompiledGuarded))
    random = np.random.default_rng(seed + 100)
    tripped = 0
    for k in range(periods):
        command, outputs = asked(random)
        for each in (plain, fast):
            each.read()
            each.expect(command)
            each.write(outputs)
        assert fast.given == plain.given
        assert fast.tripped == plain.tripped
        assert fast.temperature == plain.temperature
        assert fast.doubt == plain.doubt
        if k % 50 == 0 or plain.tripped:
            assert repr(fast.watch) == repr(plain.watch)  # NaN equals NaN
        if plain.tripped:  # go on from another watch
            tripped += 1
            plain.watch = fast.watch = guard.fresh()._replace(heat=plain.watch.heat)
    assert tripped


def test_the_compiled_guard_expects_no_sensor_that_is_not_there() -> None:
    limits = guard.prepare(Limits(), calibration.default_calibration())
    watched = CompiledGuarded(rig(("encoder",)), limits, 1e-3)
    for _ in range(100):
        watched.write(SAFE._replace(ctrl=1.0))
    assert watched.tripped
    assert watched.watch.fault == codes.ENCODER_SILENT
    assert watched.given == SAFE
    assert not fine_without_any().tripped


def fine_without_any() -> CompiledGuarded:
    watched = CompiledGuarded(
        rig(()), guard.prepare(Limits(), calibration.default_calibration()), 1e-3
    )
    for _ in range(100):
        watched.write(SAFE._replace(ctrl=1.0))
    return watched


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.usefixtures("interpreted")
def test_renewed_it_keeps_the_heat_and_the_last_count_alone(kind: type[Guarded]) -> None:
    watched = kind(counting(), LIMITS, 1e-3)
    fresh = guard.fresh()
    seen = fresh.seen._replace(encoder=5.0, encoder_age=0.25, time=3.0, hall=2.5, against=7.0)
    heat = guard.Heat(Heating(30.0, 1.0, 2.0), 0.5, 4.0)
    watched.watch = fresh._replace(fault=codes.STUCK, value=1.0, limit=2.0, seen=seen, heat=heat)
    assert watched.tripped
    watched.renew()
    assert not watched.tripped
    kept = fresh.seen._replace(encoder=5.0, encoder_age=0.25, time=3.0)
    cold = heat._replace(idle=0.0)
    assert repr(watched.watch) == repr(fresh._replace(seen=kept, heat=cold))


@pytest.mark.parametrize(
    ("age", "jump", "words"),
    [
        (0.0, 3.0, ""),
        (0.0, 2.0, ""),
        (1e-3, 2.0, "no reading of the encoder while a fault was latched"),
        (0.0, 4.0, "the encoder jumped while a fault was latched"),
    ],
)
@pytest.mark.usefixtures("interpreted")
def test_counts_may_be_missed_while_a_fault_is_latched(age: float, jump: float, words: str) -> None:
    watched = Guarded(counting(), LIMITS, 1e-3)
    seen = guard.fresh().seen._replace(encoder_age=age, jump=jump, possible=3.0)
    watched.watch = guard.fresh()._replace(fault=codes.STUCK, seen=seen)
    assert watched.overlooked() == words


def flat(value: Any) -> list[float]:
    """The numbers of nested tuples, in the order of their fields."""
    if isinstance(value, tuple):
        return [number for part in value for number in flat(part)]
    return [value]


def filled(shape: Any, numbers: list[float]) -> Any:
    """A tuple of the same kind with these numbers in the order of its fields."""
    if isinstance(shape, tuple):
        return type(shape)(*(filled(part, numbers) for part in shape))
    return numbers.pop(0)


def test_the_row_holds_the_fields_in_their_order() -> None:
    numbers = [float(k) for k in range(1, FIELDS + 1)]
    watch: Watch = filled(guard.fresh(), [1, *numbers[1:]])
    row = [0.0] * FIELDS
    store(watch, row)
    assert row == numbers
    assert flat(restored(row)) == numbers
    assert type(restored(row).fault) is int
