"""Figure of a learned trajectory: the error before and after, and from run to run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from macromicro.drawing import files
from macromicro.drawing.style import BLUE, ORANGE, RED, finish, line, new
from macromicro.lab.learning import Learned


def draw(found: Learned, folder: Path, kinds: Sequence[str]) -> None:
    if not kinds:
        return
    figure, axes = new(6.4, 3)
    above, middle, below = axes[:, 0]
    rows = found.programme.stage == 1
    t, learned = found.programme.start[rows], found.programme.correction[rows]
    line(above, found.first.t, 1e6 * found.first.error, ORANGE, "first run")
    line(above, found.last.t, 1e6 * found.last.error, BLUE, "learned")
    finish(above, "By the Hall sensor", y="error [um]", legend=True)
    line(middle, t, 1e6 * learned, RED, "", drawstyle="steps-post")
    finish(middle, "Correction added to the target", y="correction [um]")
    runs = np.arange(1, len(found.repetitions) + 1)
    below.plot(
        runs, [1e6 * r.rms for r in found.repetitions], "o-", color=BLUE, label="Hall sensor"
    )
    below.plot(runs, [1e6 * r.true for r in found.repetitions], "s--", color=ORANGE, label="laser")
    below.set_ylim(bottom=0.0)
    finish(below, "From run to run", "run", "RMS error [um]", legend=True)
    files.save(figure, folder, "learning", kinds)
