"""Random orders and injuries: python -m boardtrial; exit status 1 unless all is as it must be."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import sections
from boardtrial import orders, table
from boardtrial.trial import Trial


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m boardtrial", description=__doc__)
    parser.add_argument("--elf", type=Path, default=Path("build/firmware/atmega328p.elf"))
    parser.add_argument("--minutes", type=float, default=60.0, help="of the board's time")
    parser.add_argument("--patience", type=float, default=1e9, help="minutes of this computer's")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("results/trial.md"))
    given = parser.parse_args()
    began = time.monotonic()
    trial = Trial(given.elf, given.seed)
    while trial.line.bench.tick < 60_000 * given.minutes:
        trial.round(orders.ORDERS, orders.INJURIES)
        if time.monotonic() - began > 60.0 * given.patience:
            break
    text = table.section(trial, given.seed, time.monotonic() - began)
    sections.write(given.out, "trial", text)
    print(text)
    return 1 if trial.judge.count or trial.count else 0


if __name__ == "__main__":
    sys.exit(main())
