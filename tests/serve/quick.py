"""The two-stage machine for tests that wait for it: it homes and settles in less time."""

from __future__ import annotations

from typing import Any

from macromicro.serve.settings import LiveSettings

HOMING, WAIT = 600.0, 0.5  # count/s and s, where 140 and 2 are usual
TEXT = f"""[live.homing]
speed = "{HOMING} count/s"
[controller.sequence]
wait = "{WAIT} s"
"""


def quick(**serve: Any) -> LiveSettings:
    """Its settings, with some in [serve]. Machines that run tests are busy: nothing stops for
    lateness."""
    usual = LiveSettings()
    sequence = usual.controller.sequence._replace(wait=WAIT)
    return usual._replace(
        controller=usual.controller._replace(sequence=sequence),
        live=usual.live._replace(homing=usual.live.homing._replace(speed=HOMING)),
        serve=usual.serve._replace(miss_share=1.0, parent_timeout=5.0, **serve),
    )
