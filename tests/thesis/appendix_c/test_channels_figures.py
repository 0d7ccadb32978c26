"""Tables C.1 and C.2."""

from __future__ import annotations

from macromicro.drawing.exhibit import Grid
from macromicro.recorded import COLUMNS
from macromicro.thesis.contents import find
from macromicro.thesis.procedure import Lab
from macromicro.types import Outputs, Sample

PROCEDURE = find("channels")


def test_tables_are_complete() -> None:
    data = PROCEDURE.collect(Lab())
    rig, signals = (draw(data).body for draw in PROCEDURE.figures.values())
    assert isinstance(rig, Grid) and isinstance(signals, Grid)
    assert [row[0] for row in rig.rows] == [*Sample._fields[1:], *Outputs._fields]
    assert [row[0] for row in signals.rows] == [c.name for c in COLUMNS]
    laser = next(row for row in rig.rows if row[0] == "laser")
    assert laser[2] == "m" and laser[-1] == "laser [um] * 1e+06"
