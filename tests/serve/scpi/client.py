"""A raw socket to the server, and waiting for what must come."""

from __future__ import annotations

import contextlib
import socket
import struct

WAIT = 10.0


class Client:
    """A raw socket."""

    def __init__(self, address: tuple[str, int]) -> None:
        self.socket = socket.create_connection(address, timeout=WAIT)
        self.file = self.socket.makefile("rb")

    def send(self, text: str | bytes) -> None:
        self.socket.sendall((text.encode() if isinstance(text, str) else text) + b"\n")

    def ask(self, text: str) -> str:
        self.send(text)
        return self.line()

    def line(self) -> str:
        return self.file.readline().decode().removesuffix("\n")

    def close(self) -> None:
        self.file.close()
        self.socket.close()

    def reset(self) -> None:
        """Go as a killed process with unread answers goes: without a farewell."""
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.close()

    def fill(self, data: bytes) -> int:
        """Send it again and again until nothing more is taken, or it is let go; bytes sent."""
        self.socket.settimeout(0.3)
        sent = 0
        with contextlib.suppress(TimeoutError, ConnectionError):
            while True:
                sent += self.socket.send(data)
        return sent
