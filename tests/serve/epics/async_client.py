"""What the test of ophyd-async does, in a process whose libraries are its own."""

from __future__ import annotations

import asyncio
import sys
import time

from aioca import caget, caput
from ophyd_async.core import init_devices

from macromicro.ophyd_async import Motor, MoveFailed

PREFIX = sys.argv[1]


async def main() -> None:
    async with init_devices():
        stage = Motor(f"{PREFIX}:whole", name="stage")
    try:
        await stage.set(10.0)
    except MoveFailed as error:
        print("refused:", error)
    await caput(f"{PREFIX}:enable", 1, wait=True)
    await caput(f"{PREFIX}:home", 1, wait=True, timeout=60.0)
    await stage.set(12.5)
    print("done:", abs(await stage.user_readback.get_value() - 12.5) < 0.02)
    status = stage.set(100.0)
    await asyncio.sleep(0.3)
    await stage.stop()
    try:
        await status
    except Exception as error:
        print("stopped:", error)
    deadline = time.monotonic() + 20.0
    while not await caget(f"{PREFIX}:whole.DMOV") and time.monotonic() < deadline:
        await asyncio.sleep(0.02)
    await stage.set(14.0)
    print("again:", abs(await stage.user_readback.get_value() - 14.0) < 0.02)
    try:
        await stage.set(5000.0)
    except Exception as error:
        print("limits:", type(error).__name__)


asyncio.run(main())
