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

import job as common
import loops
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


def show(record: dict[str, Any]) -> None:
    """The tables beside C."""
    print(f"\n{'one job, turn by turn':28}{'median':>10}{'least':>10}{'to C':>8}{'to native':>11}")
    for row in record["beside_c"]:
        print(
            f"{row['what']:28}{1e6 * row['median']:7.1f} us{1e6 * row['least']:7.1f} us"
            f"{row['ratio_of_least']:8.2f}{row['ratio_to_native']:11.2f}   off by "
            f"{row['counts_off']:g} counts, {row['volts_off']:g} V"
        )
    print(f"\n{'Preisach, samples/s':28}{'run':>10}{'kernel':>10}{'C':>10}{'C native':>10}")
    for row in record["preisach"]:
        best = [row[key][1] for key in ("run", "kernel", "c", "c_native")]
        print(
            f"{row['signal']:28}" + "".join(f"{rate:10.3g}" for rate in best)
            + f"   C over run {best[2] / best[0]:.2f}, over kernel {best[2] / best[1]:.2f}"
            + f", native over kernel {best[3] / best[1]:.2f}; off by {row['difference']:g}"
        )  # fmt: skip


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
            record["beside_c"] = loops.measure(job, folder, 1 if quick else 300)
            record["preisach"] = [
                row._asdict() for row in preisach_rate.measure(folder, 1 if quick else 11)
            ]
            show(record)
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
