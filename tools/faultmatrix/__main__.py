"""Fills the matrix and writes its tables; exit status 1 where a cell must not be."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import sections
from faultmatrix import table
from faultmatrix.cells import Cell
from faultmatrix.matrix import filled
from faultmatrix.subjects import SUBJECTS


def _filled(kind: str, folder: Path, quick: bool, only: Sequence[str] | None) -> list[Cell]:
    """The cells of a kind, and a line on how long they took."""
    began = time.monotonic()
    cells = filled(kind, folder, quick=quick, only=only)
    print(f"{kind}: {time.monotonic() - began:.0f} s", file=sys.stderr, flush=True)
    return cells


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m faultmatrix", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/matrix.md"), help="the tables")
    parser.add_argument("--quick", action="store_true", help="one moment of each mode, few faults")
    parser.add_argument("--workers", type=int, default=1, help="processes, each a kind at a time")
    parser.add_argument("--kinds", nargs="+", choices=SUBJECTS, default=list(SUBJECTS))
    parser.add_argument("--faults", nargs="+", default=None, help="these alone")
    given = parser.parse_args()
    cells: list[Cell] = []
    with tempfile.TemporaryDirectory(prefix="macromicro-matrix-") as folder:
        fill = partial(_filled, folder=Path(folder), quick=given.quick, only=given.faults)
        with ProcessPoolExecutor(given.workers) as pool:
            for found in pool.map(fill, given.kinds):
                cells += found
    text = table.section(cells)
    sections.write(given.out, "matrix", text)
    print(text)
    return 1 if table.bad(cells) else 0


if __name__ == "__main__":
    sys.exit(main())
