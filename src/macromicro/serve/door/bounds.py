"""What one client may use of this server."""

from __future__ import annotations

from typing import NamedTuple

LINE_LIMIT = 64 * 1024
BLOCK_LIMIT = 1024 * 1024
STOP_COST = 5.0  # of a stop that is done at once, in simple commands


class Bounds(NamedTuple):
    """What one client may use. `clients`: at a time, all together, beside `silent` ones that
    have sent no line yet; `crowd`: of those that may not command, from which on they share what
    so many may use; `messages`: waiting, of
    `waiting` bytes altogether; `line`, `block` [bytes]; `rate`: simple commands per second in
    the long run, `burst` of them at once; `unread` [s]: for which a client may leave its
    answers unread, or a block without its next byte."""

    clients: int = 16
    silent: int = 64
    crowd: int = 4
    messages: int = 64
    waiting: int = 4 * BLOCK_LIMIT
    line: int = LINE_LIMIT
    block: int = BLOCK_LIMIT
    rate: float = 500.0
    burst: float = 500.0
    unread: float = 10.0
