"""The guard around a rig watches the sensors that the rig has, and no others."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from macromicro.control import calibration
from macromicro.rig import codes, guard
from macromicro.rig.guarded import CompiledGuarded, Guarded
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
    limits = guard.prepare(Limits(), calibration.shipped())
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


@pytest.mark.parametrize("seed", range(8))
def test_the_compiled_guard_gives_the_bits_of_the_guard(seed: int) -> None:
    limits = guard.prepare(Limits(), calibration.shipped())
    plain, fast = (kind(Bench(seed), limits, 1e-3) for kind in (Guarded, CompiledGuarded))
    random = np.random.default_rng(seed + 100)
    tripped = 0
    for k in range(4000):
        command, outputs = asked(random)
        for each in (plain, fast):
            each.read()
            each.expect(command)
            each.write(outputs)
        assert fast.given == plain.given
        assert fast.tripped == plain.tripped
        assert fast.temperature == plain.temperature
        if k % 50 == 0 or plain.tripped:
            assert repr(fast.watch) == repr(plain.watch)  # NaN equals NaN
        if plain.tripped:  # go on from another watch
            tripped += 1
            plain.watch = fast.watch = guard.fresh()._replace(heat=plain.watch.heat)
    assert tripped


def test_the_compiled_guard_expects_no_sensor_that_is_not_there() -> None:
    limits = guard.prepare(Limits(), calibration.shipped())
    watched = CompiledGuarded(rig(("encoder",)), limits, 1e-3)
    for _ in range(100):
        watched.write(SAFE._replace(ctrl=1.0))
    assert watched.tripped
    assert watched.watch.fault == codes.ENCODER_SILENT
    assert watched.given == SAFE
    assert not fine_without_any().tripped


def fine_without_any() -> CompiledGuarded:
    watched = CompiledGuarded(rig(()), guard.prepare(Limits(), calibration.shipped()), 1e-3)
    for _ in range(100):
        watched.write(SAFE._replace(ctrl=1.0))
    return watched
