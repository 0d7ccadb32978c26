"""What the serving process gives the loop process at its start."""

from __future__ import annotations

from typing import NamedTuple

from macromicro.serve.choosing import AnySettings
from macromicro.serve.persist import Kept

LIVE = "macromicro.serve.live:make"


class Spec(NamedTuple):
    """What the loop process is to run. `kept`: the position as it was left, or why there is
    none; `machine`: MODULE:FUNCTION that makes the machine from settings and calibration,
    `parent`: number of the serving process."""

    rig: str
    seed: int
    settings: AnySettings
    kept: Kept | str
    machine: str
    parent: int
