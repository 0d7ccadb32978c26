"""What waits of a client, and what a stop leaves of it; clients of protocols are in `door`."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from fake_station import FakeStation

from macromicro.control.live import messages as m
from macromicro.serve._instrument import Instrument
from macromicro.serve.client import Client, Entry, Waiting
from macromicro.serve.requests import OVERTAKEN


@pytest.fixture
def station() -> Any:
    return FakeStation()


def test_what_is_dropped_makes_room_and_the_end_stays(station: Any) -> None:
    async def main() -> list[int]:
        client, done = Client(Instrument(station), "a"), []
        waiting: Waiting[int] = Waiting(client, 3, largest=100)

        async def do(entry: Entry[int]) -> bool:
            done.append(entry.order)
            return True

        await waiting.put(1, 60)
        late = asyncio.create_task(waiting.put(2, 60))
        await asyncio.sleep(0.05)
        assert waiting.drop() == [1] and not late.done()
        await late
        await waiting.end()
        assert waiting.busy and waiting.drop() == [2]
        assert waiting.offer(3)  # behind the end, which nothing passes
        await asyncio.wait_for(waiting.work(do), 5.0)
        return done

    assert asyncio.run(main()) == []


def test_an_order_from_before_a_stop_does_not_reach_the_station(station: Any) -> None:
    client = Client(Instrument(station), "a")
    station.acquire("a")
    entry = Entry("fan", client.stops, station.stops, 0)
    assert asyncio.run(client.request(m.Fan(True), entry)) == m.Accepted()
    asyncio.run(client.stop())
    assert asyncio.run(client.request(m.Fan(True), entry)) == OVERTAKEN
    assert [type(r) for r in station.requests] == [m.Fan, m.Stop]
