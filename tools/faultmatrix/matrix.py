"""All cells of a kind."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from faultmatrix.bed import homed
from faultmatrix.cells import MICRO, MODES, Cell, Trial, healthy, planned, worst
from faultmatrix.subjects import made
from macromicro.rig import faulty

QUICK = ("encoder-frozen", "encoder-silent", "encoder-jump", "encoder-dither", "motor-dead")
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
    wanted = only or (QUICK if quick else tuple(faulty.NAMES))
    faults = [name for name in plan.faults if name in wanted and (only or name not in _ELSE)]
    found = []
    for mode in modes:
        if mode == "homing" and plan.absolute:
            continue
        whole = healthy(plan, mode)
        for fault in faults:
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
