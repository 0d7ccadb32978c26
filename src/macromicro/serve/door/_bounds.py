from __future__ import annotations

from typing import NamedTuple

LINE_LIMIT = 64 * 1024
BLOCK_LIMIT = 1024 * 1024
STOP_COST = 5.0  # of a stop that is done at once, in simple commands


class Bounds(NamedTuple):
    """Limits for the clients of one server."""

    clients: int = 16  # connections at a time
    silent: int = 64  # connections that have not sent a line yet
    crowd: int = 4  # read-only clients, beyond which they share a fixed rate
    messages: int = 64  # pending messages
    waiting: int = 4 * BLOCK_LIMIT  # their bytes
    line: int = LINE_LIMIT  # bytes
    block: int = BLOCK_LIMIT  # bytes
    rate: float = 500.0  # simple commands per second, sustained
    burst: float = 500.0  # simple commands at once
    unread: float = 10.0  # s for which answers stay unread, or a block incomplete
