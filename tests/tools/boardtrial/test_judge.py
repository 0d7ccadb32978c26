"""The judge of the board's outputs: what it lets pass, and what it does not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from boardtrial.judge import DECELERATE, GUARD, PER_PERIOD, SILENCE, SOON, TOLD, Judge
from macromicro.control import calibration
from macromicro.rig.board import control, protocol
from macromicro.rig.limits import Limits

CRC = 77


class Bench:
    """A bench whose pins are set by hand."""

    def __init__(self) -> None:
        self.tick = 0
        self.pins = (0.0, 0.0, 0.0)
        self.forced: dict[str, int] = {}
        self.hot = 25.0

    def outputs(self) -> tuple[float, float, float]:
        return self.pins

    def truth(self) -> Any:
        return SimpleNamespace(wire=self.hot, speed=0.0)

    def tripped(self) -> tuple[bool, bool]:
        return False, False


@pytest.fixture
def judge() -> Judge:
    """A board that was configured."""
    params = control.of(Limits()._replace(motor=4.5), calibration.default_calibration())
    made = Judge(Bench(), params, CRC)  # type: ignore[arg-type]
    made.configured = True
    made.bytes_for_board(b"\0")
    return made


def told(judge: Judge, name: str, **values: float) -> None:
    judge.bytes_for_board(protocol.encode(name, 1, **values))


def pass_(judge: Judge, periods: int, motor: float, ctrl: float = 0.0, on: float = 1.0) -> None:
    for _ in range(periods):
        judge.bench.tick += 1
        judge.bench.pins = (motor, ctrl, on)
        judge.period()


def begun(judge: Judge) -> None:
    told(judge, "begin", parameters=CRC)
    told(judge, "outputs", sample=0, motor=3.0, ctrl=1.0)


def test_what_was_asked_for_is_safe(judge: Judge) -> None:
    begun(judge)
    pass_(judge, 100, 3.0, 1.0)
    assert judge.unsafe == []


@pytest.mark.parametrize("crc", [CRC, 5])
def test_nothing_without_leave(judge: Judge, crc: int) -> None:
    if crc != CRC:
        told(judge, "begin", parameters=crc)
    pass_(judge, 1, 0.0, on=1.0)
    assert "without leave" in judge.unsafe[0]


@pytest.mark.parametrize("name", ["stop", "reset", "illegal"])
def test_nothing_behind_a_stop_a_reset_or_an_order_that_cannot_be(judge: Judge, name: str) -> None:
    begun(judge)
    if name == "stop":
        told(judge, "stop")
    elif name == "reset":
        judge.reset()
    else:
        told(judge, "outputs", sample=0, motor=float("nan"), ctrl=0.0)
    pass_(judge, SOON, 3.0, 1.0)
    assert judge.unsafe == [] or name == "reset"
    pass_(judge, 1, 3.0, 1.0)
    assert "without leave" in judge.unsafe[-1]


def test_other_heat_than_asked_for(judge: Judge) -> None:
    begun(judge)
    pass_(judge, 1, 3.0, 1.02)
    assert judge.unsafe == []
    pass_(judge, 1, 3.0, 1.05)
    assert "CTRL 1.050 V that nobody asked for" in judge.unsafe[-1]


def test_an_order_of_long_ago_is_none(judge: Judge) -> None:
    begun(judge)
    pass_(judge, 1, 3.0, 1.0)
    told(judge, "outputs", sample=0, motor=-1.0, ctrl=1.0)
    pass_(judge, SOON, 3.0, 1.0)
    assert judge.unsafe == []
    pass_(judge, 1, 3.0, 1.0)
    assert "nobody asked for" in judge.unsafe[-1]


@pytest.mark.parametrize(("motor", "safe"), [(3.0, True), (1.5, False), (-3.0, False)])
def test_near_silence_the_order_stands_as_it_is(judge: Judge, motor: float, safe: bool) -> None:
    begun(judge)
    pass_(judge, SILENCE - SOON, 3.0, 1.0)
    told(judge, "keep", sample=0)
    pass_(judge, 1, motor, 1.0)
    assert (judge.unsafe == []) is safe


@pytest.mark.parametrize(
    ("motor", "safe"), [(1.5, True), (3.0, True), (2.3, False), (0.7, False), (-1.5, False)]
)
def test_behind_a_silence_what_had_fallen_or_what_is_asked(
    judge: Judge, motor: float, safe: bool
) -> None:
    begun(judge)
    pass_(judge, SILENCE, 3.0, 1.0)
    for k in range(DECELERATE // 2):
        pass_(judge, 1, 3.0 * (1.0 - k / DECELERATE))
    assert judge.unsafe == []
    told(judge, "outputs", sample=0, motor=3.0, ctrl=0.0)
    pass_(judge, 1, motor)
    assert (judge.unsafe == []) is safe


def test_all_are_counted_though_few_are_told(judge: Judge) -> None:
    pass_(judge, 3 * TOLD, 0.0)
    assert len(judge.unsafe) == TOLD and judge.count == 3 * TOLD


def test_a_flood_is_as_long_as_its_bytes_take(judge: Judge) -> None:
    begun(judge)
    pass_(judge, 10, 3.0, 1.0)
    before = judge.floods  # two orders at once are more than one
    judge.bytes_for_board(bytes([1]) * (3 * PER_PERIOD))
    pass_(judge, 20, 3.0, 1.0)
    assert judge.floods == before + 3 + SOON
    assert "flood" not in judge.since_begin
    pass_(judge, 1, 0.0, on=0.0)
    assert "flood" in judge.since_begin


def test_a_stop_long_behind_a_flood_is_not_its_doing(judge: Judge) -> None:
    begun(judge)
    judge.bytes_for_board(bytes([1]) * PER_PERIOD)
    pass_(judge, GUARD + SOON + 2, 3.0, 1.0)
    pass_(judge, 1, 0.0, on=0.0)
    assert "flood" not in judge.since_begin


def test_silence_lets_the_motor_fall_and_then_nothing(judge: Judge) -> None:
    begun(judge)
    pass_(judge, SILENCE, 3.0, 1.0)
    for k in range(DECELERATE // 2):
        pass_(judge, 1, 3.0 * (1.0 - k / DECELERATE))
    assert judge.unsafe == []
    pass_(judge, 1, 2.9)
    assert "in silence" in judge.unsafe[0] and "nobody asked for" in judge.unsafe[1]
    judge.unsafe.clear()
    pass_(judge, 1, 1.5, 0.5)
    assert "of silence" in judge.unsafe[0]
    judge.unsafe.clear()
    pass_(judge, DECELERATE, 0.0)
    assert "without leave" in judge.unsafe[0]


def test_other_outputs_than_asked_for_and_beyond_the_limits(judge: Judge) -> None:
    begun(judge)
    pass_(judge, 1, 2.9)
    assert "nobody asked for" in judge.unsafe[-1]
    told(judge, "targets", sample=0, macro_reference=9.0, micro_reference=0.0, active=1)
    pass_(judge, 1, 4.6)
    assert "beyond the limits" in judge.unsafe[-1]


@pytest.mark.parametrize(
    ("line", "level", "motor"),
    [("limit_low", 1, -3.0), ("limit_high", 1, 3.0), ("bridge_fault", 0, 3.0)],
)
def test_a_push_against_a_line(judge: Judge, line: str, level: int, motor: float) -> None:
    begun(judge)
    told(judge, "outputs", sample=0, motor=motor, ctrl=0.0)
    judge.bench.forced[line] = level
    pass_(judge, SOON, motor)
    assert judge.unsafe == []
    pass_(judge, 1, motor)
    assert line in judge.unsafe[-1] and line in judge.since_begin


def test_a_wire_that_is_too_hot(judge: Judge) -> None:
    judge.bench.hot = 230.0
    pass_(judge, 1, 0.0, on=0.0)
    assert "230 degC" in judge.unsafe[-1]
