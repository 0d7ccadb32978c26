"""What `identify drive --structure lugre` tells of a fit."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from macromicro.arrays import Array
from macromicro.identify import presliding_fit
from macromicro.identify._disturbances import Ripple
from macromicro.identify.kinds import from_files
from macromicro.identify.presliding import Presliding
from macromicro.identify.presliding_fit import PreslidingFit
from macromicro.identify.runs import Run

NAMES = ("mass", "viscous", "offset", "stiffness", "settling", "level 1")
VALUES = np.array([2.0, 15.0, 0.3, 5e4, 4e-3, 5.0])
MODEL = Presliding(2.0, 15.0, 0.3, 0.0, 0.0, 0.01, 5e4, 4e-3, np.array([5.0]), -1.0, 1.0)
T = np.arange(300) * 1e-3
RECORD = Run(T, np.sin(T), 0.1 * np.sin(T))


def fitted(factors: Array, repeats: Ripple | None) -> PreslidingFit:
    free = (RECORD.x,)
    judged: dict[str, float] = {"lugre, one level": 1e-3}
    told = (VALUES, 0.1 * VALUES, factors, judged, {}, "lugre, one level", 1e-5)
    return PreslidingFit(MODEL, NAMES, *told, free, (0.0 * T,), 1.0, 0, repeats)


@pytest.mark.parametrize("repeats", [None, Ripple(2.0 * math.pi / 0.06, 0.025, 0.025, 0.0)])
def test_intervals_and_a_force_that_repeats_are_told(
    repeats: Ripple | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    factors = np.array([[1.0] * 6, [1.96, 1.96, 1.96, 2.1, 3.4, 1.42]])
    found = fitted(factors, repeats)
    monkeypatch.setattr(presliding_fit, "presliding_drive", lambda *_, **__: found)
    np.savez(tmp_path / "a.npz", t_s=T, u_N=RECORD.u, x_m=RECORD.x)
    told = from_files("drive", tmp_path / "a.npz", structure="lugre", along=1)
    assert told.lines[0].unit == "kg" and told.lines[3].unit == "N/m"
    halves = {line.name: line.half / line.error for line in told.lines}
    assert halves == pytest.approx(
        {"mass": 1.96, "viscous": 1.96, "offset": 1.96}
        | {"stiffness": 2.1, "settling": 3.4, "coulomb": 1.42}
    )
    words = dict(told.remarks).get("repeats", "")
    assert bool(words) == (repeats is not None)
    assert not words or ("0.025 N" in words and "0.06 m" in words)
