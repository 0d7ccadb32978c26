"""A board that closes the loop: its gains are those that were sent, and what is recorded of its
efforts is what it put out."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.control import calibration
from macromicro.control.pd import PdTuned
from macromicro.control.settings import Control
from macromicro.rig import guard
from macromicro.rig.board import control
from macromicro.rig.board.rig import BOARD_LOOP, HOST_LOOP, BoardRig
from macromicro.rig.guarded import Guarded
from macromicro.rig.limits import Limits
from macromicro.types import Command, Outputs
from tests.firmware.built import Bench, Wire, elf, needs_avr

pytestmark = needs_avr
AIM = Command(300.0, 1.0, 0.0, 0.0, 0.0)
ASKED = Outputs(1.25, 0.0, 0.0, 0.0)  # what a law of the host would give


def driven(loop: str, gains: Control, periods: int = 150) -> tuple[np.ndarray, np.ndarray]:
    """Efforts as recorded, and as the bridge had them."""
    table = calibration.default_calibration()
    wire = Wire(Bench(elf()))
    params = control.of(Limits(), None, gains)
    recorded = []
    with BoardRig("simulated", loop, None, params, lambda _: wire) as rig:
        rig.wait(1e-3)
        guarded = Guarded(rig, guard.prepare(Limits(), table), 1e-3)
        began = len(wire.trace)
        for _ in range(periods):
            guarded.read()
            guarded.expect(AIM)
            guarded.write(ASKED)
            recorded.append(guarded.given.motor)
            rig.wait(1e-3)
        put_out = np.array(wire.trace[began:])[:, 0]
    return np.array(recorded), put_out


def test_the_boards_own_efforts_are_recorded() -> None:
    recorded, put_out = driven(BOARD_LOOP, Control())
    going = recorded[recorded != ASKED.motor]  # the first row is before the board's law begins
    assert len(going) >= len(recorded) - 3
    assert np.ptp(going) > 0.2
    lags = [float(np.abs(put_out[k : k + 100] - going[:100]).max()) for k in range(20)]
    assert min(lags) < 0.02  # a step of the duty, and half a period's rounding


def test_the_gains_that_were_sent_are_the_boards() -> None:
    tuned = Control().pd_tuned
    soft = Control()._replace(pd_tuned=PdTuned(0.2 * tuned.now, 0.2 * tuned.before))
    zone = Control().dead_zone
    efforts = [driven(BOARD_LOOP, gains, 20)[0].max() - zone for gains in (Control(), soft)]
    assert efforts[1] == pytest.approx(0.2 * efforts[0], abs=0.02)


def test_with_the_loop_on_the_host_its_own_orders_are_recorded() -> None:
    recorded, put_out = driven(HOST_LOOP, Control(), 40)
    assert np.all(recorded == ASKED.motor)
    assert put_out[-1] == pytest.approx(ASKED.motor, abs=0.02)
