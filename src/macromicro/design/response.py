"""Arrival, settling, error and overshoot of each move of a programme.

Macro errors come from the encoder, micro errors from the laser, which is independent of
the loop: integral action makes the Hall sensor's own error zero by construction
(Section 6.1). Laser readings carry 2 um of noise (Section 6.4.1), so entry into a band and
overshoot use their centred mean over `SMOOTH`. On a rig without a laser the Hall sensor
detects the arrival of a micro move; its final error is unknown.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro import nominal
from macromicro.arrays import Array
from macromicro.control.supervisor import DONE, SETTLING
from macromicro.control.supervisor import MACRO as MOVING
from macromicro.design import zero
from macromicro.programme import MACRO, Programme
from macromicro.recording import Recording

PITCH = nominal.PITCH
MACRO_BAND = 2.0
MICRO_BAND = 10.0
MEAN = 0.5
DWELL = 0.2
SMOOTH = 0.021


class MoveResult(NamedTuple):
    """One move; None: did not happen, or cannot be known."""

    move: int  #: index in the programme, from 0
    stage: str  #: "macro" or "micro"
    target: float  #: in `unit`
    unit: str  #: mm for macro, um for micro; of target, band, errors and overshoot
    start_s: float  #: when it began, s
    arrived_s: float | None  #: when the error entered `band` for good, s
    settling_s: float | None  #: from `start_s` until then, s
    band: float  #: in `unit`
    #: target less the mean reading (encoder or laser) over the hold's last 0.5 s
    final_error: float | None
    #: the furthest beyond the target in the direction of the move, 0 or more
    overshoot: float | None
    hall_error: float | None  #: as `final_error`, from the Hall sensor
    true_error: float | None  #: as `final_error`, from the bench's truth
    target_counts: float | None  #: target of a macro move, counts
    final_error_counts: float | None  #: final error of a macro move, counts
    complete: bool  #: False if a fault or an interruption cut the move short


class _Span(NamedTuple):
    """A move's rows in a recording, [a, b), and the last row + 1 of its influence, `until`."""

    move: int
    a: int
    b: int
    until: int
    complete: bool


def moves(
    recording: Recording,
    programme: Programme,
    *,
    pitch: float = PITCH,
    macro_band: float = MACRO_BAND,
    but: Sequence[int] = (),
) -> list[MoveResult]:
    """One result for each move that was begun.

    A macro move is judged until the next macro move begins.

    Parameters
    ----------
    recording : Recording
        Recording of a run.
    programme : Programme
        Its moves.
    pitch : float, optional
        Travel of an encoder count, m.
    macro_band : float, optional
        Error within which the macro-stage has arrived, counts.
    but : Sequence[int], optional
        Stages to leave out, as they follow a trajectory (`tracking`). Set points of profiles
        beside moves are left out, too (`macromicro.design.profiles`).

    Returns
    -------
    list[MoveResult]
        In the order of the programme.
    """
    if not len(recording):
        return []
    by_laser = "laser" in recording and bool(np.isfinite(recording["laser"]).any())
    done, single = [], programme.moves if programme.mixed else np.ones(len(programme.stage), bool)
    for span in _spans(recording, programme):
        if programme.stage[span.move] in but or not single[span.move]:
            continue
        if programme.stage[span.move] == MACRO:
            done.append(_macro(recording, programme, span, pitch, macro_band))
        else:
            done.append(_micro(recording, programme, span, by_laser=by_laser))
    return done


def _spans(recording: Recording, programme: Programme) -> Iterator[_Span]:
    """The rows of each move. Without its last row in the phase DONE the run was cut short."""
    index, phase = recording["move"], recording["phase"]
    begun = int(index[-1]) + 1
    edges = np.searchsorted(index, np.arange(begun + 1))
    finished = bool(phase[-1] == DONE)
    until = len(recording)
    spans = []
    for k in reversed(range(begun)):
        a, b = int(edges[k]), int(edges[k + 1])
        # A scheduled fine move may be overtaken while the carriage still moves or settles.
        overtaken = programme.stage[k] != MACRO and phase[a] in (MOVING, SETTLING)
        if b > a and not overtaken:
            spans.append(_Span(k, a, b, until, finished or k < begun - 1))
            if programme.stage[k] == MACRO:
                until = a
    return reversed(spans)


def entry(error: Array, band: float, dt: float, dwell: float) -> int | None:
    """First row from which an error stays within a band to the end. A NaN counts as outside.

    Parameters
    ----------
    error : ndarray, shape (n,)
        Error by row.
    band : float
        Unit of `error`.
    dt : float
        Sample time, s.
    dwell : float
        Minimum duration, s.

    Returns
    -------
    int | None
        None if there is none.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.design.response import entry
    >>> entry(np.array([9.0, 3.0, -6.0, 2.0, 1.0, 0.0]), band=5.0, dt=0.001, dwell=0.002)
    3
    """
    outside = np.flatnonzero(~(np.abs(error) <= band))
    row = int(outside[-1]) + 1 if len(outside) else 0
    return row if row < len(error) and (len(error) - row) * dt >= dwell - 1e-9 else None


def tail(rows: int, dt: float) -> int:
    """Rows of the hold's last 0.5 s, or of its latter half where it is shorter than 1 s.

    Parameters
    ----------
    rows : int
        Number of rows of the hold.
    dt : float
        Sample time, s.

    Returns
    -------
    int
        At least 1.

    Examples
    --------
    >>> from macromicro.design.response import tail
    >>> tail(2000, dt=0.001), tail(600, dt=0.001)
    (500, 300)
    """
    return max(1, min(round(MEAN / dt), rows // 2))


def smoothed(y: Array, width: int) -> Array:
    """Centred mean; the window shrinks evenly towards the ends.

    Parameters
    ----------
    y : ndarray, shape (n,)
        Values.
    width : int
        Width of the window, rows, odd.

    Returns
    -------
    ndarray, shape (n,)
        Means.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.design.response import smoothed
    >>> smoothed(np.array([0.0, 3.0, 0.0, 3.0, 0.0]), width=3).tolist()
    [0.0, 1.0, 2.0, 1.0, 0.0]
    """
    n = len(y)
    sums = np.concatenate(([0.0], np.cumsum(y)))
    at = np.arange(n)
    half = np.minimum(np.minimum(at, n - 1 - at), width // 2)
    mean: Array = (sums[at + half + 1] - sums[at - half]) / (2 * half + 1)
    return mean


def _number(value: Any) -> float | None:
    """A plain float; None for NaN and infinity."""
    return float(value) if math.isfinite(value) else None


def _beyond(error: Array) -> float | None:
    """Overshoot: the error of opposite sign."""
    known = error[np.isfinite(error)]
    if not len(known):
        return None
    return max(0.0, float(-(known * np.sign(known[0])).min()))


def _time(recording: Recording, row: int) -> float:
    return round(float(recording["t"][row]), 9)


def _mean_error(recording: Recording, name: str, target: float, rows: slice) -> float | None:
    """Target minus the mean of a column; None where the rig lacks it."""
    return _number(target - recording[name][rows].mean()) if name in recording else None


def _macro(
    recording: Recording, programme: Programme, span: _Span, pitch: float, band: float
) -> MoveResult:
    """A macro move, in mm.

    The encoder's count n covers n to n + 1 pitches; the true error is counted from the middle.
    """
    target, dt, mm = float(programme.target[span.move]), recording.dt, pitch * 1e3
    error = target - recording["macro_position"][span.a : span.until]
    row = entry(error, band, dt, DWELL)
    start = _time(recording, span.a)
    arrived = None if row is None else _time(recording, span.a + row)
    final, true = None, None
    if span.complete:
        last = slice(span.until - tail(len(error), dt), span.until)
        final = _mean_error(recording, "macro_position", target, last)
        true = _mean_error(recording, "true_carriage", (target + 0.5) * mm, last)
    beyond = _beyond(error)
    return MoveResult(
        move=span.move,
        stage="macro",
        target=round(target * mm, 9),
        unit="mm",
        start_s=start,
        arrived_s=arrived,
        settling_s=None if arrived is None else round(arrived - start, 9),
        band=band * mm,
        final_error=None if final is None else final * mm,
        overshoot=None if beyond is None else beyond * mm,
        hall_error=None,
        true_error=true,
        target_counts=target,
        final_error_counts=final,
        complete=span.complete,
    )


def _micro(
    recording: Recording, programme: Programme, span: _Span, *, by_laser: bool
) -> MoveResult:
    """A micro move, in um, by the laser or else by the Hall sensor."""
    target, dt = round(float(programme.target[span.move]) * 1e6, 6), recording.dt
    rows = slice(span.a, span.b)
    # The reading at a reset still counts from the reset before.
    resets = np.flatnonzero(recording["laser_reset"][rows]) if by_laser else np.zeros(0)
    first = int(resets[-1]) + 1 if len(resets) else 0
    missing = zero.offset(recording, span.b) if by_laser else 0.0
    reading = recording["laser"] if by_laser else 1e3 * recording["hall_position"]
    error = target - missing - reading[span.a + first : span.b]
    start = _time(recording, span.a)
    row, beyond = None, None
    if len(error):
        error = smoothed(error, round(SMOOTH / dt) | 1)
        row = entry(error, MICRO_BAND, dt, 0.0 if span.complete else DWELL)
        beyond = _beyond(error)
    arrived = None if row is None else _time(recording, span.a + first + row)
    final, hall, true = None, None, None
    if span.complete:
        last = slice(span.b - tail(span.b - span.a, dt), span.b)
        final = _mean_error(recording, "laser", target - missing, last)
        hall = _mean_error(recording, "hall_position", target * 1e-3, last)
        true = _mean_error(recording, "true_micro", target * 1e-3, last)
    return MoveResult(
        move=span.move,
        stage="micro",
        target=target,
        unit="um",
        start_s=start,
        arrived_s=arrived,
        settling_s=None if arrived is None else round(arrived - start, 9),
        band=MICRO_BAND,
        final_error=final,
        overshoot=beyond,
        hall_error=None if hall is None else hall * 1e3,
        true_error=None if true is None else true * 1e3,
        target_counts=None,
        final_error_counts=None,
        complete=span.complete,
    )
