"""The channels of a machine: when an order is answered."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace

import pytest

pytest.importorskip("caproto")

from macromicro.control.live.messages import DONE
from macromicro.serve.epics import _machine
from macromicro.serve.epics._channels import channel


@pytest.mark.parametrize("late", [0, 3, 10_000])
def test_an_order_is_answered_when_the_snapshot_shows_its_end(
    monkeypatch: pytest.MonkeyPatch, late: int
) -> None:
    """Motion 7 has ended; the snapshot shows it some looks later, or never."""
    asked = 0

    def snapshot() -> SimpleNamespace:
        nonlocal asked
        asked += 1
        return SimpleNamespace(motion=7 if asked <= late else 0, running=True)

    async def order(request: object) -> int:
        return 7

    seen: list[int] = []

    async def look() -> None:
        seen.append(snapshot().motion)

    monkeypatch.setattr(_machine, "POLL_S", 0.0)
    made = object.__new__(_machine.Channels)
    made._shown = {"failure": channel("")}
    made._order, made.look = order, look
    made._station = SimpleNamespace(
        snapshot=snapshot, finished=lambda motion, timeout: SimpleNamespace(outcome=DONE)
    )
    asyncio.run(made._go(None))
    assert seen == [0 if late < 10_000 else 7]
    assert asked == min(late + 1, _machine._SHOWN_BY) + 1
