"""The client for asyncio: what is cancelled, and two things at a time."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from web_parts import Station

from macromicro.remote.asynchronous import AsyncMachine
from macromicro.remote.failures import MotionFailed, RequestRefused
from macromicro.serve.web import WebServer


async def until(true: Any) -> None:
    async with asyncio.timeout(20.0):
        while not true():
            await asyncio.sleep(0.01)


def machine(server: WebServer, **rest: Any) -> AsyncMachine:
    return AsyncMachine(*server.address, token="sesame", **rest)


def test_a_move_that_is_cancelled_stops(server: WebServer, fake: Station) -> None:
    async def main() -> None:
        async with machine(server) as stage:
            with pytest.raises(TimeoutError):
                await asyncio.wait_for(stage.move_to("50 mm"), 0.2)
            assert fake.ended[1].outcome == "stopped"
            assert (await stage.state()).motion == 0

    asyncio.run(main())


def test_two_wait_for_one_motion_while_others_ask(server: WebServer, fake: Station) -> None:
    async def main() -> None:
        async with machine(server) as stage, machine(server, control=False) as watcher:
            motion = await stage.move_to(0.05, wait=False)
            waits = [asyncio.create_task(motion.wait()) for _ in range(2)]
            assert (await watcher.state()).motion == motion.number
            await watcher.stop()  # anybody may
            for wait in waits:
                with pytest.raises(MotionFailed, match="as stopped"):
                    await wait

    asyncio.run(main())


def test_an_error_within_the_context_stops_the_machine(server: WebServer, fake: Station) -> None:
    async def main() -> None:
        async with machine(server) as stage:
            await stage.move_to(0.05, wait=False)
            raise ValueError("of the user's")

    with pytest.raises(ValueError, match="user's"):
        asyncio.run(main())
    assert fake.ended[1].outcome == "stopped" and fake.holder == ""


def test_more_messages_than_the_server_takes_wait_here(server: WebServer, fake: Station) -> None:
    async def main() -> None:
        async with machine(server) as stage:
            found = await asyncio.gather(*(stage.state() for _ in range(30)))
            assert len(found) == 30
            for _ in range(260):
                await stage.zero()
            assert len(fake.requests) == 260

    asyncio.run(main())


def test_control_goes_back_and_forth(server: WebServer, fake: Station) -> None:
    async def main() -> None:
        async with machine(server) as one, machine(server, control=False) as two:
            with pytest.raises(RequestRefused, match="holds control"):
                await two.take()
            await one.release()
            await two.take()
            await two.zero()
            with pytest.raises(RequestRefused):
                await one.zero()

    asyncio.run(main())
    assert fake.holder == ""
