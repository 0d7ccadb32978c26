"""The Channel Access server."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import re
from typing import TYPE_CHECKING, Any

from macromicro.errors import InputError
from macromicro.extras import require
from macromicro.serve._instrument import Instrument
from macromicro.serve.hosts import HOST, Token, require_token
from macromicro.serve.listening import Listener

if TYPE_CHECKING:
    from macromicro.serve.station import Station

LOOK_S, TRACE_S = 0.1, 0.5
INTERFACES = "EPICS_CAS_INTF_ADDR_LIST"
_PREFIX = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_:-]{0,29}")
# At the default address beacons stay on this computer.
_QUIET = {"EPICS_CAS_AUTO_BEACON_ADDR_LIST": "NO", "EPICS_CAS_BEACON_ADDR_LIST": HOST}


def check_prefix(prefix: str) -> str:
    """Check a prefix of channel names, and that they can be served."""
    if not _PREFIX.fullmatch(prefix):
        raise InputError("--epics", prefix, "a prefix such as LAB:STAGE, at most 30 characters")
    require("--epics", "caproto", "epics")
    return prefix.rstrip(":")


class EpicsServer(Listener):
    """Serves the machine as channels named `prefix`...; a context manager.

    Address and port: EPICS_CAS_INTF_ADDR_LIST (default 127.0.0.1) and EPICS_CA_SERVER_PORT.
    Channel Access carries no token: where one is required, all channels but stops are read-only.
    """

    def __init__(self, station: Station, prefix: str, token: Token | None = None) -> None:
        self.prefix = check_prefix(prefix)
        self._interfaces = os.environ.get(INTERFACES, "").split() or [HOST]
        token = token or Token(None)
        for address in self._interfaces:
            require_token(address, None if token.open else "x" * 32)
        super().__init__("EPICS", self._interfaces[0], 0)
        self._instrument = Instrument(station, token=token)

    def start(self) -> None:
        if self._interfaces == [HOST]:
            for name, value in _QUIET.items():
                os.environ.setdefault(name, value)
        logging.getLogger("caproto").addHandler(logging.NullHandler())
        for name in ("caproto", "caproto.ctx", "caproto.circ", "caproto.bcast", "caproto.ch"):
            logging.getLogger(name).setLevel(logging.CRITICAL)  # a refused put is no news
        from macromicro.serve.epics._machine import Channels

        self._channels = Channels(self._instrument)
        super().start()

    async def _serve(self) -> None:
        from macromicro.serve.epics._channels import Circuits

        channels = self._channels
        context: Any = Circuits(channels.named(self.prefix), self._interfaces, channels.left)
        channels.client.connect()

        async def look(_: object) -> None:
            await channels.look()
            self._listening(self._interfaces[0], context.port)
            due = 0.0
            while True:
                await channels.look()
                if asyncio.get_running_loop().time() >= due:
                    await channels.look_back()
                    due = asyncio.get_running_loop().time() + TRACE_S
                await asyncio.sleep(LOOK_S)

        try:
            with contextlib.suppress(asyncio.CancelledError):
                await context.run(startup_hook=look)
        finally:
            channels.client.close()
