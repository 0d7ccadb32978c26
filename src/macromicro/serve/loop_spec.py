from __future__ import annotations

from typing import NamedTuple

from macromicro.serve.choosing import AnySettings
from macromicro.serve.persist import Kept

LIVE = "macromicro.serve.live:make"


class Spec(NamedTuple):
    """What the loop process runs."""

    rig: str
    seed: int
    settings: AnySettings
    kept: Kept | str  # the saved position, or why there is none
    machine: str  # MODULE:FUNCTION
    parent: int  # process id of the server
