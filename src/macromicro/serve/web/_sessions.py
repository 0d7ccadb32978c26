"""Sessions of pages across reloads."""

from __future__ import annotations

import itertools
import math
import secrets
import time
from typing import TYPE_CHECKING

from macromicro.control.live.messages import Accepted, Reply
from macromicro.serve import unconfirmed
from macromicro.serve._instrument import Instrument
from macromicro.serve.client import Capacity, Client
from macromicro.serve.web._downloads import Upload

if TYPE_CHECKING:
    from macromicro.serve.web._connection import PageConnection

GRACE_S = 10.0  # longest time for which a page that is gone may come back
_numbers = itertools.count(1)  # one name for each page of all servers: the station tells them apart


class Session(Client):
    """One page, which may come back after a reload."""

    def __init__(self, instrument: Instrument, name: str, address: str, capacity: Capacity) -> None:
        super().__init__(instrument, name, address, capacity)
        self.key = secrets.token_urlsafe(24)
        self.connection: PageConnection | None = None
        self.left = 0.0
        self.listed = False
        self.returns = True
        self.jog = ""  # the stage of a jog of this page
        self.upload = Upload()


class Sessions:
    def __init__(self, instrument: Instrument, capacity: Capacity) -> None:
        self._instrument, self._capacity = instrument, capacity
        self._sessions: dict[str, Session] = {}
        self._grace = min(instrument.settings.serve.client_timeout, GRACE_S)

    def find(self, key: object, address: str) -> Session:
        """The session with this key, else a new one."""
        session = self._sessions.get(key) if isinstance(key, str) else None
        if session is None:
            name = f"web {address} #{next(_numbers)}"
            return Session(self._instrument, name, address, self._capacity)
        session.address = address
        return session

    def attach(self, session: Session, connection: PageConnection) -> None:
        """Attach a connection and have the station list the page."""
        if session.connection is not None:
            session.connection.leave()
        self._sessions[session.key] = session
        session.connection = connection
        if not session.listed:
            session.listed = True
            session.connect()

    def detach(self, session: Session, connection: PageConnection) -> bool:
        """Detach an ended connection; True if no other one has the session."""
        if session.connection is not connection:
            return False
        session.connection, session.left = None, time.monotonic()
        return True

    def clear(self, session: Session) -> None:
        """Remove a session that is gone and holds nothing; programs at once."""
        stays = session.returns and session.station.holder == session.name
        if session.connection is None and not stays:
            self._unlist(session)

    def tidy(self) -> None:
        """Disconnect pages that did not come back."""
        now = time.monotonic()
        for session in list(self._sessions.values()):
            if session.connection is None and now - session.left > self._grace:
                del self._sessions[session.key]
                self._unlist(session)

    def _unlist(self, session: Session) -> None:
        if session.listed:
            session.listed = False
            session.station.disconnect(session.name)

    async def stop(self, session: Session) -> Reply:
        """Stop now and refuse all waiting orders."""
        self._drop_waiting()
        return await session.stop()

    async def emergency(self, session: Session) -> tuple[Reply, float]:
        """Emergency stop; the reply and its duration."""
        self._drop_waiting()
        took = await session.emergency()
        if math.isnan(took):
            return unconfirmed.SILENT, took
        return Accepted(), took

    def _drop_waiting(self) -> None:
        for session in self._sessions.values():
            if session.connection is not None:
                session.connection.drop_waiting()

    def close(self) -> None:
        for session in self._sessions.values():
            self._unlist(session)
        self._sessions.clear()
