"""The simulated board at a pseudo-terminal: python -m boardsim --elf ELF --link PORT."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from boardsim.bench import SWITCHES, Bench
from boardsim.server import Server
from boardsim.wire import Wire


def main() -> None:
    """Serve until the file --until exists; write what was put out into --trace."""
    parser = argparse.ArgumentParser(prog="boardsim", description=__doc__)
    parser.add_argument("--elf", type=Path, required=True)
    parser.add_argument("--link", type=Path, required=True, help="symbolic link to the port")
    parser.add_argument("--until", type=Path, help="end when this file exists")
    parser.add_argument("--trace", type=Path, help="motor, ctrl, enable of each period (.npy)")
    parser.add_argument("--alone", type=Path, help="written when a host has gone for 2 s")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--flips", type=float, default=0.0)
    parser.add_argument("--switches", action="store_true", help="limit switches near the stops")
    given = parser.parse_args()
    wire = Wire(Bench(given.elf, given.seed), given.flips, given.seed)
    if given.switches:
        wire.bench.switches = SWITCHES
    server = Server(wire)
    given.link.unlink(missing_ok=True)
    given.link.symlink_to(server.name)
    print(json.dumps({"port": str(given.link)}), flush=True)
    try:
        server.serve(given.until, given.alone)
    finally:
        if given.trace:
            np.save(given.trace, np.array(wire.trace))
        given.link.unlink(missing_ok=True)


if __name__ == "__main__":
    main()
