"""Counts of an encoder, as the live machine has them."""

from __future__ import annotations

import math

from macromicro.types import Lines, Sample


def counted(t: float, counts: float) -> Sample:
    """What an encoder shows: whole counts, or NaN."""
    return Sample(t, _whole(counts), *[math.nan] * 4)


def with_pulse(told: Lines, captured: float, share: float) -> Lines:
    """What lines say, with the index pulse that passed since they were last read, if none is on.
    `share`: counts of the live machine in one of the encoder's."""
    pulse = captured if math.isnan(told.index_count) else told.index_count
    return told._replace(index_count=pulse * share)


def shared_out(count: float, share: float) -> float:
    """Counts of a rig's encoder in those of the live machine, which are coarser where the encoder
    is noisy: so many of these as `share` says are one."""
    return count if share == 1.0 else _whole(count * share)


def _whole(count: float) -> float:
    return count if math.isnan(count) else float(math.floor(count + 0.5))
