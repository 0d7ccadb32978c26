"""The WebSocket to a server."""

from __future__ import annotations

import asyncio
import contextlib
import json
import time
from typing import Any

from macromicro.remote.failures import ConnectionLost, RequestRefused, StopNotConfirmed
from macromicro.serve import unconfirmed
from macromicro.serve.hosts import STARTING
from macromicro.serve.web.bins import PIECE, PIECE_KIND

BEAT_S, KEEP_S = 0.5, 0.1
FRAME_S = 0.01
RATE, BURST = 80.0, 100.0  # messages a second and at once: fewer than a server takes
CONFIRM_S = 1.0  # within which a stop is confirmed
CLOSE_S = 1.0  # for the farewell
START_S, AGAIN_S = 120.0, 0.2  # longest wait for a machine that starts; pause between two tries
_STOPS = {"stop": unconfirmed.STOP, "emergency": unconfirmed.EMERGENCY_STOP}
_GONE = "the connection to the server is closed"
_LOOK = "start the server, or look at its terminal, and connect again"


class Link:
    """One connection to a server, in one event loop."""

    def __init__(self, url: str, origin: str, token: str | None, patience: float) -> None:
        self._url, self._origin, self._token, self._patience = url, origin, token, patience
        self.about: dict[str, Any] = {}
        self.gains: list[dict[str, Any]] = []
        self.frames: asyncio.Queue[bytes] = asyncio.Queue(64)
        self._pieces: dict[int, bytes] = {}
        self._open: Any = None
        self._number = 0
        self._waiting: dict[int, asyncio.Future[dict[str, Any]]] = {}
        self._tasks: list[asyncio.Task[None]] = []
        self._listed, self._ended = asyncio.Event(), asyncio.Event()
        self.jogs = False
        self._heard = 0.0  # when a message came last
        self.why = _GONE

    async def open(self) -> None:
        """Connect and say hello; wait for a machine that is starting."""
        from websockets.exceptions import InvalidStatus, WebSocketException

        from macromicro.serve.bucket import Bucket

        self._bucket = Bucket(RATE, BURST)
        first, last = None, time.monotonic() + START_S
        while first is None:
            limit = asyncio.timeout(self._patience)
            try:
                async with limit:
                    first = await self._hello(last)
            except InvalidStatus as error:
                body = error.response.body.decode("utf-8", "replace").strip()
                advice = "the address or a name of a server"
                raise RequestRefused(f"{self._url}: {body}", advice) from None
            except (OSError, TimeoutError, ValueError, WebSocketException) as error:
                await self.close()
                why = unconfirmed.SERVER if limit.expired() else str(error) or type(error).__name__
                raise ConnectionLost(f"{self._url}: {why}", _LOOK) from None
            if first is None:
                await asyncio.sleep(AGAIN_S)
        self.about, self._heard = first["welcome"], time.monotonic()
        work = self._read, self._beat, self._keep, self._watch
        self._tasks = [asyncio.create_task(each()) for each in work]
        if self.about["problem"]:
            await self.close()
            raise RequestRefused(self.about["problem"], "token=..., or MACROMICRO_TOKEN")
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self._listed.wait(), self._patience)

    async def _hello(self, last: float) -> dict[str, Any] | None:
        """The server's welcome; None while its machine starts, until the time `last`."""
        from websockets.asyncio.client import connect
        from websockets.exceptions import ConnectionClosed

        hello: dict[str, Any] = {"do": "hello", "program": True, "frames": False}
        if self._token is not None:
            hello["token"] = self._token
        self._open = await connect(
            self._url,
            origin=self._origin,  # type: ignore[arg-type]
            proxy=None,
            max_size=None,
            ping_interval=None,
            open_timeout=self._patience,
            close_timeout=CLOSE_S,
        )
        try:
            await self._open.send(json.dumps(hello))
            first: dict[str, Any] = json.loads(await self._open.recv())
        except ConnectionClosed as closed:
            starts = closed.rcvd is not None and closed.rcvd.code == STARTING[0]
            if not starts or time.monotonic() > last:
                raise
            return None
        return first

    async def order(self, do: str, **fields: Any) -> dict[str, Any]:
        """Send an order and wait for its reply."""
        if do not in _STOPS:
            return await self._asked(do, fields, None if do == "wait" else self._patience)
        try:
            return await self._asked(do, fields, CONFIRM_S)
        except ConnectionLost as error:
            raise StopNotConfirmed(_STOPS[do], error.reason) from None
        except RequestRefused as error:
            if error.remedy != unconfirmed.REMEDY:
                raise
            raise StopNotConfirmed(_STOPS[do], error.reason) from None

    async def _asked(
        self, do: str, fields: dict[str, Any], patience: float | None
    ) -> dict[str, Any]:
        wait = self._bucket.spend()
        if do not in _STOPS:
            await asyncio.sleep(wait)
        self._number += 1
        number = self._number
        reply: asyncio.Future[dict[str, Any]] = asyncio.get_running_loop().create_future()
        self._waiting[number] = reply
        try:
            async with asyncio.timeout(patience):
                await self._send({"do": do, "id": number, **fields})
                found = await reply
        except TimeoutError:
            raise ConnectionLost(unconfirmed.SERVER, _LOOK) from None
        finally:
            self._waiting.pop(number, None)
        if not found["ok"]:
            beyond = bool(found.get("beyond"))
            raise RequestRefused(found["reason"], found["remedy"], beyond=beyond)
        return found

    async def tell(self, message: dict[str, Any]) -> None:
        """Send a message that has no reply."""
        await self._send(message)

    async def next_frame(self) -> bytes:
        """Wait for the oldest frame that was not taken."""
        while self.frames.empty():
            if self._ended.is_set():
                raise ConnectionLost(self.why, _LOOK)
            await asyncio.sleep(FRAME_S)
        return self.frames.get_nowait()

    async def pieced(self, do: str, **fields: Any) -> tuple[dict[str, Any], bytes, int]:
        """Send an order whose reply may bring data: the reply, they, and the size of the whole."""
        found = await self.order(do, **fields)
        piece = self._pieces.pop(found["reply"], b"")
        if not piece:
            return found, b"", 0
        return found, piece[PIECE.size :], int(PIECE.unpack_from(piece)[4])

    async def close(self) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._open is not None:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._open.close(), 2.0 * CLOSE_S)
            self._open.transport.abort()
        self._lose(_GONE)

    async def _send(self, message: dict[str, Any]) -> None:
        from websockets.exceptions import ConnectionClosed

        if self._ended.is_set():
            raise ConnectionLost(self.why, _LOOK)
        try:
            await self._open.send(json.dumps(message, allow_nan=False))
        except (ConnectionClosed, OSError):
            raise ConnectionLost(self.why, _LOOK) from None

    async def _read(self) -> None:
        from websockets.exceptions import ConnectionClosed

        try:
            async for message in self._open:
                self._take(message)
        except (ConnectionClosed, OSError):
            pass
        finally:
            said = self._open.close_reason
            self._lose(f"{_GONE}: {said}" if said else _GONE)

    def _take(self, message: str | bytes) -> None:
        self._heard = time.monotonic()
        if isinstance(message, bytes):
            kind, number = PIECE.unpack_from(message)[:2]
            if kind == PIECE_KIND:
                self._pieces[number] = message
                return
            if self.frames.full():
                self.frames.get_nowait()
            self.frames.put_nowait(message)
            return
        found: dict[str, Any] = json.loads(message)
        if "gains" in found:
            self.gains = found["gains"]
            self._listed.set()
        waiting = self._waiting.get(found.get("reply") or 0)
        if waiting is not None and not waiting.done():
            waiting.set_result(found)

    def _lose(self, why: str) -> None:
        if not self._ended.is_set():
            self.why = why
        self._ended.set()
        for waiting in self._waiting.values():
            if not waiting.done():
                waiting.set_exception(ConnectionLost(why, _LOOK))

    async def _beat(self) -> None:
        with contextlib.suppress(ConnectionLost):
            while True:
                await asyncio.sleep(BEAT_S)
                await self._send({"do": "beat", "id": 0})  # answered: a sign of life

    async def _watch(self) -> None:
        """Lose a server that is silent for too long."""
        patience = max(self._patience, 4.0 * BEAT_S)
        while time.monotonic() - self._heard < patience:
            await asyncio.sleep(0.2 * BEAT_S)
        self._lose(unconfirmed.SERVER)

    async def _keep(self) -> None:
        """Keep a jog alive."""
        with contextlib.suppress(ConnectionLost):
            while True:
                await asyncio.sleep(KEEP_S)
                if self.jogs:
                    await self._send({"do": "keep"})
