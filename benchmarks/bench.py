"""How fast it is: prints a table and writes results/bench.json. `make bench` runs it.

Ratios to C, compiled and measured on this machine in the same run, are the claims; absolute
times are this machine's. Nothing is asserted. `python benchmarks/bench.py single many` runs
only these groups; `--quick` runs everything once and small, writes nothing, and ends with status 1
where a figure could not be measured.
"""

from __future__ import annotations

import json
import os
import platform
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from figures import Scale, met, table

import macromicro

RESULTS = Path(__file__).resolve().parents[1] / "results" / "bench.json"


# Groups, and the files that measure them.
GROUPS = {
    "single": "single",  # one run
    "many": "batch",  # thousands of variants
    "sweeping": "sweeping",  # one local worker and two
    "tuning": "tuning",  # whole searches
    "tools": "tools",  # hysteresis and identification
    "live": "live",  # the live loop
    "laws": "laws",  # laws of both stages
    "exported": "cycles",  # cycles of the exported laws on a microcontroller
}


def _earlier() -> dict[str, Any]:
    """Groups of an earlier run, to be kept beside those that are measured anew."""
    try:
        figures = json.loads(RESULTS.read_text(encoding="utf-8"))["figures"]
    except (OSError, ValueError, KeyError):
        return {}
    return figures if isinstance(figures, dict) else {}


def main(wanted: list[str]) -> int:
    """Measure, print, write."""
    Scale.quick = "--quick" in wanted
    wanted = [name for name in wanted if name != "--quick"]
    unknown = [name for name in wanted if name not in GROUPS]
    if unknown:
        print(f"bench.py: {unknown[0]!r}; accepted: {', '.join(GROUPS)}", file=sys.stderr)
        return 2
    load = os.getloadavg()[0]
    if load > 0.5 and not Scale.quick:
        print(f"load {load:.1f}: other programmes are at work, times and ratios will wander")
    found = {name: import_module(GROUPS[name]).lines() for name in wanted or GROUPS}
    print(table([line for lines in found.values() for line in lines]))
    if Scale.quick:
        return int(any(line.measured is None for lines in found.values() for line in lines))
    record: dict[str, Any] = {
        "version": macromicro.__version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "machine": platform.machine(),
        "cores": os.cpu_count(),
        "figures": _earlier() if wanted else {},
    }
    for name, lines in found.items():
        rows = [{**line._asdict(), "met": met(line)} for line in lines]
        record["figures"][name] = {"load_at_start": load, "lines": rows}
    RESULTS.parent.mkdir(parents=True, exist_ok=True)
    RESULTS.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
    print(f"written: {RESULTS}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
