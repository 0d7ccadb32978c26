"""SCPI's status registers (SCPI-99, volume 1, 20)."""

from __future__ import annotations

from macromicro.machines import guard_words
from macromicro.rig import codes
from macromicro.serve import faults
from macromicro.serve.snapshot import OFF, Snapshot

ERRORS, QUESTIONABLE, MESSAGE, EVENT, MASTER, OPERATION = 4, 8, 16, 32, 64, 128

_MODES = {
    "settling": 1 << 1,
    "moving-macro": 1 << 8,
    "moving-micro": 1 << 9,
    "homing": 1 << 10,
    "holding": 1 << 11,
}
_TIME, _TEMPERATURE, _STAGE, _MICRO = 2, 4, 9, 10
_STAGES = (
    *(codes.MACRO_LOST, codes.STUCK, faults.LOST_COUNTS),
    *(codes.ENCODER_SILENT, codes.ENCODER_JUMP, codes.ENCODER_AGAINST),
)
_HALL = codes.HALL_SILENT, codes.HALL_FROZEN, codes.HALL_RANGE, codes.HALL_NOISY
_FAULTS = {
    **dict.fromkeys(_STAGES, _STAGE),
    **dict.fromkeys((codes.MICRO_LOST, *_HALL), _MICRO),
    **dict.fromkeys((codes.TOO_HOT, codes.NO_MOTION), _TEMPERATURE),
    **dict.fromkeys((codes.CLOCK, codes.CLOCK_STANDS, faults.LATE), _TIME),
}
_OTHERS = {guard_words.HOT: _TEMPERATURE, guard_words.CLOCK: _TIME, guard_words.ILLEGAL: None}


def bit_of(code: int) -> int | None:
    """The bit of a fault beside that of every fault."""
    if code < faults.STAGE:
        return _FAULTS.get(code)
    return _OTHERS.get(code % 100, _STAGE)


def of_mode(mode: str) -> int:
    """Bits of the operation register for a mode."""
    return _MODES.get(mode, 0) | (0 if mode in OFF else 1 << 13)


def operation(now: Snapshot) -> int:
    return of_mode(now.mode) | (1 << 12 if now.recording.active else 0)


def questionable(now: Snapshot) -> int:
    bits = 0 if now.trusted else 1 << 8
    if now.fault is not None:
        bits |= 1 << 11
        bit = bit_of(now.fault.code)
        bits |= 0 if bit is None else 1 << bit
    if not now.running or not now.age_s <= 1.0:
        bits |= 1 << 12
    return bits


class Register:
    """Condition, transition filters, event and enable of one register, 15 bits each."""

    def __init__(self) -> None:
        self.condition = 0
        self.event = 0
        self.preset()

    def preset(self) -> None:
        """As STATus:PRESet sets it: every rising bit is an event, none is enabled."""
        self.enable = 0
        self.positive = 0x7FFF
        self.negative = 0

    def see(self, condition: int) -> None:
        """Take a new condition; filtered changes become events."""
        rising, falling = condition & ~self.condition, self.condition & ~condition
        self.event |= (rising & self.positive) | (falling & self.negative)
        self.condition = condition

    def read(self) -> int:
        """Read and clear the event register."""
        event, self.event = self.event, 0
        return event

    @property
    def summary(self) -> bool:
        return bool(self.event & self.enable)
