"""Section 4.2.3 on the simulated board: its dead zone is that of the bench without one."""

from __future__ import annotations

import pytest

from macromicro.identify.deadzone import dead_zone
from macromicro.lab.machine import Machine
from macromicro.rig.board.rig import BoardRig
from macromicro.rig.session import BENCH, Fixture
from macromicro.thesis.chapter4 import friction
from macromicro.thesis.procedure import Lab
from tests.firmware.built import Bench, Wire, elf, needs_avr

pytestmark = [needs_avr, pytest.mark.slow]
VOLTAGES, STARTS = (2.8, 2.9, 3.0, 3.1, 3.2), (400.0, 1400.0)


def _found(machine: Machine) -> tuple[float, float]:
    runs = friction.probing_runs(machine, VOLTAGES, STARTS)
    zone = dead_zone(runs, travel=friction.TRAVEL)
    return zone.positive, zone.negative


@pytest.mark.timeout(1800)
def test_the_dead_zone_is_found_on_the_board() -> None:
    wire = Wire(Bench(elf()))

    def made(seed: int) -> BoardRig:
        return BoardRig("simulated", open_port=lambda _: wire)

    fixture = Fixture("board:simulated", BENCH, made, ("encoder",), 1e-3)
    found = _found(fixture)
    assert found == _found(Lab().bench())
    assert min(found) >= 2.8 and max(found) <= 3.2
