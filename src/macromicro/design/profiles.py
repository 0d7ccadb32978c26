"""Results of a run's motion profiles: the error on the way, and the settling time.

The "move and settle" time is from the end of a profile's reference until the stage stays within
its band. Errors as in `macromicro.design.tracking`: macro from the encoder, micro from the laser.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from macromicro.control.supervisor import DONE
from macromicro.control.supervisor import MICRO as FINE
from macromicro.design import zero
from macromicro.design.response import MACRO_BAND, MICRO_BAND, PITCH, SMOOTH, entry, smoothed, tail
from macromicro.programme import MACRO, Programme, Span
from macromicro.recording import Recording


class ProfileResult(NamedTuple):
    """One profile; None: did not happen, or unknown."""

    profile: int  # index in the programme, from 0
    stage: str  # "macro" or "micro"
    unit: str  # mm for macro, um for micro; of places, errors and band
    origin: float  # where it begins
    target: float  # where it ends
    start_s: float  # when its reference begins, s
    end_s: float  # when its reference arrives, s
    # how much of it was left out at its beginning, because the carriage had not settled, s
    late_s: float
    rms_error: float | None  # RMS of reference less reading on the way
    peak_error: float | None  # its largest magnitude
    peak_s: float | None  # where that was, s
    # from `end_s` until the error stays within `band` up to the end of the hold, s; None if it
    # does not, or the hold is 0
    settled_s: float | None
    band: float  # largest error of a stage that has settled
    final_error: float | None  # target less the mean reading over the hold's last 0.5 s
    complete: bool  # whether the run lasted until the end of its hold


def profiles(
    recording: Recording,
    programme: Programme,
    *,
    pitch: float = PITCH,
    macro_band: float = MACRO_BAND,
) -> list[ProfileResult]:
    """One result for each profile that was begun; `macro_band` in counts."""
    ran = len(recording) * recording.dt
    spans = _spans(recording, programme) if programme.mixed else programme.profiles
    return [
        _one(recording, k, span, pitch * 1e3, macro_band)
        for k, span in enumerate(spans)
        if span.begin + recording.dt < ran
    ]


def _spans(recording: Recording, programme: Programme) -> Iterator[Span]:
    move, dt = recording["move"], recording.dt
    for span in programme.profiles:
        first, behind = (int(row) for row in np.searchsorted(move, (span.first, span.behind)))
        if first == len(move):
            return
        begin = (first - 1) * dt  # its time 0 is the row before its first set point
        done = behind < len(move) or recording["phase"][-1] == DONE
        until = behind if done else len(move) + 2  # cut short: beyond what there is
        finish = begin + (span.behind - span.first) * dt
        yield span._replace(begin=begin, finish=finish, until=until * dt)


def _one(recording: Recording, k: int, span: Span, pitch: float, band: float) -> ProfileResult:
    """A profile's result; `pitch` in mm, `band` in counts."""
    dt = recording.dt
    # The set point of the profile's time 0 is the place where it stands: the next row is its first.
    a, b, c = (round(t / dt) for t in (span.begin, span.finish, span.until))
    a, b, c = a + 1, min(b + 1, len(recording)), min(c, len(recording))
    complete = round(span.until / dt) <= len(recording)
    coarse = span.stage == MACRO
    if coarse:
        reference = recording["macro_reference"][a:c] * pitch
        reading = recording["macro_position"][a:c] * pitch
        known = np.isfinite(reading)
        scale, late, width = 1e3, 0, band * pitch
    else:
        reference = recording["micro_reference"][a:c] * 1e3
        reading = recording["laser"][a:c] + zero.offset(recording, c)
        driven = recording["phase"][a:c] == FINE
        known = driven & (recording["laser_reset"][a:c] == 0) & np.isfinite(reading)
        late = int(np.argmax(driven)) if driven.any() else c - a
        scale, width = 1e6, MICRO_BAND
    error = np.where(known, reference - reading, np.nan)
    way = np.abs(error[: b - a])
    way = np.where(np.isnan(way), -1.0, way)
    worst = int(np.argmax(way)) if len(way) and way.max() >= 0.0 else None
    hold = error[b - a :]
    settled, final = None, None
    if complete and len(hold) > 1:
        row = entry(hold if coarse else smoothed(hold, round(SMOOTH / dt) | 1), width, dt, 0.0)
        settled = None if row is None else round(row * dt, 9)
        mean = float(np.mean(hold[-tail(len(hold), dt) :]))
        final = mean if math.isfinite(mean) else None
    return ProfileResult(
        profile=k,
        stage="macro" if coarse else "micro",
        unit="mm" if coarse else "um",
        origin=round(span.origin * scale, 6),
        target=round(span.target * scale, 6),
        start_s=round(max(span.begin, 0.0), 9),
        end_s=round(span.finish, 9),
        late_s=round(late * dt, 9),
        rms_error=None if worst is None else math.sqrt(float(np.nanmean(error[: b - a] ** 2))),
        peak_error=None if worst is None else float(way[worst]),
        peak_s=None if worst is None else round(float(recording["t"][a + worst]), 9),
        settled_s=settled,
        band=width,
        final_error=final,
        complete=complete,
    )
