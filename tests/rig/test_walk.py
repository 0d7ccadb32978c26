"""``macromicro doctor --rig NAME --walk``: what each step finds on rigs that are right or wrong."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import pytest

from macromicro.conformance import Finding
from macromicro.plant import bench
from macromicro.rig import _strokes
from macromicro.rig import walk as steps
from macromicro.rig.session import Fixture
from macromicro.rig.twin import CompiledTwin
from macromicro.rig.walk import END, GO, SKIP, walk
from macromicro.settings import Settings
from macromicro.types import SAFE, Outputs

LOW, HIGH = -140.0, 3000.0  # counts
SWITCHES = (-120.0, 2980.0)
BREAKS = 1.2  # V
PER_VOLT = 1000.0  # counts/s for each volt beyond that
HAND = 100.0  # counts/s


class Shown(NamedTuple):
    """Channels of the rig."""

    t: float
    encoder: float
    hall: float
    limit_low: float
    limit_high: float


class Machine:
    """A stage between two stops with switches, a Hall sensor, a wire; `wrong` names its faults.

    A hand pushes the stage up, and the platform to and fro, in the steps that ask for it.
    """

    channels = ("encoder", "hall", "limit_low", "limit_high")

    def __init__(self, wrong: str = "") -> None:
        self.wrong, self.clock, self.place, self.heat, self.swing = wrong, self, 500.0, 0.0, 0.0
        self.outputs, self.greatest, self.ticks = SAFE, SAFE, 0
        self.pushed, self.asked = "", 0.0  # by hand: in which step, and since when

    def now(self) -> float:
        return 1e-3 * self.ticks

    def wait(self, dt: float) -> None:
        self.ticks += 1
        motor = -self.outputs.motor if self.wrong == "motor" else self.outputs.motor
        motor = 0.0 if self.wrong == "dead" else motor
        motor = max(motor, 0.0) if self.wrong == "half" else motor
        pull = max(abs(motor) - BREAKS, 0.0)
        speed = math.copysign(PER_VOLT * pull, motor)
        if self.pushed == "encoder":
            speed = HAND
        if self.pushed == "Hall sensor" and self.wrong != "magnets":
            since = max(self.now() - self.asked - 1.0, 0.0)  # it is to stand before
            self.swing = 1.5 * math.sin(2.0 * since)
        self.place = min(max(self.place + speed * dt, LOW), HIGH)
        warm = 0.3 if self.outputs.ctrl > 1.5 and self.wrong != "wire" else 0.0
        lag = 1e9 if self.wrong == "hot" and warm < self.heat else 0.5
        self.heat += (warm - self.heat) * dt / lag

    def read(self) -> Any:
        at = -self.place if self.wrong == "encoder" else self.place
        low, high = float(self.place < SWITCHES[0]), float(self.place > SWITCHES[1])
        if self.wrong == "switches":
            low, high = high, low
        if self.wrong == "cut":
            low = 1.0
        if self.wrong == "silent":
            high = 0.0
        hall = 2.5 + self.swing + self.heat
        if self.wrong == "noise":
            hall += 0.1 * (-1.0) ** self.ticks
        if self.wrong == "rail":
            hall = min(hall + 1.5, 5.0)
        return Shown(self.now(), float(math.floor(at)), hall, low, high)

    def write(self, outputs: Outputs) -> None:
        self.outputs = outputs
        self.greatest = Outputs(
            *(max(a, abs(b)) for a, b in zip(self.greatest, outputs, strict=True))
        )

    def stop(self) -> None:
        self.outputs = SAFE

    def __enter__(self) -> Machine:
        return self

    def __exit__(self, *what: object) -> None:
        self.stop()


def fixture(rig: Any, channels: tuple[str, ...]) -> Fixture:
    return Fixture("mine", "bench", lambda seed: rig, channels, 1e-3)


def helping(rig: Machine) -> Callable[[steps.Step, list[str]], str]:
    """A person who agrees, and pushes where a step says so."""

    def ask(step: steps.Step, lines: list[str]) -> str:
        assert rig.outputs == SAFE, "while it asks"
        rig.pushed, rig.asked, rig.swing = step.name, rig.now(), 0.0
        return GO

    return ask


def walked(wrong: str = "", motor: float = 6.0) -> tuple[dict[str, Finding], Machine]:
    rig = Machine(wrong)
    found = walk(fixture(rig, rig.channels), steps.Limits(motor), helping(rig))
    return {each.what: each for each in found}, rig


def test_a_rig_that_is_right() -> None:
    found, rig = walked()
    assert list(found) == ["encoder", "direction", "ends", "Hall sensor", "heat", "walk"]
    assert all(each.passed and not each.remedy for each in found.values())
    assert found["encoder"].found.startswith("counts rise towards the upper end: +200")
    assert "breaks away at 1.4 V and -1.4 V" in found["direction"].found
    assert "3101 counts from -121 to 2980" in found["ends"].found
    assert "1 to 4 V pushed by hand" in found["Hall sensor"].found
    assert found["heat"].found.startswith("the wire contracts and lets go; CTRL 1.7 V for 1 s")
    assert found["walk"].found == "right: encoder, direction, ends, Hall sensor, heat"
    assert rig.place == pytest.approx(0.5 * (LOW + HIGH), abs=30.0)
    assert rig.greatest.motor < 2.1, "no more than it takes to move"
    assert rig.greatest == Outputs(rig.greatest.motor, steps.CTRL, 0.0, 0.0)


@pytest.mark.parametrize(
    ("wrong", "step", "found", "remedy"),
    [
        ("encoder", "encoder", "counts fall towards the upper end", "channels A and B"),
        ("motor", "direction", "counts fall with a positive voltage", "swap the motor's wires"),
        ("dead", "direction", "it does not move", "enable line"),
        ("half", "direction", "one way only", "half of an amplifier"),
        ("cut", "ends", "limit_low tripped in the middle", "NC instead of NO"),
        ("switches", "ends", "limit_high at the lower end", "swap the two switches"),
        ("silent", "ends", "limit_high did not trip", "the switch's place"),
        ("noise", "Hall sensor", "a noise of 1e+02 mV", "shielded"),
        ("magnets", "Hall sensor", "pushed by hand", "which way round"),
        ("rail", "Hall sensor", "to 5 V pushed by hand", "an end of 0 to 5 V"),
        ("wire", "heat", "it does not contract", "crimps"),
        ("hot", "heat", "100 % of it left", "is the driver off"),
    ],
)
def test_what_is_wrong_is_said_in_words(wrong: str, step: str, found: str, remedy: str) -> None:
    seen, _ = walked(wrong)
    assert not seen[step].passed
    assert found in seen[step].found
    assert remedy in seen[step].remedy
    assert not seen["walk"].passed
    assert step in seen["walk"].found.partition("not right: ")[2]
    if step == "direction":
        assert "ends" not in seen, "nothing is driven to an end in an unknown direction"
        assert "without a direction: ends" in seen["walk"].found


def test_what_is_not_agreed_to_does_not_move() -> None:
    rig = Machine()
    asked: list[str] = []

    def ask(step: steps.Step, lines: list[str]) -> str:
        asked.append(step.name)
        return SKIP if step.name == "encoder" else END

    found = list(walk(fixture(rig, rig.channels), steps.Limits(6.0), ask))
    assert asked == ["encoder", "direction"]
    assert [each.what for each in found] == ["walk"]
    assert "skipped: encoder, direction, Hall sensor, heat" in found[0].found
    assert not found[0].passed
    assert (rig.ticks, rig.greatest) == (0, SAFE)


def test_the_motor_gets_no_more_than_permitted() -> None:
    found, rig = walked(motor=1.0)
    assert "it does not move" in found["direction"].found
    assert rig.greatest.motor <= 1.0


def test_a_step_that_fails_ends_with_safe_outputs(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Machine()
    shown = rig.read

    def read() -> Any:
        if rig.outputs.motor > 0.5:
            raise OSError("cable")
        return shown()

    monkeypatch.setattr(rig, "read", read)
    found = {e.what: e for e in walk(fixture(rig, rig.channels), steps.Limits(6.0), helping(rig))}
    assert found["direction"].found == "OSError: cable"
    assert rig.outputs == SAFE


def test_the_virtual_bench_is_found_as_it_is() -> None:
    settings = Settings()
    plant = bench.prepare(settings.bench, settings.sensors)
    state = bench.initial(plant)
    state = state._replace(macro=state.macro._replace(x=0.1))
    channels = ("encoder", "hall", "laser", "extend", "contract")
    rig = CompiledTwin(plant, 1, state=state)
    said: list[str] = []

    def ask(step: steps.Step, lines: list[str]) -> str:
        said.extend(lines)
        return SKIP if step.by_hand else GO

    found = {e.what: e for e in walk(fixture(rig, channels), steps.Limits(6.0), ask)}
    assert found["walk"].found == "right: direction, ends, heat; skipped: encoder, Hall sensor"
    ends = found["ends"].found
    assert ends.endswith("No limit switches")
    counts = float(ends.split()[3])
    pitch = settings.sensors.encoder.pitch
    carriage = settings.bench.carriage
    assert counts * pitch == pytest.approx(carriage.stop_high - carriage.stop_low, abs=2e-3)
    assert "CTRL 1.7 V for 1 s" in " ".join(said)
    assert _strokes.LONGEST == 20.0
