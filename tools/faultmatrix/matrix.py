"""All cells of a kind."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import faulty
from faultmatrix.bed import homed
from faultmatrix.cells import MICRO, MODES, Cell, Trial, healthy, planned, worst
from faultmatrix.subjects import made

# What a quick matrix tries: this fault in every mode, and in this mode every fault of these kinds.
QUICK_FAULT, QUICK_MODE, QUICK_KINDS = "encoder-jump", "moving", ("slide-switches", "two-stage")
# Their time is the loop's and this computer's: `soak` tries them.
_ELSE = tuple(
    n for n, f in faulty.FAULTS.items() if f.later or f.clock or f.stall or f.raises or f.hangs
)


def filled(
    kind: str,
    folder: Path,
    *,
    quick: bool = False,
    only: Sequence[str] | None = None,
    modes: Sequence[str] = MODES,
) -> list[Cell]:
    """The cells of a kind, in the order of the tables; the same for the same settings."""
    subject = made(kind, folder / kind)
    plan = planned(subject, homed(subject))
    found = []
    for mode in modes:
        if mode == "homing" and plan.absolute:
            continue
        whole = healthy(plan, mode)
        wanted = only or [name for name in faulty.NAMES if name not in _ELSE]
        if quick and not only and not (mode == QUICK_MODE and kind in QUICK_KINDS):
            wanted = [QUICK_FAULT]
        for fault in [name for name in plan.faults if name in wanted]:
            found.append(worst(
                Trial(plan, fault, mode, share, whole).run()
                for share in moments(fault, mode, quick)
            ))  # fmt: skip
    return found


def moments(fault: str, mode: str, quick: bool) -> tuple[float, ...]:
    """When a fault comes, as shares of the motion."""
    if mode != "homing":
        # Of two stages the carriage goes first, and the stage on it has most of the time.
        return (0.5,) if fault.startswith(MICRO) else (0.1,)
    if quick:
        return (0.4,)
    if faulty.FAULTS[fault].brief:
        return tuple(0.05 + 0.1 * k for k in range(10))
    return (0.1, 0.5, 0.85)
