"""Opens a rig for a run: one reading a period, time from zero, outputs that end safe."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from types import FrameType
from typing import Any, NamedTuple, Self

from macromicro.control.calibration import Calibration
from macromicro.control.macro import MacroLaw
from macromicro.errors import ProblemError
from macromicro.nominal import PERIOD
from macromicro.rig.fixtures import CYCLE_PERIOD, KILN_PERIOD, KILN_PITCH, CycleSample, KilnSample
from macromicro.rig.limits import Limits
from macromicro.types import SAFE, Command, Lines, Outputs, Sample

_NUMBERS = (signal.SIGINT, signal.SIGTERM)


class Unwinding:
    """Turns the first Ctrl-C or SIGTERM after `begin` into KeyboardInterrupt; `end` re-sends it.

    Outside the main thread nothing changes: only that thread receives signals.
    """

    def __init__(self) -> None:
        self._before: dict[int, Any] = {}
        self._received = 0
        self._held = False

    def begin(self) -> None:
        if threading.current_thread() is not threading.main_thread():
            return
        for number in _NUMBERS:
            # None: a handler that is not Python's, and cannot be put back.
            if signal.getsignal(number) not in (signal.SIG_IGN, None):
                self._before[number] = signal.signal(number, self._receive)

    def _receive(self, number: int, frame: FrameType | None) -> None:
        first = not self._received
        self._received = self._received or number
        if first and not self._held:
            raise KeyboardInterrupt

    def leaving(self) -> None:
        """Hold further signals back."""
        self._held = True

    def end(self) -> None:
        """Restore the handlers and re-send a held signal."""
        before, self._before = self._before, {}
        for number, handler in before.items():
            signal.signal(number, handler)
        self._held = False
        received, self._received = self._received, 0
        if received:
            signal.raise_signal(received)


BENCH, KILN, CYCLE = "bench", "kiln", "cycle"


_CALIBRATION = (
    "Run `macromicro collect --rig MODULE:FACTORY hall`, then `macromicro identify hall` on that "
    "recording, and give the rig the attribute `calibration`: macromicro.control.calibration.parse "
    "of hall_calibration.csv (docs/rigs.md)."
)


class Kind(NamedTuple):
    """What a kind of rig may measure, and how often.

    Examples
    --------
    >>> from macromicro.rig.session import Kind
    >>> Kind(channels=("encoder", "laser"), dt=0.001).dt  # s
    0.001
    """

    channels: tuple[str, ...]  #: names of its sample's fields, without the time
    dt: float  #: s


KINDS = {
    BENCH: Kind((*Sample._fields[1:], *Lines._fields), PERIOD),  # lines: of one stage alone
    KILN: Kind(KilnSample._fields[1:], KILN_PERIOD),
    # A thermometer beside the cycle bench is welcome; its twin has none.
    CYCLE: Kind((*CycleSample._fields[1:], "room"), CYCLE_PERIOD),
}


class Fixture(NamedTuple):
    """A rig that procedures can run on, and how to open it.

    Examples
    --------
    >>> from macromicro.rig.session import Fixture
    >>> rig = Fixture("mylab:rig", "bench", make=lambda seed: None, channels=("encoder",), dt=1e-3)
    >>> rig.has("encoder"), rig.has("encoder", "laser")
    (True, False)
    """

    name: str  #: for messages and recordings
    kind: str  #: BENCH, KILN or CYCLE
    #: gives the rig for a seed: for a virtual one a fresh rig with that noise, for a real one
    #: always the same machine
    make: Callable[[int], Any]
    channels: tuple[str, ...]  #: what it measures
    dt: float  #: control period, s
    #: how long it is left with outputs safe before a run that must begin cold, s; 0 where `make`
    #: gives it cold, its laser at zero
    rest: float = 0.0
    #: limits of its guard; None for the user's settings or the defaults
    limits: Limits | None = None
    table: Calibration | None = None  #: its Hall calibration; None where it has none (`calibrated`)
    pitch: float = KILN_PITCH  #: travel per encoder count of a kiln, m
    counted: bool = False  #: whether its encoder keeps its count, and counts on, while nothing runs
    timed: bool = False  #: whether its clock is the machine's own, which says what was missed
    #: of the carriage on its way to where a run starts; None for the thesis' tuned PD
    law: MacroLaw | None = None

    def has(self, *channels: str) -> bool:
        """Whether it measures these channels.

        Parameters
        ----------
        *channels : str
            Names.

        Returns
        -------
        bool
            True if all of them.
        """
        return all(c in self.channels for c in channels)

    def need(self, what: str, *channels: str) -> None:
        """Refuse a rig that lacks a channel.

        Parameters
        ----------
        what : str
            What needs them, for the message.
        *channels : str
            Names.

        Raises
        ------
        ProblemError
            It does not measure all of them.
        """
        missing = ", ".join(c for c in channels if c not in self.channels)
        if missing:
            shown = ", ".join(c for c in self.channels if c != "t") or "nothing"
            problem = f"{what} needs {missing} of the {self.kind}, {self.name} measures {shown}"
            raise ProblemError("", problem, "Use a rig whose `channels` name it, or the twin.")

    def calibrated(self) -> Calibration:
        """The calibration of its own Hall sensor.

        Returns
        -------
        Calibration
            Volts to m.

        Raises
        ------
        ProblemError
            It has none.
        """
        if self.table is None:
            raise ProblemError(f"--rig {self.name}, calibration", "it is missing", _CALIBRATION)
        return self.table

    def open(self, seed: int = 0) -> Session:
        """The rig, to be entered for one run.

        Parameters
        ----------
        seed : int, optional
            Given to `make`.

        Returns
        -------
        Session
            Not yet entered.
        """
        return Session(self.make(seed), self.dt)


class Session:
    """An opened rig, as a `Rig`.

    It may be entered again inside itself; leaving always makes the outputs safe, and leaves the rig
    at last, also on Ctrl-C and SIGTERM, whatever else they do. Readings are taken once a period,
    however often they are asked for.

    Parameters
    ----------
    rig : Any
        What the factory made.
    dt : float
        Control period, s.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from macromicro.rig.session import Session
    >>> Session(SimpleNamespace(channels=("encoder",)), dt=0.001).channels
    ('encoder',)
    """

    def __init__(self, rig: Any, dt: float) -> None:
        self._rig = rig
        self._dt = dt
        self._inside = 0
        self._unwinding = Unwinding()
        self._sample: Any = None
        self._zero: float | None = None
        self.unstopped = "its stop was not called"  # "" once it has returned

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels of the rig."""
        return tuple(self._rig.channels)

    @property
    def outputs(self) -> tuple[str, ...]:
        """Outputs that the rig names; none where it names none."""
        return tuple(getattr(self._rig, "outputs", ()))

    @property
    def clock(self) -> Self:
        """The rig's clock, counting from the last `restart`."""
        return self

    def now(self) -> float:
        """Time since the first reading after the last `restart`.

        Returns
        -------
        float
            s.
        """
        return float(self._rig.clock.now()) - (self._zero or 0.0)

    def wait(self, dt: float) -> None:
        """Return when the next period begins.

        Parameters
        ----------
        dt : float
            Its length, s.
        """
        self._rig.clock.wait(dt)
        self._sample = None

    def driven(self) -> None:
        """Begin a period after the rig was driven beside this session."""
        self.unstopped = "its stop was not called"
        self._sample = None

    @property
    def put_out(self) -> Outputs | None:
        """What a rig that closes the loop itself puts out, as it says; None of any other."""
        found: Outputs | None = getattr(self._rig, "put_out", None)
        return found

    def round_trips(self) -> list[float]:
        """How long orders and their answers take to a rig behind a link that measures it.

        Returns
        -------
        list[float]
            s; none of another rig.
        """
        measured = getattr(self._rig, "round_trips", None)
        return list(measured()) if measured is not None else []

    def restart(self) -> None:
        """Count time from the next reading on."""
        self._zero = None

    def read(self) -> Any:
        """This period's sample.

        Returns
        -------
        Any
            In the rig's own type, its time from zero.
        """
        if self._sample is None:
            self._sample = self._rig.read()
        if self._zero is None:
            self._zero = self._sample.t
        if self._zero == 0.0:
            return self._sample
        return self._sample._replace(t=self._sample.t - self._zero)

    def aim(self, command: Command) -> None:
        """Send the controller's set points to a rig that closes the loop, before `write`.

        Parameters
        ----------
        command : Command
            Set points, and which stage is under control.
        """
        aim = getattr(self._rig, "aim", None)
        if aim is not None:
            aim(command)

    def write(self, outputs: Any) -> None:
        """Set all outputs.

        Parameters
        ----------
        outputs : Any
            In the rig's own type.
        """
        self.unstopped = "its stop was not called"
        self._rig.write(outputs)

    def idle(self, seconds: float) -> None:
        """Let time pass with all outputs safe, while the rig is read as usual.

        Parameters
        ----------
        seconds : float
            Duration, s.
        """
        periods = round(seconds / self._dt)
        if periods:
            self.stop()
        for _ in range(periods):
            self.read()
            self.wait(self._dt)

    def cold(self, rest: float) -> None:
        """A cold start of the bench: a rest with outputs safe, then the laser's zero here.

        Parameters
        ----------
        rest : float
            s; 0 skips the cold start.
        """
        self.idle(rest)
        if rest > 0.0:
            self.read()
            self.write(SAFE._replace(laser_reset=1.0))
            self.wait(self._dt)
            self.stop()

    def stop(self) -> None:
        """Set every output to its safe value.

        Nothing reads the outputs back: `unstopped` says whether the rig's `stop` returned (""), or
        what became of it.
        """
        self.unstopped = "its stop did not return"
        try:
            self._rig.stop()
        except Exception as error:
            self.unstopped = f"its stop failed: {type(error).__name__}: {error}"
            raise
        self.unstopped = ""

    def __enter__(self) -> Self:
        if not self._inside:
            self._unwinding.begin()
            try:
                self._rig.__enter__()
            except BaseException:
                self._unwinding.end()
                raise
        self._inside += 1
        return self

    def __exit__(self, *error: Any) -> None:
        self._inside -= 1
        if self._inside:
            self.stop()
            return
        self._unwinding.leaving()
        try:
            self.stop()
        finally:
            try:
                self._rig.__exit__(*error)
            finally:
                self._unwinding.end()
