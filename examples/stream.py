"""Stream set points to a served stage, and draw how closely it follows.

python examples/stream.py FOLDER [HOST [PORT]]

A machine of one stage must be served there (`macromicro serve --config ...`). It swings around the
middle of its travel for 4 s, led by 500 set points a second.
"""

import math
import sys
import time
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import macromicro

RATE, SECONDS = 500.0, 4.0


def main(folder: Path, host: str, port: int) -> None:
    """Stream, capture, draw."""
    with macromicro.connect(host, port) as stage:
        stage.ready()
        limits = stage.state.limits
        middle = 0.5 * (limits["whole_low"] + limits["whole_high"])
        size = 0.05 * (limits["whole_high"] - limits["whole_low"])
        stage.move_to(middle)
        pitch, w = stage.about["limits"]["pitch"], math.pi
        names = ["position", "macro_position", "macro_reference"]
        capture = stage.capture(names, "begin", after=SECONDS)
        with stage.follow(hold=0.5) as stream:
            began = time.monotonic()
            for k in range(round(RATE * SECONDS)):
                t = time.monotonic() - began
                stream.put(middle + size * math.sin(w * t), size * w * math.cos(w * t))
                time.sleep(max(began + (k + 1) / RATE - time.monotonic(), 0.0))
        end = stream.motion.wait()
        curves = capture.wait(30.0)
    off = (curves["macro_reference"] - curves["macro_position"]) * pitch * 1e6
    print(f"set points taken: {end['evidence']['set_points']}")
    print(f"greatest distance from the set point: {np.abs(off).max():.3g} um or urad")
    folder.mkdir(parents=True, exist_ok=True)
    curves.save(folder / "stream.csv")
    figure, (top, low) = plt.subplots(2, sharex=True, layout="constrained")
    top.plot(curves.time, curves["position"])
    top.set(ylabel=f"position [{curves.units[0]}]")
    low.plot(curves.time, off)
    low.set(xlabel="time [s]", ylabel="set point less position [um]")
    figure.savefig(folder / "stream.png")
    print(f"figure: {folder / 'stream.png'}")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3, 4):
        sys.exit(__doc__)
    where = sys.argv[2] if len(sys.argv) > 2 else "127.0.0.1"
    main(Path(sys.argv[1]), where, int(sys.argv[3]) if len(sys.argv) > 3 else 8080)
