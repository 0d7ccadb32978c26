"""``macromicro doctor --rig NAME --open``: what a rig keeps, and what is said where it does not."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import pytest

from macromicro.conformance import Finding
from macromicro.rig import contract
from macromicro.rig.fixtures import CycleSample, KilnSample
from macromicro.rig.session import KINDS, Fixture
from macromicro.types import SAFE, Sample


class Bench:
    """Keeps everything; virtual."""

    channels: tuple[str, ...] = ("encoder", "hall", "laser", "extend", "contract")
    dt = 1e-3

    def __init__(self) -> None:
        self.clock, self.ticks, self.written = self, 0, [SAFE][:0]

    def now(self) -> float:
        return self.ticks * self.dt

    def wait(self, dt: float) -> None:
        self.ticks += 1

    def read(self) -> Any:
        return Sample(self.now(), 400.0, 1.25, 0.002, 1.0, 0.0)

    def write(self, outputs: Any) -> None:
        self.written.append(outputs)

    def stop(self) -> None:
        self.write(SAFE)

    def __enter__(self) -> Bench:
        return self

    def __exit__(self, *what: object) -> None: ...


def found(rig: Any, kind: str = "bench", **more: Any) -> dict[str, Finding]:
    known = KINDS[kind]
    fixture = Fixture("mine", kind, lambda seed: rig, rig.channels, rig.dt, **more)
    assert known.dt == rig.dt
    return {each.what: each for each in contract.check(fixture)}


@pytest.mark.parametrize(
    ("late", "words"),
    [(1.4e-3, "the host may close the loop"), (1.7e-3, "too late for a loop on the host")],
)
def test_a_link_that_measures_itself_is_told_what_it_can_carry(late: float, words: str) -> None:
    class Linked(Bench):
        def round_trips(self) -> list[float]:
            assert self.written[-1] == SAFE
            return [1e-3] * 100 + [late] * 10

    seen = found(Linked())["link"]
    assert seen.passed
    assert seen.found.startswith(f"an answer after 1 ms, 99 % within {1e3 * late:g}, worst")
    assert words in seen.found


def test_a_rig_that_keeps_everything() -> None:
    rig = Bench()
    seen = found(rig)
    assert list(seen) == ["open", "channels", "units", "time stamps", "rate", "stop", "again"]
    assert all(each.passed and not each.remedy for each in seen.values())
    assert seen["channels"].found == "encoder, hall, laser, extend, contract"
    assert seen["units"].found == "encoder 400, hall 1.25, laser 0.002, extend 1, contract 0"
    assert "its clock is virtual" in seen["rate"].found
    assert set(rig.written) == {SAFE}, "nothing moves"
    assert len(rig.written) > 500


def test_what_a_bench_without_a_channel_cannot_do() -> None:
    rig = Bench()
    rig.channels = ("hall",)
    rig.read = lambda: Sample(rig.now(), *[math.nan] * 5)._replace(hall=1.0)
    assert found(rig)["channels"].found == (
        "hall; no encoder: no macro-stage; no laser: micro moves are judged by the Hall sensor; "
        "no extend: the guard cannot see the wires at their end; "
        "no contract: the guard cannot see the wires at their end"
    )
    rig.channels = ("encoder",)
    rig.read = lambda: Sample(rig.now(), 3.0, *[math.nan] * 4)
    assert found(rig)["channels"].found == "encoder; no hall: no micro-stage"


def test_a_kiln_and_a_cycle_bench() -> None:
    kiln = Bench()
    kiln.channels, kiln.dt = ("thermocouple", "encoder"), 0.2
    kiln.read = lambda: KilnSample(kiln.now(), 21.0, 5.0)
    seen = found(kiln, "kiln")
    assert all(each.passed for each in seen.values())
    assert seen["open"].found.startswith("kiln, 26 readings")
    assert {len(each) for each in kiln.written} == {1, len(SAFE)}, "a heater's own outputs"
    cycle = Bench()
    cycle.channels = ("encoder", "extend", "contract")
    cycle.read = lambda: CycleSample(cycle.now(), 5.0, 2.0, 0.0)
    assert found(cycle, "cycle")["units"].remedy == "0 or 1, NaN where it is not known"


NAN = math.nan


@pytest.mark.parametrize(
    ("sample", "what", "said", "remedy"),
    [
        ({"hall": NAN}, "channels", "no value of hall in 501 readings", "connect it, or leave"),
        ({"encoder": 1.5}, "units", "encoder is 1.5", "whole counts"),
        ({"hall": 1250.0}, "units", "hall is 1250", "give it in V: at most 15"),
        ({"laser": 2.5}, "units", "laser is 2.5", "give it in m: at most 1"),
        ({"laser": -2500.0}, "units", "laser is -2500", "give it in m"),
        ({"extend": 5.0}, "units", "extend is 5", "0 or 1"),
        ({"contract": -1.0}, "units", "contract is -1", "0 or 1"),
        ({"t": 3.0}, "time stamps", "t goes from 0 to 0 s from one", "the time of each"),
    ],
)
def test_what_a_reading_gets_wrong(
    sample: dict[str, float], what: str, said: str, remedy: str
) -> None:
    rig = Bench()
    good = rig.read
    rig.read = lambda: good()._replace(**sample)
    each = found(rig)[what]
    assert not each.passed
    assert each.found.startswith(said)
    assert remedy in each.remedy


def test_a_channel_that_is_not_named() -> None:
    rig = Bench()
    rig.channels = ("encoder", "hall")
    each = found(rig)["channels"]
    assert (each.passed, each.found[:29]) == (False, "values of laser, extend, cont")


def _shifted(rig: Bench) -> None:
    rig.now = lambda: rig.ticks * 1e-3 * 1.5
    rig.read = lambda: Sample(rig.ticks * 1e-3, 4.0, 1.0, 0.0, 1.0, 0.0)


def _slow(rig: Bench) -> None:
    rig.now = lambda: rig.ticks * 1.1e-3


def _late(rig: Bench) -> None:
    began = time.perf_counter()
    rig.now = lambda: time.perf_counter() - began
    rig.wait = lambda dt: time.sleep(1.6e-3 - 1e-4)


def _late_by_its_own_time(rig: Bench, leap: int) -> None:
    """Late by the computer's clock; by its own one reading in 50 is followed by `leap` periods."""
    periods = iter(range(10**6))

    def wait(dt: float) -> None:
        rig.ticks += leap if next(periods) % 50 == 0 else 1
        time.sleep(1.6e-3 - 1e-4)

    rig.wait = wait


@pytest.mark.parametrize(("leap", "said"), [(1, "0 of 500 missed"), (2, "10 of 500 missed")])
def test_a_machines_own_time_says_what_was_missed(leap: int, said: str) -> None:
    rig = Bench()
    _late_by_its_own_time(rig, leap)
    rate = found(rig, timed=True)["rate"]
    assert said in rate.found and rate.passed is (leap == 1)


def _waiting(rig: Bench) -> None:
    rig.stop = lambda: time.sleep(0.06)


@pytest.mark.parametrize(
    ("change", "what", "said"),
    [
        (_shifted, "time stamps", "s from the clock's `now`"),
        (_slow, "time stamps", "a period of 1.1 ms in the mean, for 1 ms"),
        (_late, "rate", "of 500 missed; a reading takes"),
        (_waiting, "stop", "stop returned after"),
    ],
)
def test_time_and_stop(change: Callable[[Bench], None], what: str, said: str) -> None:
    rig = Bench()
    change(rig)
    each = found(rig)[what]
    assert not each.passed
    assert said in each.found
    assert each.remedy


def test_what_fails_altogether() -> None:
    rig = Bench()
    rig.read = lambda: 1 / 0
    seen = found(rig)
    assert list(seen) == ["open"]
    assert seen["open"].found == "ZeroDivisionError: division by zero"
    once = Bench()
    opened: list[int] = []

    class Once(Bench):
        def __enter__(self) -> Bench:
            opened.append(1)
            if len(opened) > 1:
                raise OSError("port is busy")
            return self

    once = Once()
    seen = found(once)
    assert (seen["again"].passed, seen["again"].found) == (False, "OSError: port is busy")
    assert "__exit__" in seen["again"].remedy
