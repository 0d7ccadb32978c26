"""A process that drives a rig until it is killed: ``python -m macromicro.rig._driven``."""

from __future__ import annotations

import math
import sys
import time

from macromicro.rig.opening import open_rig
from macromicro.types import SAFE

LONGEST = 1.0  # s: it ends by itself, outputs safe


def main() -> None:
    """Drive RIG at VOLTS until killed, for `LONGEST` or some counts; prints time and counts."""
    name, volts, most = sys.argv[1], float(sys.argv[2]), float(sys.argv[3])
    fixture, first, moved = open_rig(name, alone=True), math.nan, 0.0
    with fixture.open() as rig:
        while rig.now() < LONGEST and moved < most:
            sample = rig.read()
            if math.isnan(first):
                first = sample.encoder
            moved = abs(sample.encoder - first)
            print(rig.now(), sample.encoder, flush=True)
            rig.write(SAFE._replace(motor=volts))
            until = time.monotonic() + fixture.dt
            rig.wait(fixture.dt)
            time.sleep(max(until - time.monotonic(), 0.0))  # a virtual clock does not wait


if __name__ == "__main__":
    main()
