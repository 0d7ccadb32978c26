"""A microcontroller board as a rig: the host closes the loop, or the board does."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import TracebackType
from typing import NamedTuple, Self

from macromicro.control.calibration import Calibration
from macromicro.nominal import FULL_SCALE
from macromicro.rig.board import control, framing, link, parameters, protocol, telling
from macromicro.rig.board.control import Board
from macromicro.rig.board.link import BoardError, Link, Port
from macromicro.rig.board.protocol import SPEC, Frame
from macromicro.rig.codes import OK
from macromicro.rig.limits import Limits
from macromicro.rig.session import BENCH
from macromicro.types import SAFE, Command, Outputs

TICK = 1e-6 * SPEC["period"]  # s
HOST_LOOP, BOARD_LOOP = "host", "board"
LOOPS = (BOARD_LOOP, HOST_LOOP)
MACRO, BOTH = "macro", "both"
STAGES = (MACRO, BOTH)
_WHOLE = 4096  # codes of the Hall sensor's converter
_TRUSTED = 1 << SPEC["state"]["trusted"]


class BoardSample(NamedTuple):
    """What a board shows: a `Sample` and its limit switches.

    Attributes
    ----------
    t : float
        s.
    encoder : float
        counts.
    hall : float
        V.
    laser : float
        NaN: there is none.
    extend, contract : float
        The wire's driver at an end, 0 or 1.
    limit_low, limit_high : float
        0 while free, 1: tripped.
    """

    t: float
    encoder: float
    hall: float
    laser: float
    extend: float
    contract: float
    limit_low: float
    limit_high: float


class BoardRig:
    """A board behind a serial port, as a `Rig`.

    Opening it writes all parameters and reads them back. The board begins to drive with the first
    outputs that are not safe, and its clock is the rig's.

    Parameters
    ----------
    device : str
        The port.
    loop : str, optional
        BOARD_LOOP: where the controller says what it is after (`aim`), the board's own laws get
        there; HOST_LOOP: the board puts out what it is told.
    calibration : Calibration | None, optional
        Of the Hall sensor; None: the board expects nothing of it.
    params : Board | None, optional
        The board's parameters; None for those of the thesis.
    open_port : Callable[[str], Port], optional
        Opens the port.
    both : bool | None, optional
        Whether there is a micro-stage behind the macro-stage; None: if there is a calibration.
        Without one its Hall sensor and lines are shown as no value.

    Attributes
    ----------
    yielding : bool
        Whether a limit switch that is pushed on is the end of a way, as a stop is: the board puts
        nothing out, and drives again for what does not push on it. Else it ends the run.
    """

    kind = BENCH
    _SWITCHES = ("limit_low", "limit_high")
    _MACRO = ("encoder", *_SWITCHES)
    _BOTH = ("encoder", "hall", "extend", "contract", *_SWITCHES)
    timed = True  # its clock is the board's, which each sample tells
    counted = False  # most boards are reset as their port is opened

    def __init__(
        self,
        device: str,
        loop: str = BOARD_LOOP,
        calibration: Calibration | None = None,
        params: Board | None = None,
        open_port: Callable[[str], Port] = link.opened,
        both: bool | None = None,
    ) -> None:
        self.device, self.loop, self.calibration = device, loop, calibration
        self._both = calibration is not None if both is None else both
        self.channels = self._BOTH if self._both else self._MACRO
        self.clock = self
        self.yielding = False
        self._params = control.thesis(Limits(), calibration) if params is None else params
        self._open_port = open_port
        self.link: Link | None = None
        self._last: Frame | None = None
        self._driving = self._answered = False
        self._switched = False  # a limit switch has stopped the board, and that was read
        self._before: int | None = None  # sample behind which the board began to drive
        self._pause = 0  # periods that this took, all of them
        self._command: Command | None = None

    @property
    def own_gains(self) -> bool:
        """Whether the board's own laws close the loop, by gains that the host cannot change."""
        return self.loop == BOARD_LOOP

    @property
    def _board(self) -> Link:
        if self.link is None:
            raise BoardError(f"{self.device}: the board is not open")
        return self.link

    def now(self) -> float:
        """Time of the last sample.

        Returns
        -------
        float
            Of the board's clock since its reset, s, without the periods in which it compares its
            parameters before it begins to drive: a run that begins then has no gap.
        """
        return (self._last.values["time"] - self._pause) * TICK if self._last is not None else 0.0

    def wait(self, dt: float) -> None:
        """Take the next sample; tell the board first that the host is there.

        Parameters
        ----------
        dt : float
            The board's own period, s.
        """
        if not self._answered:
            self._board.tell("keep", sample=self._number)
        self._last = self._board.sample(newest=True)
        if self._before is not None:
            self._pause += max(int(self._last.values["time"]) - self._before - 1, 0)
            self._before = None
        self._answered = False

    @property
    def _number(self) -> int:
        return int(self._last.values["sample"]) if self._last is not None else 0

    def read(self) -> BoardSample:
        """What the board measured last.

        Returns
        -------
        BoardSample
            NaN for a Hall sensor that gave no value.

        Raises
        ------
        BoardError
            The board stopped by a fault of its own, but for a limit switch.
        """
        if self._last is None:
            self.wait(TICK)
        assert self._last is not None
        seen = self._last.values
        lines = protocol.bits(seen["lines"], SPEC["lines"])
        switches = (float(lines["limit_low"]), float(lines["limit_high"]))
        if self._driving and seen["fault"] != OK:
            # A limit switch is no error for who then asks for nothing more: `write` tells.
            self._switched = seen["fault"] == SPEC["faults"]["limit_switch"]
            if not self._switched:
                raise BoardError(self._why())
        encoder, none = float(seen["encoder"]), math.nan
        if not self._both:
            return BoardSample(self.now(), encoder, none, none, none, none, *switches)
        hall = seen["hall"] * FULL_SCALE / _WHOLE if seen["hall"] < _WHOLE else none
        ends = (float(lines["extend"]), float(lines["contract"]))
        return BoardSample(self.now(), encoder, hall, none, *ends, *switches)

    def _why(self) -> str:
        """The board's fault in words."""
        told = self.status()
        self._driving = self._switched = False
        return f"{self.device}: the board stopped: {telling.fault(told)}"

    def status(self) -> dict[str, float]:
        """How the board is.

        Returns
        -------
        dict[str, float]
            Fields of `status`.
        """
        return self._board.ask("ask", "status")

    def round_trips(self, count: int = 200) -> list[float]:
        """How long the link takes, with outputs safe: stops are answered in the next period.

        Parameters
        ----------
        count : int, optional
            How many are measured.

        Returns
        -------
        list[float]
            s.
        """
        board = self._board
        self.stop()
        board.trips.clear()
        for _ in range(count):
            self.stop()
        board.forget()
        return list(board.trips)

    def aim(self, command: Command) -> None:
        """Say what the controller is after in this period, before its `write`.

        Parameters
        ----------
        command : Command
            Set points; in the board's loop its own laws get there.
        """
        self._command = command

    def write(self, outputs: Outputs) -> None:
        """Set all outputs from the next period on.

        Parameters
        ----------
        outputs : Outputs
            Motor and CTRL; the board has neither fan nor laser.

        Raises
        ------
        BoardError
            One is not a number, the board is gone, or a limit switch has stopped it, that was
            read, and more than safe outputs is asked for before a stop; not where it is `yielding`.
        """
        command, self._command = self._command, None
        if not (math.isfinite(outputs.motor) and math.isfinite(outputs.ctrl)):
            self.stop()
            raise BoardError(f"{self.device}: asked for {outputs}; all outputs were made safe")
        held = self.loop == BOARD_LOOP and command is not None and _active(command)
        if self._switched:
            if outputs == SAFE and not held:
                return  # until a stop
            if not self.yielding:
                raise BoardError(self._why())
            if self._pushes(outputs.motor, command if held else None):
                return
            self._driving = self._switched = False  # the board begins anew
        if not self._driving:
            if outputs == SAFE and not held:
                return
            self._begin()
        if held and command is not None:
            active = protocol.SPEC["active"]
            self._board.tell(
                "targets",
                sample=self._number,
                macro_reference=command.macro_reference,
                micro_reference=command.micro_reference,
                active=(command.macro_active > 0.5) << active["macro"]
                | (command.micro_active > 0.5) << active["micro"],
            )
        else:
            self._board.tell("outputs", sample=self._number, motor=outputs.motor, ctrl=outputs.ctrl)
        self._answered = True

    def _pushes(self, motor: float, command: Command | None) -> bool:
        """Whether an effort, or the way to a set point, goes against a switch that is tripped."""
        assert self._last is not None
        seen = self._last.values
        if command is not None:
            ahead = command.macro_reference - float(seen["encoder"])
            motor = ahead if command.macro_active > 0.5 else 0.0
        lines = protocol.bits(seen["lines"], SPEC["lines"])
        return bool((lines["limit_low"] and motor < 0.0) or (lines["limit_high"] and motor > 0.0))

    def _begin(self) -> None:
        crc = framing.crc16(parameters.words(self._params))
        self._board.ask("begin", "done", parameters=crc)
        self._board.forget()  # they may show the fault that it has cleared
        self._driving = True
        if self._last is not None:
            self._before = int(self._last.values["time"])

    def stop(self) -> None:
        """Safe outputs, at once; returns when the board has said so."""
        if self.link is None:
            return
        self._driving = self._switched = False
        self.link.ask("stop", "done")

    def __enter__(self) -> Self:
        self.link = Link(self._open_port(self.device), self.device)
        try:
            self.identity = self.link.greet(self._params)
            self.stop()
            self.link.configure(self._params)
            if not int(self.status()["state"]) & _TRUSTED:
                self.link.ask("place", "done", count=0)  # it stands where it was switched on
            self.link.ask("stream", "done", on=1)
        except BaseException:
            self.link.close()
            self.link = None
            raise
        self._last, self._answered, self._before, self._pause = None, False, None, 0
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self.link is None:
            return
        try:
            self.stop()
            self.link.ask("stream", "done", on=0)
        finally:
            self.link.close()
            self.link = None


def _active(command: Command) -> bool:
    """Does it ask for either stage?"""
    return command.macro_active > 0.5 or command.micro_active > 0.5
