"""Whether a recording shows anything that nothing explains."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from macromicro.control.live.messages import DISABLED, FAULT, READY
from macromicro.recording import Recording


class Verdict(NamedTuple):
    """Of a recording: `rows`; `gaps` in its time; `illegal` rows; rows with a fault or without
    being enabled and an output that is `unsafe`; `torn`: motions that came twice; codes of the
    faults that began in it, and the numbers of the motions."""

    rows: int
    gaps: int
    illegal: int
    unsafe: int
    torn: int
    faults: tuple[int, ...]
    motions: frozenset[int]


def judge(path: Path, *, most: float = 5.0, led: bool = False) -> Verdict:
    """Look at every row. `most` [V]: of the motor; a `led` stage is held by its law when ready."""
    run = Recording.load(path)
    motor, ctrl, fan = run["motor"], run["ctrl"], run["fan"]
    mode, fault, motion = run["mode"], run["fault"], run["motion"]
    # Where the rig's clock stops or gives no number, rows pass all the same: between two rows
    # whose times differ there must be as many rows as milliseconds.
    t = run["t"]
    told = np.flatnonzero(np.isfinite(t) & (np.diff(t, prepend=np.nan) != 0.0))
    steps = np.round(np.diff(t[told]) * 1e3) - np.diff(told)
    # The faults of the rig's clock move it by whole hours and by 10 s, and back.
    known = np.isin(np.abs(steps), (0.0, 3.6e6, 1e4, 3.61e6))
    legal = (np.abs(motor) <= most) & (ctrl >= 0.0) & (ctrl <= 5.0) & ((fan == 0) | (fan == 1))
    idle = (mode == DISABLED) | ((mode == READY) & (not led))
    latched = (fault != 0) | (mode == FAULT)
    on = (motor != 0.0) | (ctrl != 0.0)
    unsafe = (idle | latched) & on | (latched & (fan != 0))
    if led:  # its law gives the effort behind the row: a row shows the one of the period before
        unsafe[1:] &= (idle | latched)[:-1]
    began = np.flatnonzero(np.diff(fault, prepend=0) != 0)
    starts = motion[np.flatnonzero(np.diff(motion, prepend=0) != 0)]
    numbers = starts[starts > 0].tolist()
    return Verdict(
        run.rows,
        int(np.count_nonzero(~known)),
        int(np.count_nonzero(~legal)),
        int(np.count_nonzero(unsafe)),
        len(numbers) - len(set(numbers)),
        tuple(int(c) for c in fault[began] if c),
        frozenset(numbers),
    )
