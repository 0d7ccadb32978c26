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
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from figures import Line, Scale, met, table, timed

import macromicro

RESULTS = Path(__file__).resolve().parents[1] / "results" / "bench.json"


def single() -> list[Line]:
    """One run."""
    import single

    return [*single.bench(), *single.common_job(), *single.cold()]


def many() -> list[Line]:
    """Thousands of variants."""
    import batch

    return batch.lines()


def sweeping() -> list[Line]:
    """One local worker and two."""
    import sweeping

    return sweeping.lines()


def tuning() -> list[Line]:
    """Whole searches."""
    import tuning

    return list(tuning.lines(timed, Line))


def tools() -> list[Line]:
    """Hysteresis and identification."""
    import tools

    return list(tools.lines(timed, Line))


def live() -> list[Line]:
    """The live loop."""
    import live

    return list(live.lines(Line))


def laws() -> list[Line]:
    """Laws of the macro-stage."""
    import laws

    return list(laws.lines(timed, Line))


def exported() -> list[Line]:
    """Cycles of the exported laws on a microcontroller."""
    import cycles

    return list(cycles.lines(Line))


GROUPS: dict[str, Callable[[], list[Line]]] = {
    f.__name__: f for f in (single, many, sweeping, tuning, tools, live, laws, exported)
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
    found = {name: GROUPS[name]() for name in wanted or GROUPS}
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
