"""The encoder at twice the carriage's speed and more: counts, and the time that edges leave."""

from __future__ import annotations

import pytest

from macromicro.rig.board.rig import BOARD_LOOP, HOST_LOOP
from macromicro.types import SAFE, Command, Outputs
from tests.firmware.built import board, needs_avr

pytestmark = needs_avr


@pytest.mark.parametrize(
    ("loop", "each"),
    [
        pytest.param(HOST_LOOP, 40, marks=pytest.mark.slow),
        (HOST_LOOP, -40),
        (BOARD_LOOP, 12),
        pytest.param(BOARD_LOOP, -12, marks=pytest.mark.slow),
    ],
)
def test_no_edge_is_lost_and_control_ends_in_time(loop: str, each: int) -> None:
    """`each` counts a period, spread over three quarters of it; the carriage makes 6.5 at most."""
    with board(loop) as (rig, wire):
        place = step = 0

        def counts() -> int:
            nonlocal place
            place += step
            return place

        wire.bench._counts = counts  # type: ignore[method-assign]
        for k in range(300):
            rig.read()
            step = each if k > 20 else 0
            rig.aim(Command(place + 25.0 * each, 1.0, 1e-3 * (1 + k // 150), 1.0, 0.0))
            rig.write(Outputs(4.0 if each > 0 else -4.0, 1.2, 0.0, 0.0))
            rig.wait(1e-3)
        step = 0
        for _ in range(5):
            rig.read()
            rig.write(SAFE)
            rig.wait(1e-3)
        told = rig.status()
        assert (told["fault"], told["skipped"], told["missed"]) == (0, 0, 0)
        assert rig.read().encoder == place == each * 279
