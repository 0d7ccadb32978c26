"""Encoder counts of the live machine."""

from __future__ import annotations

import math

from macromicro.types import Lines, Sample


def counted(t: float, counts: float) -> Sample:
    """Whole counts, or NaN."""
    return Sample(t, _whole(counts), *[math.nan] * 4)


def with_pulse(told: Lines, captured: float, share: float) -> Lines:
    """Add an index pulse that passed since the last reading, in the live machine's counts."""
    pulse = captured if math.isnan(told.index_count) else told.index_count
    return told._replace(index_count=pulse * share)


def shared_out(count: float, share: float, *, whole: bool = False) -> float:
    """Convert encoder counts into the coarser counts of the live machine."""
    return count if share == 1.0 and not whole else _whole(count * share)


def _whole(count: float) -> float:
    return count if math.isnan(count) else float(math.floor(count + 0.5))
