"""Random orders and injuries: python -m boardtrial; exit status 1 where anything is not as it must be."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from boardtrial import orders, table
from boardtrial.trial import Trial


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m boardtrial", description=__doc__)
    parser.add_argument("--elf", type=Path, default=Path("build/firmware/atmega328p.elf"))
    parser.add_argument("--minutes", type=float, default=60.0, help="of the board's time")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("results/boardtrial.md"))
    given = parser.parse_args()
    began = time.monotonic()
    trial = Trial(given.elf, given.seed)
    try:
        trial.run(round(60_000 * given.minutes), orders.ORDERS, orders.INJURIES)
    except KeyboardInterrupt:
        pass
    text = table.section(trial, given.seed, time.monotonic() - began)
    table.write(given.out, text)
    print(text)
    return 1 if trial.judge.unsafe or trial.unexplained else 0


if __name__ == "__main__":
    sys.exit(main())
