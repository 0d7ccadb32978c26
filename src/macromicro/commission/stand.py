"""Test stand: efforts out, positions in; stops at once at a limit."""

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

    Examples
    --------
    >>> from macromicro.commission.stand import Caution
    >>> Caution(effort=5.0, speed=0.2)._replace(high=0.01).high  # m
    0.01
    """

    effort: float  #: largest effort, V
    speed: float  #: greatest speed, m/s
    #: low, high: the window, m from where commissioning began
    low: float = -math.inf
    high: float = math.inf
    lowest: float = -math.inf  #: lowest effort, V; none is below -`effort`

    @property
    def anywhere(self) -> Caution:
        """The same without a window."""
        return self._replace(low=-math.inf, high=math.inf)


class Record(NamedTuple):
    """What a drive showed.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.commission.stand import Record
    >>> record = Record(np.array([0.0, 0.1]), np.ones(2), np.array([0.0, 0.02]))  # s, V, m
    >>> float(record.x[-1])  # m
    0.02
    """

    t: Array  #: s
    u: Array  #: efforts as they were given, V
    x: Array  #: positions, m
    ended: str = ""  #: limit that ended it; "" for none


class Pull(NamedTuple):
    """Gravity's torque on an eccentric load that turns, sine sin x + cosine cos x.

    Examples
    --------
    >>> import math
    >>> from macromicro.commission.stand import Pull
    >>> Pull(sine=0.3, cosine=0.4).most, Pull(sine=0.3).at(math.pi / 2.0)  # V
    (0.5, 0.3)
    """

    #: sine, cosine: effort that holds it, V
    sine: float = 0.0
    cosine: float = 0.0
    error: float = 0.0  #: standard error of either, V; 0: not known

    @property
    def most(self) -> float:
        """Greatest effort that it takes, V."""
        return math.hypot(self.sine, self.cosine)

    def at(self, x: float) -> float:
        """Effort that holds the load at an angle.

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
        """Effort that holds the load at angles.

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
        """The same for angles that count from another zero.

        Parameters
        ----------
        zero : float
            Their zero, rad.

        Returns
        -------
        Pull
            V.
        """
        c, s = math.cos(zero), math.sin(zero)
        made = self.sine * c - self.cosine * s, self.sine * s + self.cosine * c
        return Pull(*made, self.error)

    def times(self, factor: float) -> Pull:
        """The pull times a factor.

        Parameters
        ----------
        factor : float
            Dimensionless; -1 reverses the pull.

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
        Request to stop; checked each period.
    place : Place, optional
        Unit of positions: rad in place of m for a rotary axis.

    Attributes
    ----------
    sign : float
        -1 where a positive effort makes the encoder count down; efforts are reversed.
    facing : float
        -1 where positions are reversed in place of efforts, which have one sign only.
    hold : float
        Effort at the D/A that holds a weight, V; added to a law's efforts and not in its records.
        It stays when a drive ends, but not at an interruption.
    pull : Pull
        As `hold`, for the part that depends on the angle, V at the D/A.
    zero : float
        Encoder count of position 0: the first reading.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from macromicro.commission.stand import Stand
    >>> from macromicro.rig.session import Session
    >>> stand = Stand(Session(SimpleNamespace(channels=("encoder",)), 1e-3), dt=1e-3, pitch=5e-6)
    >>> stand.sign, stand.pitch  # 1, m
    (1.0, 5e-06)
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
        """Leave all outputs safe at a request to stop.

        Raises
        ------
        KeyboardInterrupt
            At such a request.
        """
        if self._ended():
            self.rig.stop()
            raise KeyboardInterrupt

    def drive(self, law: Law, seconds: float, caution: Caution) -> Record:
        """Let a law drive the axis for a time or up to a limit; then only hold it.

        Parameters
        ----------
        law : Law
            Called each period.
        seconds : float
            Longest time, s.
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
            ended = _exceeded_limit(x, v, caution)
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
        """Position of the axis by its encoder.

        Returns
        -------
        float
            m; NaN without a reading.
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
            Longest wait, s.

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

        record = self.drive(idle, longest, caution.anywhere._replace(speed=math.inf))
        return not record.ended and len(record.t) * self.dt < longest


def _exceeded_limit(x: float, v: float, caution: Caution) -> str:
    """The limit that is exceeded, or ""."""
    if math.isnan(x):
        return SENSOR
    if not caution.low <= x <= caution.high:
        return WINDOW
    return SPEED if abs(v) > caution.speed else ""
