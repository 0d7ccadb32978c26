"""How a shape-memory wire is driven while it is commissioned: warmed slowly, and by pulses."""

from __future__ import annotations

import math

import numpy as np

from macromicro.commission.procedure import Work
from macromicro.commission.stand import Caution, CommissionError, Law, Record, Stand
from macromicro.commission.wire_laws import (
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

WARMTH, RAMP, PULSES, CURVES = "warmth", "ramp", "pulses", "curves"
TURNS = (0.75, 0.5, 0.25)  # shares of the way at which first-order curves turn
_SEEN = 12.0  # noises that a motion must be
_STILL = 3.0  # s in which a wire that has cooled moves by no more than its noise
EFFORTS = (0.6, 1.0, 0.8, 0.45)  # of what lies above the effort that contracts it


def _wide(work: Work) -> Caution:
    """Without a window: a wire that is warm may be anywhere on its way."""
    caution = work.options.caution(work.options.speed)
    return caution._replace(low=-math.inf, high=math.inf)


def _driven(work: Work, law: Law, seconds: float) -> Record:
    """What a law does, all of it. Raises `CommissionError` where a limit was passed."""
    record = work.stand.drive(law, seconds, _wide(work))
    if record.ended:
        raise CommissionError(f"it passed {record.ended} at {record.x[-1] * 1e3:.4g} mm")
    return record


def cooled(
    stand: Stand, least: float, work: Work, start: float = math.nan, way: float = math.nan
) -> None:
    """Wait without effort until the wire moves no more.

    Hot, a wire stands, too: it stays contracted until its heat has fallen far enough. So it must
    have come back first, and stand for as long as that took.

    Parameters
    ----------
    stand : Stand
        The stage.
    least : float
        Motion that is seen for sure, m.
    work : Work
        Options.
    start : float, optional
        Where it was before it was warmed, m; NaN: it is extended already.
    way : float, optional
        How far it was contracted, m.

    Raises
    ------
    CommissionError
        It does not come to rest, or not back.
    """
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
            f"the wire is still contracted after {PATIENCE:.0f} s without effort: does its spring "
            "stretch it again?"
        )
    if len(record.t) * stand.dt >= PATIENCE:
        raise CommissionError(f"the wire is not at rest after {PATIENCE:.0f} s without effort")


def warmth_intent(work: Work) -> str:
    """What `warmth` will do.

    Parameters
    ----------
    work : Work
        Options.

    Returns
    -------
    str
        How far and how hard.
    """
    return (
        f"Effort rises slowly from 0 V, {work.options.effort / RISE:.2g} V/s up to "
        f"{work.options.effort:.3g} V at most, and is taken away as soon as the wire contracts by "
        f"{_SEEN:.0f} times the reading's noise."
    )


def warmth(work: Work) -> Warmth:
    """What begins to contract it, and which way that counts.

    Parameters
    ----------
    work : Work
        Options.

    Returns
    -------
    Warmth
        Sign, effort and noise.

    Raises
    ------
    CommissionError
        It does not move.
    """
    o, stand = work.options, work.stand
    caution = o.caution(o.speed)
    quiet = stand.drive(lambda t, x, v: 0.0, 0.5, caution)
    if quiet.ended:
        raise CommissionError("the sensor gives no value: look at its cable and supply")
    line = np.polynomial.Polynomial.fit(quiet.t, quiet.x, 1)
    noise = float(np.std(quiet.x - line(quiet.t)))
    least = _SEEN * max(noise, 0.3 * stand.pitch)
    law = Ramp(work, least, seen=True)
    record = stand.drive(law, 1.5 * RISE, caution)
    if not law.moved:
        raise CommissionError(
            f"nothing contracts at {o.effort:.3g} V: is the wire connected, is it stretched, or "
            "must --effort be larger?"
        )
    sign = math.copysign(1.0, float(record.x[-1]) - law.start)
    stand.facing *= sign
    cooled(stand, least, work, sign * law.start, abs(float(record.x[-1]) - law.start))
    return Warmth(sign, law.effort, noise)


def least_motion(work: Work) -> float:
    """Motion that is seen for sure.

    Parameters
    ----------
    work : Work
        With the first step done.

    Returns
    -------
    float
        m.
    """
    return float(_SEEN * max(work[WARMTH].noise, 0.3 * work.stand.pitch))


def ramp_intent(work: Work) -> str:
    """What `ramp` will do.

    Parameters
    ----------
    work : Work
        With the first step done.

    Returns
    -------
    str
        How far and how hard.
    """
    return (
        f"Effort rises slowly, {work.options.effort / RISE:.2g} V/s, until the wire contracts no "
        f"more, at {work.options.effort:.3g} V at most, where it stays for up to {HOLD:.0f} s "
        "while the wire still contracts, and falls as slowly to 0. It goes all its way, and back."
    )


def ramp(work: Work) -> list[Record]:
    """All its way and back, slowly.

    Parameters
    ----------
    work : Work
        With the first step done.

    Returns
    -------
    list[Record]
        One.

    Raises
    ------
    CommissionError
        It goes on contracting up to the largest effort.
    """
    stand, least = work.stand, least_motion(work)
    law = Ramp(work, least, seen=False)
    record = stand.drive(law, 3.0 * RISE, _wide(work))
    if not law.contracted:
        raise CommissionError(
            f"the wire goes on contracting up to {record.u.max():.3g} V: a larger --effort would "
            "show its whole way, or a window in --from and --to is too small for it"
        )
    cooled(stand, least, work, law.start, float(record.x.max()) - law.start)
    return [Record(record.t[:-1], record.u[:-1], record.x[:-1])]


def way_of(work: Work) -> float:
    """Full contraction, by the slow ramp.

    Parameters
    ----------
    work : Work
        With the ramp done.

    Returns
    -------
    float
        m.
    """
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
    """What `pulses` will do.

    Parameters
    ----------
    work : Work
        With the ramp done.

    Returns
    -------
    str
        How far and how hard.
    """
    efforts, hold = _pulse_efforts(work)
    return (
        f"{len(efforts)} pulses of {min(efforts):.3g} to {max(efforts):.3g} V, each until the wire "
        f"is contracted by {way_of(work) * 1e3:.3g} mm; there it is held with {hold:.3g} V for a "
        "while, and cools."
    )


def pulses(work: Work) -> list[Record]:
    """Heating and cooling over all its way.

    Parameters
    ----------
    work : Work
        With the ramp done.

    Returns
    -------
    list[Record]
        One.

    Raises
    ------
    CommissionError
        A limit was passed.
    """
    efforts, hold = _pulse_efforts(work)
    slow = work[RAMP][0]
    longest = LONG * float(slow.t[int(np.argmax(slow.u))])
    law = Pulses(efforts, hold, way_of(work), longest)
    record = _driven(work, law, len(efforts) * (longest + 2.0 * PATIENCE))
    return [Record(record.t[:-1], record.u[:-1], record.x[:-1])]


def curves_intent(work: Work) -> str:
    """What `curves` will do.

    Parameters
    ----------
    work : Work
        With the ramp done.

    Returns
    -------
    str
        How far and how hard.
    """
    o, way = work.options, way_of(work) * 1e3
    places = ", ".join(f"{share * way:.3g}" for share in TURNS)
    return (
        f"Effort rises and falls slowly, {o.effort / RISE:.2g} V/s and {o.effort:.3g} V at most: "
        f"the wire contracts, extends to {places} mm and contracts again each time, and cools."
    )


def curves(work: Work) -> list[Record]:
    """First-order reversal curves, from contracted.

    Parameters
    ----------
    work : Work
        With the ramp done.

    Returns
    -------
    list[Record]
        One, from a wire that is cold.

    Raises
    ------
    CommissionError
        A limit was passed.
    """
    stand, o = work.stand, work.options
    law = Turns(TURNS, way_of(work), o.effort, o.effort / RISE, stand.dt)
    record = _driven(work, law, 2.0 * (len(TURNS) + 1) * RISE)
    way = float(record.x.max()) - law.start
    cooled(stand, least_motion(work), work, law.start, way)
    return [Record(record.t[:-1], record.u[:-1], record.x[:-1] - law.start)]
