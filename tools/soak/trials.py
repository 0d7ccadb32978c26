"""What each trial does to a machine, and which faults may come of it."""

from __future__ import annotations

from typing import NamedTuple

import faulty
from faultmatrix.subjects import Made
from macromicro.rig import codes
from macromicro.serve import faults
from soak import disturbing


class Trial(NamedTuple):
    name: str  # of a fault of the rig, or of a disturbance around the machine
    stage: str = ""  # "macro" or "micro": the motion that it is to meet; "": any order
    codes: tuple[int, ...] | None = None  # faults that it may raise; None: any
    sure: bool = False  # whether one of them must come
    around: bool = False  # whether it is a disturbance


NO_FAULT = Trial(faulty.NONE, codes=())
_HALL = (codes.HALL_RANGE, codes.HALL_NOISY, codes.MICRO_LOST)
_DRIVE = (codes.STUCK, codes.MACRO_LOST)
_WIRE = (codes.NO_MOTION, codes.TOO_HOT, codes.MICRO_LOST)
# The laser shows these as well, and either may come first.
_COUNTS = (*_DRIVE, faults.LOST_COUNTS)

TWO_STAGE = (
    Trial("encoder-frozen", "macro", _COUNTS, True),
    Trial("encoder-reversed", "macro", (*_COUNTS, codes.ENCODER_AGAINST), True),
    # What is left of a move may be too short for two counts to be lost.
    Trial("encoder-skipping", "macro", _COUNTS),
    Trial("encoder-jump", "macro", (codes.ENCODER_JUMP,), True),
    Trial("encoder-silent", "macro", (codes.ENCODER_SILENT,), True),
    Trial("hall-stuck", "micro", (codes.HALL_FROZEN, *_WIRE), True),
    Trial("hall-range", "micro", _HALL, True),
    Trial("hall-low", "micro", _HALL, True),
    Trial("hall-noisy", "micro", (codes.HALL_NOISY,), True),
    Trial("hall-silent", "micro", (codes.HALL_SILENT,), True),
    Trial("laser-lost", "micro", ()),
    Trial("wire-broken", "micro", _WIRE, True),
    Trial("motor-dead", "macro", _DRIVE, True),
    Trial("fan-lost", "micro", ()),
    Trial("carriage-stuck", "macro", _DRIVE, True),
    Trial("clock-ahead", "macro", (codes.CLOCK,), True),
    Trial("clock-back", "micro", (codes.CLOCK,), True),
    # With its end the clock jumps as well.
    Trial("clock-stands", "macro", (codes.CLOCK_STANDS, codes.CLOCK), True),
    Trial("clock-none", "micro", (codes.CLOCK_STANDS, codes.CLOCK), True),
    Trial("slow", "macro", (faults.LATE,), True),
)
AROUND = tuple(Trial(name, codes=(), around=True) for name in disturbing.NAMES)
# Of the other kinds, whose clocks are the loop's.
_LEFT_OUT = ("clock-ahead", "clock-back", "clock-stands", "clock-none", "slow", "unplugged",
             "hanging")  # fmt: skip


def trials(subject: Made) -> tuple[Trial, ...]:
    """The trials of a kind of machine."""
    if subject.led:
        names = (name for name in subject.faults() if name not in _LEFT_OUT)
        return (*map(Trial, names), *AROUND)
    return (*TWO_STAGE, *AROUND)
