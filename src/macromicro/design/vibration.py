"""Residual vibration of the stage after a macro move (Section 6.2, Figure 6.3).

A decaying sine is fitted to what the laser shows once the carriage stands still,

    y(t) = c0 + c1 t + e^(-d t) (a cos w t + b sin w t),

so that the laser's 2 um of noise, as large as the last of the vibration, averages out.
The Hall reading is subtracted first: a micro-stage that still extends moves the laser too.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.control.supervisor import MICRO, WAITING
from macromicro.design.response import MoveResult
from macromicro.recording import Recording

DECAYED = 2.0
CREEP = 0.05
SHORTEST = 0.3
SLOWEST, FASTEST = 3.0, 450.0


class Vibration(NamedTuple):
    """Residual vibration after a macro move."""

    move: int  #: index of the move
    rest_s: float  #: when the carriage stands still, by its encoder, s
    amplitude_um: float  #: first peak from then on, um
    decay_s: float | None  #: time from rest until the envelope is down to 2 um (0: never above), s
    frequency_hz: float  #: frequency of the fitted sine, Hz
    decay_rate: float  #: decay rate of the fitted sine, 1/s
    settled_um: float  #: the laser's settled value, um


def vibration(recording: Recording, move: MoveResult) -> Vibration | None:
    """Residual vibration after a macro move (Section 6.2, Figure 6.3).

    Parameters
    ----------
    recording : Recording
        Recording of a run.
    move : MoveResult
        One of its moves.

    Returns
    -------
    Vibration | None
        None without a vibration, an arrival or a laser; or if less than 0.3 s at rest was
        recorded before the laser's reset or the next move.
    """
    if move.stage != "macro" or move.arrived_s is None:
        return None
    dt = recording.dt
    a, b = (int(np.searchsorted(recording["move"], k)) for k in (move.move, move.move + 1))
    rows = slice(a, b)
    phase = recording["phase"][rows]
    over = (recording["laser_reset"][rows] == 1) | (phase == MICRO) | (phase == WAITING)
    length = int(np.argmax(over)) if over.any() else b - a
    encoder = recording["macro_position"][a : a + length]
    changes = np.flatnonzero(np.diff(encoder))
    # After its last count the carriage still creeps, for less than CREEP.
    rest = (int(changes[-1]) + 1 if len(changes) else 0) + round(CREEP / dt)
    if (length - rest) * dt < SHORTEST:
        return None
    window = slice(a + rest, a + length)
    y = recording["laser"][window] - 1e3 * recording["hall_position"][window]
    if not np.isfinite(y).all():
        return None
    fit = decaying_sine(y, dt)
    if fit is None:
        return None
    frequency, decay, cosine, sine = fit
    start = math.hypot(cosine, sine)
    # First extremum of the fitted sine: where its derivative crosses zero.
    w = 2.0 * math.pi * frequency
    phase_at = math.atan2(sine * w - decay * cosine, cosine * w + decay * sine)
    first = (phase_at % math.pi) / w
    peak = math.exp(-decay * first) * abs(cosine * math.cos(w * first) + sine * math.sin(w * first))
    settled = slice(a + length - (length - rest) // 4, a + length)
    time: float | None = None
    if start <= DECAYED:
        time = 0.0
    elif decay > 0.0:
        time = math.log(start / DECAYED) / decay + CREEP
    return Vibration(
        move=move.move,
        rest_s=round(float(recording["t"][a + rest]) - CREEP, 9),
        amplitude_um=peak,
        decay_s=time,
        frequency_hz=frequency,
        decay_rate=decay,
        settled_um=float(recording["laser"][settled].mean()),
    )


def decaying_sine(y: Array, dt: float) -> tuple[float, float, float, float] | None:
    """The decaying sine in a record.

    Gauss-Newton on frequency and decay; the linear part is solved at each step (variable
    projection).

    Parameters
    ----------
    y : ndarray, shape (n,)
        The record.
    dt : float
        Sample time, s.

    Returns
    -------
    tuple[float, float, float, float] | None
        Frequency (Hz), decay rate (1/s), cosine and sine amplitude (unit of `y`); None if no
        frequency stands out of the noise.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.design.vibration import decaying_sine
    >>> t = 0.001 * np.arange(1000)
    >>> y = 3.0 * np.exp(-4.0 * t) * np.cos(2.0 * np.pi * 20.0 * t)
    >>> frequency, decay, cosine, sine = decaying_sine(y, dt=0.001)
    >>> round(frequency, 3), round(decay, 3), round(cosine, 3)  # Hz, 1/s, unit of y
    (20.0, 4.0, 3.0)
    """
    t = np.arange(len(y)) * dt
    trend = np.polynomial.polynomial.polyfit(t, y, 2)
    flat = y - np.polynomial.polynomial.polyval(t, trend)
    spectrum = np.abs(np.fft.rfft(flat * np.hanning(len(y)), 4 * len(y)))
    bins = np.fft.rfftfreq(4 * len(y), dt)
    allowed = (bins >= SLOWEST) & (bins <= min(FASTEST, 0.45 / dt))
    peak = int(np.argmax(np.where(allowed, spectrum, 0.0)))
    if not spectrum[peak] > 6.0 * np.median(spectrum[allowed]):
        return None
    w, d = 2.0 * math.pi * float(bins[peak]), 1.0
    c, s = 0.0, 0.0
    for _ in range(30):
        shape = np.exp(-d * t)
        cosine, sine = shape * np.cos(w * t), shape * np.sin(w * t)
        basis = np.stack((np.ones_like(t), t, cosine, sine), axis=1)
        linear = np.linalg.lstsq(basis, y, rcond=None)[0]
        c, s = float(linear[2]), float(linear[3])
        rest = y - basis @ linear
        slopes = np.stack((t * (s * cosine - c * sine), -t * (c * cosine + s * sine)), axis=1)
        slopes -= basis @ np.linalg.lstsq(basis, slopes, rcond=None)[0]
        step = np.linalg.lstsq(slopes, rest, rcond=None)[0]
        w, d = w + float(step[0]), min(max(d + float(step[1]), -1.0), 1.0 / dt)
        if abs(step[0]) < 1e-9 * w and abs(step[1]) < 1e-7:
            break
    frequency = w / (2.0 * math.pi)
    return (frequency, d, c, s) if SLOWEST <= frequency <= FASTEST else None
