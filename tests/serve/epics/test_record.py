"""What the records do with a machine in the test's hand."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("caproto")
sys.path.insert(0, str(Path(__file__).parents[1]))
from fake_station import FakeStation

from macromicro.control.live import messages as m
from macromicro.serve.epics.machine import Channels
from macromicro.serve.instrument import Instrument


async def until(true: Callable[[], Any]) -> None:
    async with asyncio.timeout(20.0):
        while not true():
            await asyncio.sleep(0.005)


def channels(fake: FakeStation) -> dict[str, Any]:
    return Channels(Instrument(fake)).named("P")  # type: ignore[arg-type]


def value(found: dict[str, Any], name: str) -> Any:
    held = found[f"P:{name}"].value
    return held[0] if isinstance(held, list) else held


async def put(found: dict[str, Any], name: str, given: Any) -> None:
    await found[f"P:{name}"].write(given)


def test_a_record_waits_for_another_one_s_move() -> None:
    async def main() -> None:
        fake = FakeStation()
        found = channels(fake)
        first = asyncio.create_task(put(found, "whole", 50.0))
        await until(lambda: fake.motion == 1)
        second = asyncio.create_task(put(found, "micro", 0.5))
        await asyncio.sleep(0.1)
        assert fake.given == 1 and value(found, "micro.DMOV") == 0
        fake.end("done")
        await first
        await until(lambda: fake.motion == 2)
        assert fake.requests[-1] == m.MoveMicro(0.5e-3, "epics", True)
        fake.end("done")
        await second
        assert (value(found, "micro.DMOV"), value(found, "micro.LVIO")) == (1, 0)

    asyncio.run(main())


@pytest.mark.parametrize("stop", ["whole.STOP", "micro.STOP", "stop", "emergency"])
def test_a_stop_leaves_nothing_that_waits_to_begin(stop: str) -> None:
    async def main() -> None:
        fake = FakeStation()
        found = channels(fake)
        first = asyncio.create_task(put(found, "whole", 50.0))
        await until(lambda: fake.motion == 1)
        second = asyncio.create_task(put(found, "micro", 0.5))
        await asyncio.sleep(0.1)
        await put(found, stop, 1)
        await asyncio.gather(first, second)
        assert fake.given == 1 and fake.motion == 0
        for name in ("whole", "micro"):
            assert [value(found, f"{name}.{f}") for f in ("DMOV", "LVIO", "STOP")] == [1, 1, 0]
            assert found[f"P:{name}"].alarm.severity == 2

    asyncio.run(main())


class Two(FakeStation):
    """Of two axes."""

    stages = m.AXES


def test_axes_that_are_set_together_move_at_once() -> None:
    """On one straight line, and both are done at its end; one that comes later waits."""

    async def main() -> None:
        fake = Two()
        found = channels(fake)
        moves = [asyncio.create_task(put(found, axis, v)) for axis, v in (("y", 30.0), ("x", 20.0))]
        await until(lambda: fake.motion == 1)
        assert fake.requests == [m.MovePoint(0.02, 0.03, "epics")]
        late = asyncio.create_task(put(found, "x", 25.0))
        await asyncio.sleep(0.15)
        assert fake.given == 1 and value(found, "x.DMOV") == value(found, "y.DMOV") == 0
        fake.end("done")
        await moves[0]
        await until(lambda: fake.motion == 2)
        assert fake.requests[-1] == m.MoveAxis("x", 0.025, "epics")
        assert (value(found, "y.DMOV"), value(found, "x.DMOV")) == (1, 0)
        fake.end("done")
        await asyncio.gather(moves[1], late)
        assert [value(found, f"{axis}.LVIO") for axis in m.AXES] == [0, 0]

    asyncio.run(main())


def test_both_have_failed_where_their_move_has() -> None:
    async def main() -> None:
        fake = Two()
        found = channels(fake)
        moves = [asyncio.create_task(put(found, axis, 20.0)) for axis in m.AXES]
        await until(lambda: fake.motion)
        fake.end("stalled")
        await asyncio.gather(*moves)
        for axis in m.AXES:
            assert [value(found, f"{axis}.{f}") for f in ("DMOV", "LVIO")] == [1, 1]
            assert found[f"P:{axis}"].alarm.severity == 2

    asyncio.run(main())


def test_a_stop_ends_what_is_being_gathered_and_nothing_that_follows() -> None:
    async def main() -> None:
        fake = Two()
        found = channels(fake)
        stopped = asyncio.create_task(put(found, "x", 20.0))
        await until(lambda: value(found, "x.DMOV") == 0)
        await put(found, "stop", 1)
        after = asyncio.create_task(put(found, "y", 30.0))
        await stopped
        assert value(found, "x.LVIO") == 1
        await until(lambda: fake.motion == 1)
        assert fake.requests[-1] == m.MoveAxis("y", 0.03, "epics")
        fake.end("done")
        await after
        assert value(found, "y.LVIO") == 0

    asyncio.run(main())


def test_the_next_move_clears_what_a_failed_one_left() -> None:
    async def main() -> None:
        fake = FakeStation()
        found = channels(fake)
        for outcome, left in (("stalled", 1), ("done", 0)):
            move = asyncio.create_task(put(found, "whole", 50.0))
            await until(lambda: fake.motion)
            assert value(found, "whole.LVIO") == value(found, "whole.DMOV") == 0
            assert found["P:whole"].alarm.severity == 0
            fake.end(outcome)
            await move
            assert value(found, "whole.LVIO") == value(found, "whole.MISS") == left
            assert found["P:whole"].alarm.severity == 2 * left
            assert value(found, "failure") == ("it ended as stalled" if left else "")

    asyncio.run(main())


def test_a_refused_move_begins_and_ends_as_a_failed_one() -> None:
    async def main() -> None:
        fake = FakeStation()
        fake.acquire("another")
        found = channels(fake)
        await put(found, "whole", 50.0)
        assert (value(found, "whole.DMOV"), value(found, "whole.LVIO")) == (1, 1)
        assert "another holds control" in value(found, "failure") and not fake.requests

    asyncio.run(main())
