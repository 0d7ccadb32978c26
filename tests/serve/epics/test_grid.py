"""Bluesky's grid_scan over two axes, unmodified, before a real server."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest
from tests.serve.stage.test_served import example

pytest.importorskip("caproto")
sys.path.insert(0, str(Path(__file__).parent))
import epics_parts as parts
from epics_parts import PREFIX

epics = pytest.importorskip("epics")
ophyd = pytest.importorskip("ophyd")
bluesky = pytest.importorskip("bluesky")


@pytest.mark.slow
def test_a_grid_of_two_axes(tmp_path: Path) -> None:
    """It sets both at once, and they go at once."""
    from bluesky.plans import grid_scan
    from ophyd.sim import det

    with parts.serving(tmp_path, example("xy-plotter")):
        axes = [ophyd.EpicsMotor(f"{PREFIX}:{name}", name=name) for name in ("x", "y")]
        for each in axes:
            each.wait_for_connection(timeout=20.0)
        for order in ("enable", "home"):
            assert (
                epics.caput(
                    f"{PREFIX}:{order}", 1, wait=True, timeout=60.0, connection_timeout=30.0
                )
                == 1
            )
        engine = bluesky.RunEngine({}, call_returns_result=True)
        rows: list[dict[str, Any]] = []
        engine.subscribe(lambda name, document: rows.append(document["data"]), "event")
        engine(grid_scan([det], axes[0], 20.0, 22.0, 2, axes[1], 30.0, 34.0, 3))
        assert [(row["x"], row["y"]) for row in rows] == [
            pytest.approx((x, y), abs=0.1) for x in (20.0, 22.0) for y in (30.0, 32.0, 34.0)
        ]
        for each in axes:
            each.destroy()
