"""The very binary in simavr, its pins at the virtual bench."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest

from macromicro.rig.board import control, protocol
from macromicro.rig.board._link import BoardError
from macromicro.rig.board.protocol import SPEC
from macromicro.types import SAFE, Command, Outputs
from tests.firmware.built import Bench, Wire, board, elf, needs_avr, until

pytestmark = needs_avr
PUSH = Outputs(4.0, 1.0, 0.0, 0.0)
STOPPED = SPEC["silence"] + SPEC["decelerate"] + 20  # periods, with some of the host's last


def _drive(rig: object, outputs: Outputs, periods: int) -> None:
    for _ in range(periods):
        rig.read()
        rig.write(outputs)
        rig.wait(1e-3)


def test_a_reset_moves_nothing() -> None:
    wire = Wire(Bench(elf()))
    wire.alone(100)
    wire.bench.avr.reset()
    wire.alone(1000)
    assert not np.any(wire.trace)


def test_outputs_reach_the_pins_a_period_later_and_move_the_carriage() -> None:
    with board() as (rig, wire):
        _drive(rig, PUSH, 1)
        began = len(wire.trace)
        _drive(rig, PUSH, 200)
        motor, ctrl, enabled = np.array(wire.trace[began:]).T
        assert np.all(enabled == 1.0)
        assert motor.mean() == pytest.approx(4.0, abs=5.0 / 800)
        assert ctrl.mean() == pytest.approx(1.0, abs=5.0 / 250 / 200)
        assert rig.read().encoder == pytest.approx(wire.bench._place, abs=8)
        assert rig.read().encoder > 100
        status = rig.status()
        assert status["skipped"] == 0


def test_the_count_is_that_of_the_bench_after_moves_both_ways() -> None:
    with board() as (rig, wire):
        for volts in (5.0, -5.0, 4.0, -4.5):
            _drive(rig, Outputs(volts, 0.0, 0.0, 0.0), 150)
        _drive(rig, SAFE, 400)
        assert rig.read().encoder == wire.bench._place
        assert rig.status()["skipped"] == 0


def test_hall_is_measured_to_12_bits() -> None:
    with board() as (rig, wire):
        _drive(rig, SAFE, 50)
        seen = []
        for _ in range(100):
            seen.append(rig.read().hall)
            rig.wait(1e-3)
        assert np.mean(seen) == pytest.approx(wire.bench.state.hall, abs=1.5e-3)
        assert np.std(seen) < 1.2e-3


def test_silence_decelerates_and_then_stops() -> None:
    with board() as (rig, wire):
        _drive(rig, PUSH, 100)
        began = len(wire.trace)
        wire.alone(STOPPED + 300)
        motor, ctrl, enabled = np.array(wire.trace[began:]).T
        assert motor[SPEC["silence"] - 10] == pytest.approx(4.0, abs=0.02)
        slope = motor[SPEC["silence"] + 20 : SPEC["silence"] + 180]
        assert np.all(np.diff(slope) < 0.01)
        assert slope[-1] < 0.15 * 4.0
        assert np.all(ctrl[SPEC["silence"] + 5 :] == 0.0)
        assert not np.any(enabled[STOPPED:])
        assert not np.any(motor[STOPPED:])
        assert abs(wire.bench.state.macro.v) < 1e-4
        told = rig.status()
        assert told["fault"] == SPEC["faults"]["host_silent"]
        assert protocol.bits(int(told["state"]), SPEC["state"])["silent"]
        with pytest.raises(BoardError, match="the host was silent"):
            _drive(rig, PUSH, 2)


def test_a_reset_in_motion_stops_and_drives_no_more() -> None:
    with board() as (rig, wire):
        _drive(rig, PUSH, 100)
        wire.bench.avr.reset()
        began = len(wire.trace)
        for _ in range(200):
            wire.write(protocol.encode("outputs", 0, sample=0, motor=4.0, ctrl=1.0))
        assert not np.any(np.array(wire.trace[began:])[:, 2])
        told = rig.status()
        assert not protocol.bits(int(told["state"]), SPEC["state"])["trusted"]
        with pytest.raises(BoardError, match="parameters"):
            rig.link.ask("begin", "done", parameters=1)


def test_a_main_loop_that_hangs_is_reset_by_the_watchdog_and_moves_nothing() -> None:
    with board() as (rig, wire):
        _drive(rig, PUSH, 50)
        mend = wire.bench.avr.hang()
        began = len(wire.trace)
        off = until(wire, lambda: not wire.bench.avr.level("enable"), 60)
        mend()
        wire.alone(200)
        told = rig.link.ask("hello", "identity", version=protocol.VERSION)
        assert off <= 50  # the guard's patience; the watchdog comes sooner
        assert told["reset"] == 1 << SPEC["resets"]["watchdog"]
        assert not np.any(np.array(wire.trace[began + off + 1 :]))
        assert not protocol.bits(int(rig.status()["state"]), SPEC["state"])["trusted"]


@pytest.mark.parametrize("injury", ["encoder_a", "encoder_b", "short"])
def test_a_cut_or_shorted_line_of_the_encoder_is_found_by_the_boards_guard(injury: str) -> None:
    with board() as (rig, wire):
        _drive(rig, PUSH, 50)
        wire.bench.cut = "" if injury == "short" else injury
        wire.bench.shorted = injury == "short"
        with pytest.raises(BoardError, match="the board stopped"):
            _drive(rig, PUSH, 1000)
        until(wire, lambda: not wire.bench.avr.level("enable"), 10)


def test_a_limit_switch_stops_a_push_on_it_and_no_way_back() -> None:
    with board() as (rig, wire):
        _drive(rig, PUSH, 50)
        wire.bench.forced["limit_high"] = 1
        with pytest.raises(BoardError, match="limit switch"):
            _drive(rig, PUSH, 20)
    with board() as (rig, wire):
        wire.bench.forced["limit_high"] = 1
        _drive(rig, PUSH._replace(motor=-4.0), 50)
        assert rig.status()["fault"] == 0


def test_a_fault_of_the_bridge_stops() -> None:
    with board() as (rig, wire):
        _drive(rig, PUSH, 5)
        wire.bench.forced["bridge_fault"] = 0
        with pytest.raises(BoardError, match="bridge"):
            _drive(rig, PUSH, 20)


@pytest.mark.parametrize("asked", [9.0, float("nan")])
def test_what_is_out_of_range_is_not_put_out(asked: float) -> None:
    with board() as (rig, wire):
        _drive(rig, PUSH, 5)
        began = len(wire.trace)
        rig.link.tell("outputs", sample=0, motor=asked, ctrl=0.0)
        wire.alone(5)
        assert rig.status()["fault"] == 1
        assert not np.any(np.array(wire.trace[began + 2 :]))


def test_a_wire_that_is_estimated_too_hot_is_switched_off() -> None:
    with board() as (rig, wire), pytest.raises(BoardError, match="the board stopped"):
        _drive(rig, Outputs(0.0, 5.0, 0.0, 0.0), 4000)
    assert not np.any(np.array(wire.trace[-3:]))


def test_a_reset_leaves_the_estimated_heat_and_new_power_begins_cold() -> None:
    with board() as (rig, wire):
        _drive(rig, Outputs(0.0, 1.9, 0.0, 0.0), 400)
        hot = rig.status()["temperature"]
        assert hot > 60.0
        wire.bench.avr.reset()
        wire.alone(2)
        after = rig.status()["temperature"]
        assert 0.7 * hot < after <= hot + 1.0
    with board() as (rig, _):
        assert rig.status()["temperature"] < 30.0


@pytest.mark.slow
def test_both_stages_at_once_are_no_noise_of_the_hall_sensor() -> None:
    """The guard comes every ten periods then; a stage that starts within them is not noise."""
    with board("board") as (rig, _):
        for k in range(4):
            command = Command(100.0 + 1000.0 * (k % 2), 1.0, 1e-3 + 2e-3 * (k % 2), 1.0, 0.0)
            for _ in range(300):
                rig.read()
                rig.aim(command)
                rig.write(SAFE)
                rig.wait(1e-3)
        assert rig.status()["fault"] == 0


def _hall(wire: Wire, rig: object, volts: list[float | None]) -> None:
    """Both stages under control while the Hall sensor shows this; None: what is so."""
    for level in volts:
        wire.bench.hall = level
        rig.read()
        rig.aim(Command(1000.0, 1.0, 2e-3, 1.0, 0.0))
        rig.write(SAFE)
        rig.wait(1e-3)


@pytest.mark.slow
def test_one_spike_of_the_hall_sensor_is_no_noise_whenever_it_comes() -> None:
    """The guard comes every ten periods then: three that it sees do not stand for ten."""
    with board("board") as (rig, wire):
        _hall(wire, rig, 10 * [4.9, *130 * [None]])
        assert rig.status()["fault"] == 0


@pytest.mark.slow
def test_noise_that_goes_on_is_found_between_the_guards_looks() -> None:
    with (
        board("board") as (rig, wire),
        pytest.raises(BoardError, match=r"the board stopped.*noisy"),
    ):
        _hall(wire, rig, 20 * [2.4, 2.6])


@pytest.mark.slow
def test_a_run_has_no_gap_where_the_board_begins_to_drive() -> None:
    with board() as (rig, _):
        times = []
        for k in range(60):
            times.append(rig.read().t)
            rig.write(PUSH if 10 <= k < 30 or k > 40 else SAFE)
            if k == 30:
                rig.stop()
            rig.wait(1e-3)
    assert np.diff(times[:30]) == pytest.approx(1e-3)
    assert np.diff(times[35:]) == pytest.approx(1e-3)


def test_parameters_are_read_back_and_compared() -> None:
    with board() as (rig, _):
        flat = control.flat(rig._params)
        for index in (0, 40, 46, 47, len(flat) - 1):
            stored = rig.link.ask("get", "parameter", index=index)["value"]
            assert stored == control.single(list(flat.values())[index])
        with pytest.raises(BoardError, match="no such parameter"):
            rig.link.ask("get", "parameter", index=len(flat))
        _drive(rig, PUSH, 3)
        with pytest.raises(BoardError, match="outputs are on"):
            rig.link.ask("set", "parameter", index=0, value=9.0)


def test_a_parameter_that_changed_keeps_it_from_driving() -> None:
    with board() as (rig, _):
        rig.link.ask("set", "parameter", index=0, value=4.5)
        with pytest.raises(BoardError, match="not those that were written"):
            _drive(rig, PUSH, 1)


@pytest.mark.parametrize(("field", "age"), [("version", "older"), ("firmware", "other")])
def test_another_firmware_is_refused_with_what_to_flash(
    field: str, age: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    there = {"version": protocol.VERSION, "firmware": protocol.FIRMWARE}
    there[field] += 1 if age == "other" else -1
    heard = protocol.decode

    def other(body: bytes) -> protocol.Frame | None:
        frame = heard(body)
        if frame is not None and frame.name == "identity":
            return frame._replace(values=frame.values | there)
        return frame

    monkeypatch.setattr(protocol, "decode", other)
    with (
        pytest.raises(
            BoardError, match=f"firmware is {age}.*flash the file of `macromicro export hex`"
        ),
        board(),
    ):
        pass


def test_control_fits_its_period_and_the_stack_its_memory() -> None:
    with board() as (rig, _):
        for volts in (5.0, -5.0):
            _drive(rig, Outputs(volts, 1.5, 0.0, 0.0), 150)
        told = rig.status()
    assert 1000 < told["cycles"] < 16_000
    assert told["missed"] == 0
    assert told["free"] > 200
    assert told["stack"] + told["free"] < 2048


def test_the_program_fits_behind_a_bootloader() -> None:
    shown = subprocess.run(["avr-size", str(elf())], capture_output=True, text=True, check=True)
    text, data, bss = (int(word) for word in shown.stdout.splitlines()[1].split()[:3])
    assert text + data <= 32_768 - 2_048  # the older bootloader of the Nano
    assert data + bss <= 1_200


@pytest.mark.slow
def test_flipped_bits_lose_frames_but_no_outputs() -> None:
    with board() as (rig, wire):
        _drive(rig, PUSH, 5)
        wire.flips = 1e-3
        began = len(wire.trace)
        for _ in range(3):
            _drive(rig, Outputs(4.0, 1.0, 0.0, 0.0), 100)
            _drive(rig, Outputs(-4.0, 0.0, 0.0, 0.0), 100)
        wire.flips = 0.0
        motor, ctrl, _ = np.array(wire.trace[began:]).T
        assert set(np.unique(np.round(motor, 2))) <= {-4.0, 4.0}
        assert np.all((ctrl == 0.0) | (np.abs(ctrl - 1.0) < 0.021))
        assert rig.status()["bad"] + rig.link.bad > 0


def test_noise_on_the_line_does_nothing() -> None:
    with board() as (rig, wire):
        random = np.random.default_rng(1)
        wire.bench.avr.put(random.integers(0, 256, 400, np.uint8).tobytes())
        wire.alone(20)
        assert not np.any(wire.trace)
        assert rig.status()["bad"] > 0
