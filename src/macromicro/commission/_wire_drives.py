"""Drive signals for commissioning a wire: slow warming, and pulses."""

from __future__ import annotations

import math

import numpy as np

from macromicro.commission._wire_laws import (
    EXTENDED,
    HOLD,
    LONG,
    PATIENCE,
    RISE,
    Pulses,
    Ramp,
    Turns,
    Warmth,
)
from macromicro.commission.procedure import Work
from macromicro.commission.stand import Caution, CommissionError, Law, Record, Stand

WARMTH, RAMP, PULSES, CURVES = "warmth", "ramp", "pulses", "curves"
TURNS = (0.75, 0.5, 0.25)  # shares of the way at which first-order curves turn
_SEEN = 12.0  # noises that a motion must be
_STILL = 3.0  # s in which a wire that has cooled moves by no more than its noise
EFFORTS = (0.6, 1.0, 0.8, 0.45)  # of what lies above the effort that contracts it


def _wide(work: Work) -> Caution:
    """Without a window: a warm wire may be anywhere in its travel."""
    caution = work.options.caution(work.options.speed)
    return caution._replace(low=-math.inf, high=math.inf)


def _driven(work: Work, law: Law, seconds: float) -> Record:
    """A law's complete record; `CommissionError` at a limit."""
    record = work.stand.drive(law, seconds, _wide(work))
    if record.ended:
        raise CommissionError(f"the wire passed {record.ended} at {record.x[-1] * 1e3:.4g} mm")
    return record


def cooled(
    stand: Stand, least: float, work: Work, start: float = math.nan, way: float = math.nan
) -> None:
    """Wait without effort until the wire stops moving."""
    # A hot wire also stands, contracted until it has cooled enough; so it must first return, and
    # then stand for as long as that took.
    at, since, came = math.nan, 0.0, 0.0
    back = math.isnan(start)

    def idle(t: float, x: float, v: float) -> float | None:
        nonlocal at, since, back, came
        if not back and x - start <= max(EXTENDED * way, 0.5 * least):
            back, came = True, t
        if not abs(x - at) < least:
            at, since = x, t
        return None if back and t - since >= _STILL and t >= 2.0 * came else 0.0

    record = stand.drive(idle, PATIENCE, _wide(work))
    if not back:
        raise CommissionError(
            f"the wire is still contracted after {PATIENCE:.0f} s without effort. Check that "
            "its spring stretches it again"
        )
    if len(record.t) * stand.dt >= PATIENCE:
        raise CommissionError(f"the wire is not at rest after {PATIENCE:.0f} s without effort")


def warmth_intent(work: Work) -> str:
    return (
        f"The effort rises slowly from 0 V, {work.options.effort / RISE:.2g} V/s up to "
        f"{work.options.effort:.3g} V at most, and is removed as soon as the wire contracts "
        f"by {_SEEN:.0f} times the reading's noise."
    )


def warmth(work: Work) -> Warmth:
    """Effort at first contraction, and its direction."""
    o, stand = work.options, work.stand
    caution = o.caution(o.speed)
    quiet = stand.drive(lambda t, x, v: 0.0, 0.5, caution)
    if quiet.ended:
        raise CommissionError("the sensor gives no value. Check its cable and supply")
    line = np.polynomial.Polynomial.fit(quiet.t, quiet.x, 1)
    noise = float(np.std(quiet.x - line(quiet.t)))
    least = _SEEN * max(noise, 0.3 * stand.pitch)
    law = Ramp(work, least, seen=True)
    record = stand.drive(law, 1.5 * RISE, caution)
    if not law.moved:
        raise CommissionError(
            f"nothing contracts at {o.effort:.3g} V. Check that the wire is connected and "
            "stretched, or allow a larger --effort"
        )
    sign = math.copysign(1.0, float(record.x[-1]) - law.start)
    stand.facing *= sign
    cooled(stand, least, work, sign * law.start, abs(float(record.x[-1]) - law.start))
    return Warmth(sign, law.effort, noise)


def least_motion(work: Work) -> float:
    """Motion that is safely detected."""
    return float(_SEEN * max(work[WARMTH].noise, 0.3 * work.stand.pitch))


def ramp_intent(work: Work) -> str:
    return (
        f"The effort rises slowly, {work.options.effort / RISE:.2g} V/s, until the wire stops "
        f"contracting, to {work.options.effort:.3g} V at most, where it stays for up to "
        f"{HOLD:.0f} s while the wire still contracts, and falls as slowly to 0. The wire "
        "makes its full travel and back."
    )


def ramp(work: Work) -> list[Record]:
    stand, least = work.stand, least_motion(work)
    law = Ramp(work, least, seen=False)
    record = stand.drive(law, 3.0 * RISE, _wide(work))
    if not law.contracted:
        raise CommissionError(
            f"the wire goes on contracting up to {record.u.max():.3g} V. Allow a larger "
            "--effort to show its full travel, or a wider window, --from and --to"
        )
    cooled(stand, least, work, law.start, float(record.x.max()) - law.start)
    return [Record(record.t[:-1], record.u[:-1], record.x[:-1])]


def way_of(work: Work) -> float:
    """Full contraction, by the slow ramp."""
    record = work[RAMP][0]
    n = max(round(0.2 / work.stand.dt), 1)
    top = len(record.u) - 1 - int(np.argmax(record.u[::-1]))  # the last at the largest effort
    return float(record.x[max(top - n, 0) : top].mean() - record.x[:n].mean())


def _pulse_efforts(work: Work) -> tuple[list[float], float]:
    """Efforts of the pulses, and the one that holds."""
    record, most = work[RAMP][0], work.options.effort
    half = record.x[0] + 0.5 * way_of(work)
    hold = float(record.u[int(np.argmax(record.x >= half))])
    return [hold + part * (most - hold) for part in EFFORTS], min(1.1 * hold, most)


def pulses_intent(work: Work) -> str:
    efforts, hold = _pulse_efforts(work)
    return (
        f"{len(efforts)} pulses of {min(efforts):.3g} to {max(efforts):.3g} V, each until the "
        f"wire is contracted by {way_of(work) * 1e3:.3g} mm, where {hold:.3g} V hold it for a "
        "while; then it cools."
    )


def pulses(work: Work) -> list[Record]:
    efforts, hold = _pulse_efforts(work)
    slow = work[RAMP][0]
    longest = LONG * float(slow.t[int(np.argmax(slow.u))])
    law = Pulses(efforts, hold, way_of(work), longest)
    record = _driven(work, law, len(efforts) * (longest + 2.0 * PATIENCE))
    return [Record(record.t[:-1], record.u[:-1], record.x[:-1])]


def curves_intent(work: Work) -> str:
    o, way = work.options, way_of(work) * 1e3
    places = ", ".join(f"{share * way:.3g}" for share in TURNS)
    return (
        f"The effort rises and falls slowly, {o.effort / RISE:.2g} V/s and {o.effort:.3g} V "
        f"at most: the wire contracts, extends to {places} mm and contracts again each time, "
        "and cools."
    )


def curves(work: Work) -> list[Record]:
    stand, o = work.stand, work.options
    law = Turns(TURNS, way_of(work), o.effort, o.effort / RISE, stand.dt)
    record = _driven(work, law, 2.0 * (len(TURNS) + 1) * RISE)
    way = float(record.x.max()) - law.start
    cooled(stand, least_motion(work), work, law.start, way)
    return [Record(record.t[:-1], record.u[:-1], record.x[:-1] - law.start)]
