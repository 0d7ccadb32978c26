"""The guard around a rig watches the sensors that the rig has, and no others."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from macromicro.control import calibration
from macromicro.rig import codes, guard
from macromicro.rig.guarded import Guarded
from macromicro.rig.limits import Limits
from macromicro.types import SAFE, Sample

SENSORS = ("encoder", "hall")


def rig(channels: tuple[str, ...]) -> Any:
    """A rig that gives nothing but the time."""
    nan = math.nan
    return SimpleNamespace(
        channels=channels,
        read=lambda: Sample(0.0, nan, nan, nan, nan, nan),
        write=lambda outputs: None,
    )


@pytest.mark.parametrize("channels", [(), ("encoder",), ("hall",), SENSORS])
def test_only_a_sensor_that_is_there_can_fall_silent(channels: tuple[str, ...]) -> None:
    limits = guard.prepare(Limits(), calibration.shipped())
    watched = Guarded(rig(channels), limits, 1e-3)
    for _ in range(100):
        watched.write(SAFE._replace(ctrl=1.0))
    assert watched.tripped == bool(channels)
    if channels:
        silent = {"encoder": codes.ENCODER_SILENT, "hall": codes.HALL_SILENT}
        assert watched.watch.fault == silent[channels[0]]
        assert watched.given == SAFE
