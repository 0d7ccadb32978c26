"""What a viewer may use of this server."""

from __future__ import annotations

from typing import NamedTuple


class Bounds(NamedTuple):
    """Bounds of one server; times in s.

    `viewers`: connections at a time, beside `silent` ones that have not said hello; `largest`:
    bytes of a message; `rate`, `burst`: messages a second, and at once; `waiting`: orders of one
    viewer that wait; `patience`: for a viewer that takes no more data, or does not say hello;
    `frames`: of telemetry a second; `views`: changes of what is shown, a second; `jog`: how long
    a jog goes on without a sign that its button is held; `tries`: wrong tokens of one address
    within `forget`, each of which costs `pause`.
    """

    viewers: int = 16
    silent: int = 64
    largest: int = 16_384
    rate: float = 100.0
    burst: float = 200.0
    waiting: int = 32
    patience: float = 5.0
    frames: float = 30.0
    views: float = 2.0
    jog: float = 0.4
    tries: int = 5
    pause: float = 0.5
    forget: float = 60.0
