from __future__ import annotations

from typing import NamedTuple


class Bounds(NamedTuple):
    """Limits of the page's server; times in s."""

    viewers: int = 16  # connections at a time
    silent: int = 64  # connections that have not said hello
    largest: int = 16_384  # bytes of a message
    rate: float = 100.0  # messages per second
    burst: float = 200.0  # messages at once
    waiting: int = 32  # pending orders of one viewer
    patience: float = 5.0  # for unread data, or a missing hello
    frames: float = 30.0  # of telemetry per second
    views: float = 2.0  # changes of the view per second
    jog: float = 0.4  # a jog continues so long without a sign of its button
    tries: int = 5  # wrong tokens of one address within `forget`
    pause: float = 0.5  # after a wrong token
    forget: float = 60.0
