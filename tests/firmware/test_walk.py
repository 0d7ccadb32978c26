"""`macromicro doctor --rig board:PORT --open` and `--walk` on the simulated board."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from boardsim.bench import SWITCHES
from macromicro.rig import walk as steps
from macromicro.rig.board._link import BoardError
from macromicro.rig.board.rig import BoardRig
from macromicro.rig.contract import check
from macromicro.rig.session import BENCH, Fixture
from macromicro.rig.walk import GO, SKIP, walk
from macromicro.types import SAFE
from tests.firmware.built import Bench, Wire, elf, needs_avr, until

pytestmark = needs_avr
SWITCHED = ("limit_low", "limit_high")


def _wire(switches: tuple[float, float] | None = SWITCHES) -> Wire:
    bench = Bench(elf())
    bench.switches = switches
    return Wire(bench)


def _fixture(wire: Wire, *, both: bool) -> Fixture:
    def make(seed: int) -> BoardRig:
        return BoardRig("simulated", open_port=lambda _: wire, both=both)

    return Fixture("board:simulated", BENCH, make, make(0).channels, 1e-3)


@pytest.mark.parametrize("both", [pytest.param(False, marks=pytest.mark.slow), True])
def test_it_keeps_to_the_contract_of_rigs_with_one_stage_and_with_two(both: bool) -> None:
    found = {each.what: each for each in check(_fixture(_wire(), both=both))}
    # How many periods a simulator misses is this computer's affair, not the board's.
    wrong = [each for what, each in found.items() if what != "rate" and not each.passed]
    assert not wrong and found["rate"].found
    shown = ("encoder", *(("hall", "extend", "contract") if both else ()), *SWITCHED)
    assert found["link"].found.startswith("an answer after ")
    assert found["channels"].found.startswith(", ".join(shown))


def _helping(step: steps.Step, lines: list[str]) -> str:
    return SKIP if step.by_hand else GO


@pytest.mark.slow
def test_the_first_power_up_finds_direction_ends_and_heat() -> None:
    wire = _wire()
    found = {e.what: e for e in walk(_fixture(wire, both=True), steps.Limits(6.0), _helping)}
    assert list(found) == ["direction", "ends", "heat", "walk"]
    assert all(each.passed for each in found.values()), found
    assert "limit_low and limit_high tripped, each at its end; 28" in found["ends"].found
    assert 0.05 < wire.bench.state.macro.x < 0.15  # m: back in the middle


@pytest.mark.slow
def test_a_step_behind_one_that_the_board_stopped_is_not_told_its_fault() -> None:
    """Without switches the board's guard finds that it pushes in vain."""
    found = {
        e.what: e
        for e in walk(_fixture(_wire(None), both=True), steps.Limits(6.0), _helping)
    }  # fmt: skip
    assert not found["ends"].passed and "does not move" in found["ends"].found
    assert found["heat"].passed, found["heat"].found


def _pushed(rig: BoardRig, volts: float, over: Callable[[], bool]) -> None:
    for _ in range(9000):
        if over():
            return
        rig.write(SAFE._replace(motor=volts))
        rig.wait(1e-3)
        rig.read()
    raise AssertionError("nothing came of it")


def test_a_switch_is_read_before_it_is_an_error_and_then_if_more_is_asked_for_before_a_stop() -> (
    None
):
    wire = _wire()
    with BoardRig("simulated", open_port=lambda _: wire) as rig:
        _pushed(rig, -4.0, lambda: rig.read().limit_low == 1.0)
        assert not wire.bench.outputs().any()
        rig.stop()
        until(wire, lambda: abs(wire.bench.state.macro.v) < 1e-4, 3000)
        for _ in range(10):  # it stands in the switch, and that is no error
            rig.wait(1e-3)
            assert rig.read().limit_low == 1.0
        _pushed(rig, 4.0, lambda: rig.read().limit_low == 0.0)
        rig.stop()
    with BoardRig("simulated", open_port=lambda _: wire) as rig:
        _pushed(rig, -4.0, lambda: rig.read().limit_low == 1.0)
        rig.write(SAFE)  # does not take it back
        with pytest.raises(BoardError, match="limit switch"):
            rig.write(SAFE._replace(motor=4.0))


def test_a_fault_is_told_once_and_the_next_drive_begins_without_it() -> None:
    wire = _wire()
    with BoardRig("simulated", open_port=lambda _: wire) as rig:
        wire.bench.forced["bridge_fault"] = 0
        with pytest.raises(BoardError, match="bridge"):
            _pushed(rig, 3.0, lambda: False)
        wire.bench.forced.clear()
        _pushed(rig, 3.0, lambda: wire.bench.state.macro.v > 0.01)
