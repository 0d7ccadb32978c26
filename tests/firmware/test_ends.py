"""The live machine of `serve` on a simulated board with limit switches before its stops."""

from __future__ import annotations

import numpy as np
import pytest

from boardsim.bench import SWITCHES
from macromicro.control import calibration
from macromicro.control.live import messages as m
from macromicro.nominal import PERIOD
from macromicro.rig import guard
from macromicro.rig.board.rig import BOARD_LOOP, HOST_LOOP, LOOPS, BoardRig
from macromicro.rig.guarded import CompiledGuarded
from macromicro.serve import live
from macromicro.serve.persist import Restored
from macromicro.serve.settings import LiveSettings
from macromicro.types import SAFE, Command, Outputs
from tests.firmware.built import Bench, Wire, elf, needs_avr

pytestmark = needs_avr
LONGEST = 20_000  # periods


def _wire() -> Wire:
    bench = Bench(elf())
    bench.switches = SWITCHES
    return Wire(bench)


@pytest.mark.parametrize("loop", LOOPS)
def test_a_yielding_board_puts_nothing_out_on_a_switch_and_drives_away_from_it(loop: str) -> None:
    wire = _wire()

    def go(sign: float, periods: int) -> list[float]:
        """What the switch shows while the carriage is wanted far away."""
        shown = []
        for _ in range(periods):
            encoder = rig.read().encoder
            rig.aim(Command(encoder + 80.0 * sign, 1.0, 0.0, 0.0, 0.0))
            rig.write(Outputs(4.0 * sign, 0.0, 0.0, 0.0))
            rig.wait(1e-3)
            shown.append(rig.read().limit_low)
        return shown

    with BoardRig("simulated", loop, open_port=lambda _: wire) as rig:
        rig.yielding = True
        tripped = go(-1.0, 400)
        first = tripped.index(1.0)
        assert tripped[first:] == [1.0] * (400 - first)
        assert not np.any(wire.trace[-300:])
        rig.write(SAFE)
        assert go(1.0, 60)[-1] == 0.0
        assert wire.bench.outputs()[0] > 3.0


@pytest.mark.parametrize("loop", [HOST_LOOP, pytest.param(BOARD_LOOP, marks=pytest.mark.slow)])
def test_homing_takes_the_lower_switch_for_the_stop(loop: str) -> None:
    wire = _wire()
    settings, table = LiveSettings(), calibration.shipped()
    machine = live.make(settings, table, (m.MACRO,))
    rig = BoardRig("simulated", loop, open_port=lambda _: wire)
    rig.yielding = True
    low, said = 0.0, []
    with CompiledGuarded(rig, guard.prepare(settings.guard, table), PERIOD) as guarded:
        machine.begin(guarded.read(), Restored(False, 0.0, ""))
        for k in range(LONGEST):
            if k == 1:  # the sensors have answered
                for request in (m.Enable(), m.Home()):
                    assert isinstance(machine.accept(request)[0], m.Accepted)
            command, outputs, notices = machine.step(guarded.read(), PERIOD)
            guarded.expect(command)
            guarded.write(outputs)
            guarded.clock.wait(PERIOD)
            said += [each.cause for each in notices if isinstance(each, m.Event)]
            low = min(low, wire.bench.state.macro.x)
            if machine.view().mode == m.READY:
                break
        assert not guarded.tripped
    assert said == ["end stop found", "end stop confirmed", "homed", "homed"]
    assert machine.view().trusted
    # A few counts beyond the switch, before the stop; the zero is the way back from there.
    pitch = wire.bench.plant.encoder.pitch
    assert SWITCHES[0] - 10 * pitch < low < SWITCHES[0]
    away = settings.live.homing.back_off * pitch
    assert wire.bench.state.macro.x == pytest.approx(SWITCHES[0] + away, abs=10 * pitch)
