"""The laser as a second witness of the carriage's position, beside the encoder.

Carriage path = laser + base - contraction (Hall); `base` absorbs the laser's resets. Whole
position = laser + base - phase of the edges (`edges`). The path is a mean over each period,
because the slack wire bounces and the Hall sensor lags. Without a laser reading it restarts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.control.live import edges
from macromicro.control.live.edges import Phase
from macromicro.control.live.parameters import Edges
from macromicro.kernel import kernel
from macromicro.types import Sample

NAN = math.nan
_PENDING = 200.0  # periods within which a reset must show
_SMALL = 5e-6  # m: a reset of no more looks like noise, nor does it have to be
_STUCK = 3  # periods with the same reading of the laser while counts pass
_HALL_STUCK = 20  # the same of the Hall sensor, whatever passes: its noise forbids it
_LEAP, _LEAP_AT_REST = 5.0, 1.5  # counts in a period that no carriage goes unseen
_RESTED = 0.1  # s
_FARTHEST = 1e3  # m; a reading beyond it, or NaN, is missing
_SETTLED = 2.0  # s: until then the belt rocks the stage after a fast way (Section 6.2)


class Survey(NamedTuple):
    """What the laser shows beside the encoder; NaN: unknown."""

    phase: Phase | None = None  # phase of the edges
    laser: float = NAN  # last reading, m
    base: float = 0.0  # sum of the machine's own laser resets, m
    awaited: float = 0.0  # periods left for a reset to show
    same: float = 0.0  # periods with the same reading of the laser
    held: float = NAN  # the count when it was new
    counts: float = NAN  # encoder in the sample before, raw counts; NaN where it was not complete
    whole: float = NAN  # laser + base in the sample before, m
    fine: float = NAN  # contraction in the sample before, m
    path: float = NAN  # path of the carriage, mean of the period before, m
    pace: float = NAN  # its last step, m
    hall: float = NAN  # last reading, V
    hall_same: float = 0.0  # periods with the same reading of the Hall sensor
    slow: float = 0.0  # time since the carriage was last fast, s
    edge: float = NAN  # the last one taken
    # phase by which counts are judged where edges contradicted it, m; NaN while they agree
    anchor: float = NAN
    gap: float = 0.0  # counts that the encoder is behind the laser
    apart: float = 0.0  # for how long by too many, s
    half: float = math.inf  # half width of the position by laser, m; infinite without one


NOTHING = Survey()


def reset_given(v: Survey) -> Survey:
    """The survey when the machine resets the laser with this period's outputs."""
    if v.phase is None:
        return v
    if abs(v.laser) <= _SMALL:
        return v._replace(base=v.base + v.laser)
    return v._replace(awaited=_PENDING)


class Moving(NamedTuple):
    fine: float  # contraction, m
    speed: float  # speed of the carriage, counts/s
    standing: float  # for how long it has stood, s
    offset: float  # count of coordinate 0, raw counts


def look(q: Edges, pitch: float, v: Survey, sample: Sample, moving: Moving, dt: float) -> Survey:
    if v.phase is None:
        v = v._replace(phase=edges.unknown())
    v = followed(q, pitch, v, sample, moving, dt)
    return v if edges.known(_phase(v)) else v._replace(phase=None)


@kernel
def _phase(v: Survey) -> Phase:
    """The phase within kernels, unknown instead of None."""
    return v.phase  # type: ignore[return-value]


@kernel
def _anew(laser: float, same: float, held: float) -> Survey:
    """Restart, keeping how long the laser has repeated its value."""
    return Survey(
        edges.unknown(), laser, 0.0, 0.0, same, held, NAN, NAN, NAN,
        NAN, NAN, NAN, 0.0, 0.0, NAN, NAN, 0.0, 0.0, math.inf,
    )  # fmt: skip


@kernel
def followed(
    q: Edges, pitch: float, v: Survey, sample: Sample, moving: Moving, dt: float
) -> Survey:
    """`look` for kernels, with `edges.unknown` for None."""
    count = sample.encoder
    if q.use != 1 or not abs(sample.laser) < _FARTHEST:
        return _anew(NAN, 0.0, NAN)
    now = _beam(q, v, sample)
    phase = _phase(now)
    if now.same >= _STUCK and (not edges.known(_phase(v)) or count != now.held):
        return _anew(now.laser, now.same, now.held)
    if v.awaited == 1 and now.base == v.base:  # the reset never came, or is too small to see
        return _anew(now.laser, 0.0, count)
    if math.isnan(count) or math.isnan(sample.hall) or now.hall_same >= _HALL_STUCK:
        return Survey(
            phase, now.laser, now.base, now.awaited, now.same, now.held, NAN, now.whole, now.fine,
            NAN, now.pace, now.hall, now.hall_same, now.slow, now.edge, now.anchor, now.gap,
            0.0, now.half,
        )  # fmt: skip
    slow = v.slow + dt if abs(moving.speed) <= q.fastest else 0.0
    whole = now.laser + now.base
    path = _path(q, v, whole, moving.fine, dt)
    place = path - 0.5 * (count + v.counts) * pitch
    lost = not edges.known(phase) or math.isnan(place)
    if not edges.known(phase) and slow > 0.0 and not math.isnan(place):
        phase = edges.begin(count, place, pitch, q.scale)
    now = Survey(
        phase, now.laser, now.base, now.awaited, now.same, now.held, count, whole, moving.fine,
        NAN if lost else path, now.pace, now.hall, now.hall_same, slow, now.edge, now.anchor,
        now.gap, now.apart, now.half,
    )  # fmt: skip
    return now if lost else _judged(q, pitch, v, now, place, moving, dt)


@kernel
def _beam(q: Edges, v: Survey, sample: Sample) -> Survey:
    """The laser through a reset; how long laser and Hall sensor have repeated their values."""
    laser, hall = sample.laser, sample.hall
    phase, base, awaited = _phase(v), v.base, v.awaited
    if awaited > 0:  # the phase is known then: `reset_given`
        awaited -= 1.0
        if abs(laser) < abs(laser - v.laser):
            base, awaited = base + v.laser, 0.0
            phase = edges.blurred(phase, q.reset * q.reset)
    same, held = 0.0, sample.encoder
    if laser == v.laser:
        same, held = v.same + 1.0, v.held
    hall_same = v.hall_same + 1.0 if hall == v.hall else 0.0
    return Survey(
        phase, laser, base, awaited, same, held, v.counts, v.whole, v.fine, v.path, v.pace,
        hall, hall_same, v.slow, v.edge, v.anchor, v.gap, v.apart, v.half,
    )  # fmt: skip


@kernel
def _path(q: Edges, v: Survey, whole: float, fine: float, dt: float) -> float:
    """Mean carriage path of the period [m]: laser less contraction, without the Hall's lag."""
    # A lag's output goes from f0 to f1 = keep f0 + (1 - keep) c while its input is c, which this
    # solves for c: the contraction now, of which the sensor will know `q.lag` later.
    keep = math.exp(-dt / q.lag) if q.lag > 0.0 else 0.0
    contraction = (fine - keep * v.fine) / (1.0 - keep)
    return 0.5 * (whole + v.whole) - contraction


@kernel
def _judged(
    q: Edges, pitch: float, v: Survey, now: Survey, place: float, moving: Moving, dt: float
) -> Survey:
    """Process a crossed edge, and the distance between laser and encoder at `place` [m]."""
    phase, count, anchor = _phase(now), now.counts, v.anchor
    gap = (place - (edges.at(phase, count) if math.isnan(anchor) else anchor)) / pitch
    pace = now.path - v.path
    leap = _LEAP_AT_REST if moving.standing >= _RESTED else _LEAP
    if abs(gap - v.gap) > leap and abs(pace - v.pace) > leap * pitch:
        return _anew(now.laser, 0.0, count)
    phase = edges.blurred(phase, q.drift * q.drift * dt)
    edge = max(count, v.counts)
    unsure = now.awaited > 0 or not math.isnan(anchor)
    if abs(count - v.counts) != 1.0 or edge == v.edge or now.slow == 0.0 or unsure:
        edge = v.edge  # none, or one that flickers: it shows no more than it did once
    else:
        rocking = 0.0 if now.slow >= _SETTLED else q.rocking
        # The edge was crossed at some instant of the period, any as likely: a uniform spread over
        # the way of the period has the variance width^2 / 12.
        width = moving.speed * pitch * dt
        noise = width * width / 12.0 + q.noise * q.noise + rocking * rocking
        phase = edges.taken(phase, edge, now.path - (edge - 0.5) * pitch, noise)
        if not edges.sure(phase):
            anchor = edges.at(phase, count)
    far = abs(gap) > q.lost + q.skew * abs(moving.speed)
    apart = v.apart + dt if far and now.awaited == 0 else 0.0
    half = _half(q, phase, anchor, moving.offset)
    return Survey(
        phase, now.laser, now.base, now.awaited, now.same, now.held, count, now.whole, now.fine,
        now.path, pace, now.hall, now.hall_same, now.slow, edge, anchor, gap, apart, half,
    )  # fmt: skip


@kernel
def _half(q: Edges, phase: Phase, anchor: float, offset: float) -> float:
    """Half width [m] of the position by laser; infinite while it is unreliable."""
    if phase.number < q.needed or not math.isnan(anchor):
        return math.inf
    return q.laser + q.hall + q.factor * edges.error(phase, offset)


def contradiction(v: Survey, position: float, pitch: float, offset: float) -> float:
    """Half width about a position (`offset` in raw counts) that includes the laser's."""
    if v.phase is None or v.awaited or math.isnan(v.counts):
        return 0.0
    off = abs(whole(v, pitch, offset) - position)
    slack = min(3.0 * edges.error(v.phase, offset), 0.5 * pitch)
    return off + pitch if off > 0.5 * pitch + slack else 0.0


def rebase(q: Edges, v: Survey, offset: float) -> Survey:
    """The survey after the count of coordinate 0 has changed (`offset` in raw counts)."""
    return v if v.phase is None else v._replace(half=_half(q, v.phase, v.anchor, offset))


def whole(v: Survey, pitch: float, offset: float) -> float:
    """Position of the whole positioner by the laser (`offset` in raw counts)."""
    if v.phase is None:
        return NAN
    return v.laser + v.base - edges.at(v.phase, offset) - offset * pitch


def again(v: Survey, pitch: float) -> Survey:
    """The survey when homing begins; the pitch error stays known unless it was contradicted."""
    if v.phase is None or not math.isnan(v.anchor) or v.apart > 0.0:
        return NOTHING
    return v._replace(phase=edges.blurred(v.phase, pitch * pitch))
