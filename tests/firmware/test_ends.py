"""The live machine of `serve` on a simulated board with limit switches before its stops."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from boardsim.bench import SWITCHES
from macromicro.control import calibration
from macromicro.control.live import messages as m
from macromicro.nominal import PERIOD
from macromicro.rig import guard
from macromicro.rig.board.rig import LOOPS, BoardRig
from macromicro.rig.guarded import CompiledGuarded
from macromicro.serve import live
from macromicro.serve.persist import Restored
from macromicro.serve.settings import LiveSettings
from macromicro.types import SAFE, Command, Outputs
from tests.firmware.built import Bench, Wire, elf, needs_avr

pytestmark = needs_avr
LONGEST = 20_000  # periods
EITHER = pytest.mark.parametrize("loop", [pytest.param("host", marks=pytest.mark.slow), "board"])


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


class Driven:
    """The live machine on a yielding board, period by period."""

    def __init__(self, wire: Wire, loop: str) -> None:
        self.wire, self.said, self.low = wire, [""][:0], 0.0
        self.settings, table = LiveSettings(), calibration.default_calibration()
        self.machine = live.make(self.settings, table, (m.MACRO,))
        rig = BoardRig("simulated", loop, open_port=lambda _: wire)
        rig.yielding = True
        self.guarded = CompiledGuarded(rig, guard.prepare(self.settings.guard, table), PERIOD)

    def begin(self, *requests: object) -> None:
        """The sensors answer, and then the machine these requests."""
        self.machine.begin(self.guarded.read(), Restored(False, 0.0, ""))
        self.period()
        for request in requests:
            assert isinstance(self.machine.accept(request)[0], m.Accepted)

    def period(self) -> None:
        """One, and what was said in it."""
        command, outputs, notices = self.machine.step(self.guarded.read(), PERIOD)
        self.guarded.expect(command)
        self.guarded.write(outputs)
        self.guarded.clock.wait(PERIOD)
        assert not self.guarded.tripped
        self.said += [each.cause for each in notices if isinstance(each, m.Event)]
        self.low = min(self.low, self.wire.bench.state.macro.x)

    def until(self, over: Callable[[], bool]) -> None:
        """Periods until something is so."""
        for _ in range(LONGEST):
            if over():
                return
            self.period()
        raise AssertionError(self.said)


@EITHER
def test_homing_takes_the_lower_switch_for_the_stop(loop: str) -> None:
    wire = _wire()
    driven = Driven(wire, loop)
    with driven.guarded:
        driven.begin(m.Enable(), m.Home())
        driven.until(lambda: driven.machine.view().mode == m.READY)
    assert driven.said == ["end stop found", "end stop confirmed", "homed", "homed"]
    assert driven.machine.view().trusted
    # A few counts beyond the switch, before the stop; the zero is the way back from there.
    pitch = wire.bench.plant.encoder.pitch
    assert SWITCHES[0] - 10 * pitch < driven.low < SWITCHES[0]
    away = driven.settings.live.homing.back_off * pitch
    assert wire.bench.state.macro.x == pytest.approx(SWITCHES[0] + away, abs=10 * pitch)


@EITHER
def test_a_jog_into_a_switch_stalls_as_at_a_stop_and_one_away_goes_on(loop: str) -> None:
    wire = _wire()
    driven = Driven(wire, loop)
    with driven.guarded:
        driven.begin(m.Enable(), m.Jog(m.MACRO, -0.01))
        driven.until(lambda: "stalled" in driven.said)
        driven.until(lambda: driven.machine.view().motion == 0)
        assert wire.bench.tripped() == (True, False)
        assert isinstance(driven.machine.accept(m.Jog(m.MACRO, 0.01))[0], m.Accepted)
        driven.until(lambda: wire.bench.state.macro.x > 0.001)
