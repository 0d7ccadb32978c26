"""Hall calibration (Section 3.2.3, Figure 3.9): slow ramps of CTRL, Hall against the laser.

``python -m macromicro.thesis.hall_ramps FILE`` runs it on the default twin
and writes the controller's table, ``hall_V,position_mm``.
"""

from __future__ import annotations

import sys
from pathlib import Path

from macromicro.arrays import Array
from macromicro.control.calibration import Calibration
from macromicro.hall_table import profile
from macromicro.identify.hall import calibrate
from macromicro.lab.drive import drive
from macromicro.lab.machine import Machine
from macromicro.plant import bench
from macromicro.plant.bench import Bench, Sensors


def collect(plant: Machine, seed: int = 0, runs: int = 3) -> list[tuple[Array, Array]]:
    ctrl, parts = profile(runs)
    found = drive(plant, "the Hall calibration", ("hall", "laser"), ctrl, seed=seed)
    return [(found["hall"][part], found["laser"][part]) for part in parts]


def table(plant: Machine | None = None, seed: int = 0) -> Calibration:
    return calibrate(collect(plant or bench.prepare(Bench(), Sensors()), seed))


def as_csv(result: Calibration) -> str:
    """The table in the format of ``macromicro.control.calibration``."""
    lines = ["# Hall calibration of the default bench: Section 3.2.3, three runs up and down"]
    lines.append("hall_V,position_mm")
    lines += [
        f"{result.low + i * result.step:.4f},{1e3 * x:.6f}" for i, x in enumerate(result.position)
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(as_csv(table()), encoding="utf-8")
