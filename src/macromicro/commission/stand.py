"""An axis on the stand: efforts in, positions out, ended at once where a limit is passed."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import MacromicroError
from macromicro.place import LENGTH, Place
from macromicro.rig.session import Session
from macromicro.types import SAFE

WINDOW, SPEED, SENSOR = "the window", "the greatest speed", "the encoder"
_CALM = 0.1  # s without a change of count: the axis stands
_ESTIMATE = 5  # periods over which speed is taken

# From the time since the start [s], position [m] and speed [m/s] to an effort [V], or None: ended.
Law = Callable[[float, float, float], float | None]


class CommissionError(MacromicroError):
    """The stage does not do what the step needs; says what was seen and what to try."""


class Caution(NamedTuple):
    """What the axis may not pass while it is commissioned.

    Attributes
    ----------
    effort : float
        Largest effort, V.
    speed : float
        Greatest speed, m/s.
    low, high : float
        The window, m from where commissioning began.
    lowest : float
        Lowest effort, V; none is below -`effort`.
    """

    effort: float
    speed: float
    low: float = -math.inf
    high: float = math.inf
    lowest: float = -math.inf


class Record(NamedTuple):
    """What a drive showed.

    Attributes
    ----------
    t : ndarray, shape (n,)
        s.
    u : ndarray, shape (n,)
        Efforts as they were given, V.
    x : ndarray, shape (n,)
        Positions, m.
    ended : str
        Which limit ended it; "" for none.
    """

    t: Array
    u: Array
    x: Array
    ended: str = ""


class Pull(NamedTuple):
    """Gravity's torque on an eccentric load that turns, sine sin x + cosine cos x.

    Attributes
    ----------
    sine, cosine : float
        Effort that holds it, V.
    error : float, optional
        Standard error of either, V; 0: not known.
    """

    sine: float = 0.0
    cosine: float = 0.0
    error: float = 0.0

    @property
    def most(self) -> float:
        """Greatest effort that it takes, V."""
        return math.hypot(self.sine, self.cosine)

    def at(self, x: float) -> float:
        """Effort that holds it at an angle.

        Parameters
        ----------
        x : float
            rad.

        Returns
        -------
        float
            V.
        """
        return self.sine * math.sin(x) + self.cosine * math.cos(x)

    def along(self, x: Array) -> Array:
        """Effort that holds it at angles.

        Parameters
        ----------
        x : ndarray, shape (n,)
            rad.

        Returns
        -------
        ndarray, shape (n,)
            V.
        """
        return self.sine * np.sin(x) + self.cosine * np.cos(x)

    def seen_from(self, zero: float) -> Pull:
        """The same of angles that count from elsewhere.

        Parameters
        ----------
        zero : float
            Where they are 0, rad.

        Returns
        -------
        Pull
            V.
        """
        c, s = math.cos(zero), math.sin(zero)
        made = self.sine * c - self.cosine * s, self.sine * s + self.cosine * c
        return Pull(*made, self.error)

    def times(self, factor: float) -> Pull:
        """The same so many times as strong.

        Parameters
        ----------
        factor : float
            -1 turns it round.

        Returns
        -------
        Pull
            V.
        """
        return Pull(factor * self.sine, factor * self.cosine, abs(factor) * self.error)


BALANCED = Pull()


class Stand:
    """An axis with an encoder, under commissioning.

    Parameters
    ----------
    rig : Session
        The rig, entered.
    dt : float
        Control period, s.
    pitch : float
        Travel per count, m.
    ended : Callable[[], bool], optional
        Whether somebody wants it to end; asked each period.
    place : Place, optional
        What its places are counted in: of an axis that turns, rad for m.

    Attributes
    ----------
    sign : float
        -1 where a positive effort makes the encoder count down; efforts are turned round.
    facing : float
        -1 where positions are turned round in place of efforts, of which there are one way only.
    hold : float
        Effort at the D/A that holds a weight, V; a law's efforts are added to it, and what a record
        shows is without it. Where a drive ends it stays; where somebody interrupts, nothing does.
    pull : Pull
        The same of what depends on the angle, V at the D/A; beside `hold`, and as that.
    zero : float
        Encoder count that is position 0: that of the first reading.
    """

    def __init__(
        self,
        rig: Session,
        dt: float,
        pitch: float,
        ended: Callable[[], bool] = lambda: False,
        place: Place = LENGTH,
    ) -> None:
        self.place = place
        self.rig, self.dt, self.pitch, self._ended = rig, dt, pitch, ended
        self.sign, self.facing, self.zero = 1.0, 1.0, math.nan
        self.hold, self.pull = 0.0, BALANCED

    def check(self) -> None:
        """Leave all outputs safe where somebody wants it to end.

        Raises
        ------
        KeyboardInterrupt
            Somebody does.
        """
        if self._ended():
            self.rig.stop()
            raise KeyboardInterrupt

    def drive(self, law: Law, seconds: float, caution: Caution) -> Record:
        """Let a law drive the axis for a time; then, or where it passes a limit, only hold it.

        Parameters
        ----------
        law : Law
            Called each period.
        seconds : float
            At most so long, s.
        caution : Caution
            Efforts are clipped; beyond the window or the speed it ends.

        Returns
        -------
        Record
            A row per period.

        Raises
        ------
        KeyboardInterrupt
            As `check`.
        """
        rows, ended, hold = [], "", self.hold
        recent: list[float] = []
        least = max(-caution.effort, caution.lowest)
        for k in range(max(round(seconds / self.dt), 1)):
            x = self.position()
            recent = [*recent[-_ESTIMATE:], x]
            v = (recent[-1] - recent[0]) / (self.dt * max(len(recent) - 1, 1))
            ended = _passed(x, v, caution)
            wanted = None if ended else law(k * self.dt, x, v)
            if not math.isnan(x):  # what held it last, where nobody knows where it is
                hold = self.hold + self.pull.at(x)
            held = self.sign * hold
            u = 0.0 if wanted is None else min(max(wanted + held, least), caution.effort) - held
            rows.append((k * self.dt, u, x))
            self.check()
            self.rig.write(SAFE._replace(motor=self.sign * u + hold))
            self.rig.wait(self.dt)
            if wanted is None:
                break
        self.rig.write(SAFE._replace(motor=hold))
        t, u, x = np.array(rows).T
        return Record(t, u, x, ended)

    def position(self) -> float:
        """Where the axis is, by its encoder.

        Returns
        -------
        float
            m; NaN where the encoder gave nothing.
        """
        count = float(self.rig.read().encoder)
        if math.isnan(self.zero):
            self.zero = count
        return self.facing * (count - self.zero) * self.pitch

    def rest(self, caution: Caution, longest: float = 10.0) -> bool:
        """Wait without effort until the axis stands.

        Parameters
        ----------
        caution : Caution
            As for `drive`.
        longest : float, optional
            Patience, s.

        Returns
        -------
        bool
            Whether it stands.
        """
        since, at = 0.0, math.nan

        def idle(t: float, x: float, v: float) -> float | None:
            nonlocal since, at
            if not abs(x - at) < 0.5 * self.pitch:
                since, at = t, x
            return None if t - since >= _CALM else 0.0

        wide = caution._replace(low=-math.inf, high=math.inf, speed=math.inf)
        record = self.drive(idle, longest, wide)
        return not record.ended and len(record.t) * self.dt < longest


def _passed(x: float, v: float, caution: Caution) -> str:
    """The limit that is passed, or ""."""
    if math.isnan(x):
        return SENSOR
    if not caution.low <= x <= caution.high:
        return WINDOW
    return SPEED if abs(v) > caution.speed else ""
