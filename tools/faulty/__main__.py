"""Switch a fault on in a running rig."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from faulty import BOARD, FAULTS, board, inject


def main(arguments: list[str]) -> int:
    """Switch a fault on in a running rig."""
    path = os.environ.get(BOARD)
    if len(arguments) != 1 or arguments[0] not in FAULTS or not path or not Path(path).exists():
        print(f"{BOARD}=FILE python -m faulty FAULT\n", file=sys.stderr)
        print(f"FILE: the one that the server was started with ({path or 'none is given'})")
        for name, fault in FAULTS.items():
            print(f"  {name:<18} {fault.words}")
        return 2
    inject(board(path), arguments[0])
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
