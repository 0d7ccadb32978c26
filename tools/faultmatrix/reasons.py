"""Faults that leave no evidence: why, in which modes, and what must show them."""

from __future__ import annotations

from typing import NamedTuple


class Reason(NamedTuple):
    """`modes` in which nothing shows it; `check`: "moved": the next move must, "homed": the next
    homing must put it right, "": nothing can; `drifts`: may the position be wrong until then?"""

    words: str
    modes: tuple[str, ...]
    check: str = "moved"
    drifts: bool = False


REST = ("disabled", "holding")
ALL = (*REST, "homing", "jogging", "moving", "programme")
_STILL = "nothing moves"
_SCALE = "the next homing reports the lost counts"
REASONS: dict[str, Reason] = {
    "encoder-frozen": Reason(_STILL, REST),
    "encoder-reversed": Reason("it drifts", REST, drifts=True),
    "encoder-skipping": Reason(_SCALE, ALL, "homed"),
    "encoder-dither": Reason("below the sensor's resolution", ALL),
    "motor-dead": Reason(_STILL, REST),
    "motor-reversed": Reason(_STILL, REST),
    "carriage-stuck": Reason(_STILL, REST),
    "limit-on": Reason("nothing moves towards it", (*REST, "homing")),
    "limit-cut": Reason("nothing moves towards it", (*REST, "homing")),
    "hall-stuck": Reason("the micro-stage is off", ("disabled", "holding", "homing", "jogging")),
    "wire-broken": Reason("no current", ("disabled", "holding", "homing", "jogging")),
}
ABSOLUTE = Reason("one sensor cannot show its own gain", ALL, "")
