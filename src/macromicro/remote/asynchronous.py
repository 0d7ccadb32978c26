from __future__ import annotations

import asyncio
import contextlib
import os
from collections.abc import AsyncIterator, Coroutine
from pathlib import Path
from typing import Any, Self

from macromicro.remote import _orders
from macromicro.remote._client import Client
from macromicro.remote._link import CONFIRM_S, Link
from macromicro.remote._state import State, Traces, Window, read_state
from macromicro.remote.capturing import AsyncCapture
from macromicro.remote.failures import MotionFailed, RequestError, RequestRefused
from macromicro.remote.following import AsyncStream
from macromicro.schema.text import read_text
from macromicro.serve.hosts import HOST, WEB_PORT, url
from macromicro.serve.requests import RequestType, of_axes
from macromicro.serve.web.bins import HEADER

TOKEN = "MACROMICRO_TOKEN"
PIECE = 10_000  # characters of a programme in a message
REST_S = 5.0  # longest wait for rest at the end
_COLUMNS = 1000


class AsyncMotion:
    """A motion that has begun. `number`: the server's; `words`: what was asked for."""

    def __init__(self, machine: AsyncMachine, number: int, words: str) -> None:
        self._machine = machine
        self.number, self.words = number, words
        self.ended: dict[str, Any] | None = None

    async def wait(self) -> dict[str, Any]:
        """Wait for its end; to cancel the wait leaves the motion as it is.

        Returns
        -------
        dict[str, Any]
            How it ended: `outcome`, `position`, `uncertainty`, `evidence`.

        Raises
        ------
        MotionFailed
            It failed.
        ConnectionLost
            The server no longer answers.
        """
        if self.ended is None:
            found = await self._machine.link.order("wait", motion=self.number)
            self.ended = found["finished"]
            self._machine.forget(self)
        if self.ended["outcome"] != "done":
            raise await self._failure(self.ended)
        return self.ended

    async def _failure(self, end: dict[str, Any]) -> MotionFailed:
        remedy, place, at = "", self._machine.place, end["position"]
        if end["outcome"] == "fault":
            with contextlib.suppress(RequestError):
                fault = (await self._machine.state()).fault
                remedy = "" if fault is None else f"{fault.message}; {fault.remedy}"
        where = "" if at is None else place.told(at)
        return MotionFailed(self.words, end["outcome"], where, end["evidence"], remedy)


class AsyncMachine(
    Client[
        Coroutine[Any, Any, AsyncMotion],
        Coroutine[Any, Any, dict[str, Any]],
        Coroutine[Any, Any, AsyncCapture],
    ]
):
    """A served machine, for asyncio; `async with` connects, and at the end stops what it moves.

    Parameters
    ----------
    host : str, optional
        Where `macromicro serve` runs.
    port : int, optional
        Of its page.
    token : str | None, optional
        The server's token; by default MACROMICRO_TOKEN, if set.
    control : bool, optional
        Whether to take control; else this client watches, and may stop.
    timeout : float, optional
        Longest wait, s, for the connection, for an answer and, during a motion, for
        a sign of life of the server. A machine that is starting is waited for up to
        two minutes longer.

    Examples
    --------
    >>> from macromicro import AsyncMachine
    >>> machine = AsyncMachine("127.0.0.1", control=False)  # connects in `async with machine:`
    >>> machine.place.unit
    'mm'
    """

    def __init__(
        self,
        host: str = HOST,
        port: int = WEB_PORT,
        *,
        token: str | None = None,
        control: bool = True,
        timeout: float = 10.0,
    ) -> None:
        origin = url(host, port).rstrip("/")
        token = token or os.environ.get(TOKEN, "").strip() or None
        self.link = Link(f"ws{origin.removeprefix('http')}/live", origin, token, timeout)
        self._control, self._held = control, False
        self._recording, self._views = "", 0
        self._under_way: set[AsyncMotion] = set()

    async def open(self) -> None:
        """Connect, and take control if requested.

        Raises
        ------
        ConnectionLost
            Nobody answers there.
        RequestRefused
            The token is wrong, or another client holds control.
        """
        await self.link.open()
        try:
            if self._control:
                await self.take()
        except BaseException:
            await self.link.close()
            raise

    async def close(self) -> None:
        """Stop what this client moves, wait for rest, give control back, disconnect.

        Raises
        ------
        StopNotConfirmed
            The server does not confirm the stop; the connection is closed all the same.
        """
        try:
            if self._under_way or self.link.jogs:
                with contextlib.suppress(RequestRefused):
                    await self.stop()
                with contextlib.suppress(RequestError, TimeoutError):
                    await asyncio.wait_for(self._rest(), REST_S)
            if self._held:
                with contextlib.suppress(RequestError, TimeoutError):
                    await asyncio.wait_for(self.release(), CONFIRM_S)
        finally:
            await self.link.close()

    async def __aenter__(self) -> Self:
        await self.open()
        return self

    async def __aexit__(self, *_: object) -> None:
        await asyncio.shield(self.close())

    async def state(self) -> State:
        """The machine now.

        Returns
        -------
        State
            Requested from the server.

        Raises
        ------
        ConnectionLost
            The server no longer answers.
        """
        return read_state((await self.link.order("state"))["state"])

    async def ready(self) -> None:
        state = await self.state()
        if state.mode == "disabled":
            await self.enable()
        if not state.trusted:
            await self.home()

    async def traces(self, span: float = 10.0) -> AsyncIterator[Traces]:
        self._views += 1
        number = self._views
        await self.link.order("view", span=span, columns=_COLUMNS, view=number)
        window = Window(self.about["channels"], span)
        try:
            while True:
                frame = await self.link.next_frame()
                if HEADER.unpack_from(frame)[1] == number:  # none of a view before
                    yield window.take(frame)
        finally:
            with contextlib.suppress(RequestError):
                await self.link.order("view", frames=False)

    async def save_recording(self, path: str | os.PathLike[str]) -> int:
        if not self._recording:
            raise RequestRefused("this client has begun no recording", "record() first")
        rows = int((await self.link.order("end recording"))["rows"])
        with Path(path).open("wb") as file:
            size = 1
            while file.tell() < size:
                _, data, size = await self.link.pieced(
                    "download", name=self._recording, offset=file.tell()
                )
                file.write(data)
        self._recording = ""
        return rows

    def follow(self, stage: str = "", *, hold: float = 0.1) -> AsyncStream:
        return AsyncStream(self, stage, hold)

    async def _capture(self, fields: dict[str, Any]) -> AsyncCapture:
        await self.link.order("capture", **fields)
        return AsyncCapture(self)

    # How the orders of the base are sent

    def forget(self, motion: AsyncMotion) -> None:
        """A motion has ended.

        Parameters
        ----------
        motion : AsyncMotion
            One that `wait` saw end.
        """
        self._under_way.discard(motion)

    def _kind(self, name: str) -> RequestType:
        return of_axes(_orders.axes_of(self.about))[name]

    async def _rest(self) -> None:
        while (await self.state()).motion:
            await asyncio.sleep(0.02)

    async def _order(self, name: str, *args: Any, **fields: Any) -> dict[str, Any]:
        if args:
            kind = self._kind(name)
            given = _orders.check(kind, args, self.place)
            fields = _orders.order(kind, given, self.place)
        found = await self.link.order(name, **fields)
        self._recording = found["name"] if name == "record" else self._recording
        if name in ("take", "release"):
            self._held = name == "take"
        if name in ("stop", "emergency", "disable"):
            self.link.jogs = False
        return found

    async def _motion(
        self, name: str, *args: Any, wait: bool, replace: bool = False
    ) -> AsyncMotion:
        if name == "programme":
            words, fields = await self._programme(*args)
        else:
            kind = self._kind(name)
            given = _orders.check(kind, args, self.place)
            fields = _orders.order(kind, given, self.place)
            if kind.replaces:
                fields["replace"] = replace
            words = kind.words(given, self.place) if kind.motion else name
        motion = AsyncMotion(self, 0, words)
        self._under_way.add(motion)  # before the answer, which may never come
        try:
            motion.number = (await self.link.order(name, **fields))["motion"]
            # Without a hold time, by which its caller renews it, this client keeps a jog going.
            self.link.jogs = name == "jog" and fields["speed"] != 0.0 and "hold" not in fields
            if wait:
                await motion.wait()
        except asyncio.CancelledError:
            with contextlib.suppress(RequestError):
                await self.stop()
            raise
        except RequestError:
            self.forget(motion)
            raise
        if name == "jog":
            self.forget(motion)  # `link.jogs` says whether there is one
        return motion

    async def _programme(self, name: str | os.PathLike[str]) -> tuple[str, dict[str, Any]]:
        """The words of a programme, which is sent first where it is a file, and its order."""
        known = self.about["programmes"]
        if isinstance(name, str) and name in known:
            return f"programme {name}", {"name": name}
        path = Path(name)
        text = read_text(path, f"a file (.toml or .csv), or one of {', '.join(known)}")
        for start in range(0, max(len(text), 1), PIECE):
            piece = {"name": path.name, "offset": start, "text": text[start : start + PIECE]}
            await self.link.order("upload", **piece, last=start + PIECE >= len(text))
        return f"programme {path.name}", {"uploaded": True}
