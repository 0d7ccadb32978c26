"""Capture the begin of a move at the loop's rate, with what was before it.

python examples/capture.py FOLDER [HOST [PORT]]

A machine of one stage must be served there (`macromicro serve --config ...`).
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt

import macromicro
from macromicro.serve.capturing import Trigger


def main(folder: Path, host: str, port: int) -> None:
    """Wait for an edge of the position, move over it, draw."""
    with macromicro.connect(host, port) as stage:
        stage.ready()
        limits = stage.state.limits
        start = 0.5 * (limits["whole_low"] + limits["whole_high"])
        step = 0.01 * (limits["whole_high"] - limits["whole_low"])
        stage.move_to(start)
        edge = Trigger("edge", "position", "rising", (start + 0.5 * step) * stage.place.per)
        capture = stage.capture(["position", "motor"], edge, before=0.2, after=0.5)
        stage.move_to(start + step)
        curves = capture.wait(30.0)
    folder.mkdir(parents=True, exist_ok=True)
    curves.save(folder / "capture.h5")
    figure, axes = plt.subplots(2, sharex=True, layout="constrained")
    for axis, name, unit in zip(axes, curves.names, curves.units, strict=True):
        axis.plot(curves.time, curves[name])
        axis.set(ylabel=f"{name} [{unit}]")
    axes[-1].set(xlabel="time from the trigger on [s]")
    figure.savefig(folder / "capture.png")
    print(f"{len(curves.time)} rows around {curves.triggered:.3f} s: {folder / 'capture.png'}")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3, 4):
        sys.exit(__doc__)
    where = sys.argv[2] if len(sys.argv) > 2 else "127.0.0.1"
    main(Path(sys.argv[1]), where, int(sys.argv[3]) if len(sys.argv) > 3 else 8080)
