"""Identify the shipped bench's actuator for the law `inverse`, as a user does; half a minute.

    python docs/make_actuator.py

writes the defaults of `controller.fine`, SI units, to src/macromicro/control/inverse/shipped.json.
`--quick` measures the kiln and the first heating alone, and writes nothing.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from macromicro.identify import kiln as kiln_fit
from macromicro.identify import wire_table
from macromicro.plant import bench
from macromicro.plant.bench import Bench, Sensors
from macromicro.thesis import kiln_bench
from macromicro.thesis.chapter5 import electrothermal_runs, kiln_runs
from macromicro.thesis.kiln_bench import KilnBench

PLACE = Path(__file__).parent.parent / "src/macromicro/control/inverse/shipped.json"
TUNED = ("ambient", "reach", "quick", "calm", "settle", "floor", "rise", "step")


def main() -> None:
    """Measure, fit, write."""
    machine = bench.prepare(Bench(), Sensors())
    table = kiln_fit.fod_table([kiln_runs.run(kiln_bench.prepare(KilnBench()), kiln_runs.cycles())])
    if "--quick" in sys.argv:
        electrothermal_runs.record(machine, electrothermal_runs.actuator_profiles()[0], 0)
        return
    found = wire_table.for_law(table, electrothermal_runs.for_actuator(machine))
    values = {k: v for k, v in found.gains._asdict().items() if k not in TUNED}
    rounded = {k: _rounded(v) for k, v in values.items()}
    PLACE.write_text(json.dumps(rounded, indent=1) + "\n", "utf-8")
    print(found.fit.values, f"rms {1e3 * found.fit.rms:.2f} um, sensor {1e3 * found.sensor:.3f} ms")


def _rounded(value: float | tuple[float, ...]) -> float | list[float]:
    if isinstance(value, tuple):
        return [float(f"{v:.6g}") for v in value]
    return float(f"{value:.6g}")


if __name__ == "__main__":
    main()
