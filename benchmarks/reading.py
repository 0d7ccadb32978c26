"""How long does it take to read and identify long records? Seconds, and memory by that of numbers.

Memory of reading is what it adds to the process. That of both is what a short record does not need:
libraries alone, most of them for compiled code, take as much as some millions of rows.

python benchmarks/reading.py [ROWS ...]

Each in a process of its own, on a file that is made first: an axis under a known force, with noise,
three columns of text. `make bench-identify` prints it.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROWS = (1_000_000, 10_000_000)
SHORT = 10_000
DT = 1e-3


def main() -> None:
    if sys.argv[1:2] == ["--one"]:
        print(json.dumps(one(Path(sys.argv[2]))))
        return
    short, _ = measured(SHORT)
    print(
        f"{'rows':>9}  {'file':>7}  {'read':>7}  {'memory':>13}  {'identified':>10}  "
        f"{'memory':>13}  {'in all':>7}  mass, 95 kg"
    )
    for rows in map(int, sys.argv[1:] or ROWS):
        found, size = measured(rows)
        both = (found["peak"] - short["peak"]) / found["numbers"]
        print(
            f"{rows:>9}  {size:>4.0f} MB  {found['read']:>5.1f} s  "
            f"{found['memory'] / found['numbers']:>4.1f} x numbers  {found['identified']:>8.1f} s  "
            f"{both:>4.1f} x numbers  {found['peak'] / 1e6:>4.0f} MB  "
            f"{found['mass']:.2f} +- {found['error']:.2f}"
        )


def measured(rows: int) -> tuple[dict[str, float], float]:
    """What `one` finds in a process of its own, and the size of the file, MB."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "axis.csv"
        written(path, rows)
        words = [sys.executable, __file__, "--one", str(path)]
        done = subprocess.run(words, check=True, stdout=subprocess.PIPE, text=True)
        return json.loads(done.stdout.splitlines()[-1]), path.stat().st_size / 1e6


def written(path: Path, rows: int) -> None:
    import pyarrow as pa
    from pyarrow import csv

    from macromicro.models.mass import Axis, simulate

    rng = np.random.default_rng(2)
    t = np.arange(rows) * DT
    u = 40.0 * np.sign(np.sin(2.2 * t + np.sin(0.05 * t))) + 30.0 * np.sin(5.7 * t)
    force = u + 0.8 * np.repeat(rng.standard_normal(rows // 50 + 1), 50)[:rows]
    x = simulate(Axis(mass=95.0, viscous=203.0, coulomb=20.0, offset=-3.0), force, DT)
    x += 1e-6 * rng.standard_normal(rows)
    csv.write_csv(pa.table({"t_s": np.round(t, 3), "u_N": u, "x_m": x}), path)


def one(path: Path) -> dict[str, float]:
    from macromicro.files.reading import read_table
    from macromicro.identify import drive
    from macromicro.identify.kinds.drive import ROLES
    from macromicro.identify.picking import pick

    before, begin = peak(), time.perf_counter()
    values = pick(read_table(path), ROLES, {}).values
    taken, memory = time.perf_counter() - begin, peak() - before
    numbers = sum(column.nbytes for column in values.values())
    begin = time.perf_counter()
    fit = drive(values["t"], values["u"], values["x"]).surest
    return {
        "read": taken,
        "memory": memory,
        "numbers": numbers,
        "peak": peak(),
        "identified": time.perf_counter() - begin,
        "mass": fit.axis.mass,
        "error": float(fit.std[0]),
    }


def peak() -> float:
    """Bytes of this process alone: what `getrusage` says counts its parent's as well."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return 1024.0 * next(float(line.split()[1]) for line in lines if line.startswith("VmHWM"))


if __name__ == "__main__":
    main()
