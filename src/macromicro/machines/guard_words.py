"""Faults of the single-stage guard in words."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import NamedTuple

OK, ILLEGAL, SILENT, LOW, HIGH, FAST, LOST, STUCK = range(8)
LIMIT_LOW, LIMIT_HIGH, LIMITS, DRIVE, NOT_ENABLED = range(8, 13)
JUMP, FROZEN, AGAINST, HOT, CLOCK = range(13, 18)
OTHER_AXIS = 100  # the guard of another axis of the machine has found a fault
KEEPS_PLACE = (OK, ILLEGAL, DRIVE, NOT_ENABLED, HOT, OTHER_AXIS)  # else the position is in doubt


class Text(NamedTuple):
    """A fault in words; `evidence` formats {value} and {limit}, positions in {unit}."""

    name: str
    message: str
    evidence: str
    remedy: str
    placed: bool = False


_TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
TEXTS = {int(code): Text(**row) for code, row in _TABLE.items()}
