"""Fills the matrix and writes its tables; exit status 1 where a cell must not be."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

from faultmatrix import table
from faultmatrix.matrix import filled
from faultmatrix.subjects import SUBJECTS


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m faultmatrix", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/matrix.md"), help="the tables")
    parser.add_argument("--quick", action="store_true", help="one moment of each mode, few faults")
    parser.add_argument("--kinds", nargs="+", choices=SUBJECTS, default=list(SUBJECTS))
    parser.add_argument("--faults", nargs="+", default=None, help="these alone")
    given = parser.parse_args()
    cells = []
    with tempfile.TemporaryDirectory(prefix="macromicro-matrix-") as folder:
        for kind in given.kinds:
            began = time.monotonic()
            cells += filled(kind, Path(folder), quick=given.quick, only=given.faults)
            print(f"{kind}: {time.monotonic() - began:.0f} s", file=sys.stderr, flush=True)
    text = table.section(cells)
    table.write(given.out, text)
    print(text)
    return 1 if table.bad(cells) else 0


if __name__ == "__main__":
    sys.exit(main())
