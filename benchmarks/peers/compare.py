"""One common job by the package, by C and by its peers; `make bench-peers` runs it.

Prints tables and writes results/peers.json. A peer that cannot be installed or fails becomes
a row with the reason. Names of peers as arguments leave the others out. Nothing is asserted.
`--quick` compares with C and plain Python alone, once, and writes nothing.
"""

from __future__ import annotations

import json
import os
import platform
import sys
import tempfile
from pathlib import Path
from typing import Any

import beside_c
import job as common
import peers
import preisach_rate
from compiling import NoCompilerError, version

import macromicro

RESULTS = Path(__file__).resolve().parents[2] / "results" / "peers.json"
SOME = RESULTS.with_name("peers-some.json")


def processor() -> str:
    """The processor's name as far as the system tells it."""
    place = Path("/proc/cpuinfo")
    if place.is_file():
        for line in place.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor()


def machine() -> dict[str, Any]:
    """What the times depend on."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {
        "processor": processor(),
        "cores": os.cpu_count(),
        "load_at_start": load,
        "system": platform.platform(),
        "python": platform.python_version(),
        "macromicro": macromicro.__version__,
        "compiler": version(),
    }


def main(wanted: list[str]) -> int:
    """Measure, print, write; 2 for a name that no peer has, 1 where a quick run found no C."""
    quick = "--quick" in wanted
    wanted = ["macromicro", "plain Python"] if quick else wanted
    known = [peer.name for peer in peers.PEERS]
    for word in wanted:
        if not any(word.lower() in name.lower() for name in known):
            accepted = f"a word of {', '.join(known)}"
            print(f"compare.py: {word!r}; accepted: {accepted}", file=sys.stderr)
            return 2
    record: dict[str, Any] = {"machine": machine(), "without_c": ""}
    print("  ".join(f"{name}: {value}" for name, value in record["machine"].items()))
    if (record["machine"]["load_at_start"] or 0.0) > 0.5 and not quick:
        print("other programmes are at work here: long runs take longer than they should")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        job = common.default()
        record["job"] = job._asdict()
        try:
            record["beside_c"] = beside_c.measure(job, folder, 1 if quick else 300)
            record["preisach"] = [
                row._asdict() for row in preisach_rate.measure(folder, 1 if quick else 11)
            ]
            beside_c.show(record)
        except NoCompilerError as problem:
            record["without_c"] = str(problem)
            print(f"no comparison with C: {problem}")
        rows = peers.measure(job, folder, wanted)
        record["peers"] = [row._asdict() for row in rows]
        peers.show(rows)
    if quick:
        return int(bool(record["without_c"]) or any(row.failed for row in rows))
    place = SOME if wanted else RESULTS  # what all gave stays beside what some give
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
    print(f"written: {place}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
