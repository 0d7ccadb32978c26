"""A microcontroller board as a rig: host or board closes the loop."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple, Self

from macromicro.control.calibration import Calibration
from macromicro.nominal import FULL_SCALE
from macromicro.rig.board import _link, control, framing, protocol
from macromicro.rig.board._link import BoardError, Link, Port
from macromicro.rig.board.control import Board
from macromicro.rig.board.protocol import SPEC, Frame
from macromicro.rig.codes import OK
from macromicro.rig.faults import TEXTS
from macromicro.rig.limits import Limits
from macromicro.rig.session import BENCH
from macromicro.types import SAFE, Command, Outputs

_FAULTS = SPEC["faults"]
_OWN = {
    _FAULTS["limit_switch"]: "a limit switch was pushed on",
    _FAULTS["bridge"]: "the motor bridge reports a fault",
    _FAULTS["late"]: "its control interrupt or guard took too long",
    _FAULTS["host_silent"]: "the host was silent",
}


def _fault(status: Mapping[str, float]) -> str:
    code = int(status["fault"])
    if code == OK:
        return "none"
    when = f"after {1e-6 * SPEC['period'] * status['when']:.3f} s of its clock"
    if code in _OWN:
        return f"{_OWN[code]}, {when}"
    text = TEXTS.get(code)
    if text is None:
        return f"fault {code}, {when}"
    seen = text.seen(status["value"], status["limit"])
    return f"{text.message} ({seen}), {when}. {text.remedy}"


ROUND_TRIPS = 200  # that are measured
TICK = 1e-6 * SPEC["period"]  # s
HOST_LOOP, BOARD_LOOP = "host", "board"
LOOPS = (BOARD_LOOP, HOST_LOOP)
MACRO, BOTH = "macro", "both"
STAGES = (MACRO, BOTH)
_WHOLE = 4096  # codes of the Hall sensor's converter
_TRUSTED = 1 << SPEC["state"]["trusted"]


class BoardSample(NamedTuple):
    t: float  # s
    encoder: float  # counts
    hall: float  # V
    laser: float  # NaN: there is none
    # extend, contract: the wire's driver at an end, 0 or 1
    extend: float
    contract: float
    # limit_low, limit_high: 0 while free, 1: tripped
    limit_low: float
    limit_high: float


class BoardRig:
    """A board behind a serial port, as a `Rig`; it drives from the first unsafe outputs on."""

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
        open_port: Callable[[str], Port] = _link.open_port,
        both: bool | None = None,
    ) -> None:
        self.device, self.loop, self.calibration = device, loop, calibration
        self._both = calibration is not None if both is None else both
        self.channels = self._BOTH if self._both else self._MACRO
        self.clock = self
        self.yielding = False
        self._params = control.of(Limits(), calibration) if params is None else params
        self._open_port = open_port
        self.link: Link | None = None
        self._last: Frame | None = None
        self._driving = self._answered = False
        self._held = False  # by the board's own laws
        self._switched = False  # a limit switch has stopped the board, and that was read
        self._before: int | None = None  # sample behind which the board began to drive
        self._pause = 0  # periods that this took, all of them
        self._command: Command | None = None

    @property
    def own_gains(self) -> bool:
        """Whether the board's own laws close the loop."""
        return self.loop == BOARD_LOOP

    @property
    def _board(self) -> Link:
        if self.link is None:
            raise BoardError(f"{self.device}: the board is not open")
        return self.link

    def now(self) -> float:
        return (self._last.values["time"] - self._pause) * TICK if self._last is not None else 0.0

    @property
    def put_out(self) -> Outputs | None:
        """What the board puts out by its own laws, by its last sample; None under the host's."""
        if self._last is None or not (self._driving and self._held):
            return None
        motor, ctrl = (
            self._last.values[name] * FULL_SCALE / SPEC["full"] for name in ("motor", "ctrl")
        )
        return Outputs(motor, ctrl, 0.0, 0.0)

    def wait(self, dt: float) -> None:
        """Take the next sample, after a heartbeat."""
        if not self._answered:
            self._board.tell("keep", sample=self._number)
        first = self._last is None
        self._last = self._board.sample(_link.FIRST_SAMPLE if first else _link.NEXT_SAMPLE)
        if self._before is not None:
            self._pause += max(int(self._last.values["time"]) - self._before - 1, 0)
            self._before = None
        self._answered = False

    @property
    def _number(self) -> int:
        return int(self._last.values["sample"]) if self._last is not None else 0

    def read(self) -> BoardSample:
        if self._last is None:
            self.wait(TICK)
        assert self._last is not None
        seen = self._last.values
        lines = protocol.bits(seen["lines"], SPEC["lines"])
        switches = (float(lines["limit_low"]), float(lines["limit_high"]))
        if self._driving and seen["fault"] != OK:
            # A tripped limit switch is an error only for a command against it (`write`).
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
        told = self.status()
        self._driving = self._switched = False
        return f"{self.device}: the board stopped: {_fault(told)}"

    def status(self) -> dict[str, float]:
        return self._board.ask("ask", "status")

    def round_trips(self) -> list[float]:
        """Round-trip times with safe outputs; the answer comes in the next period."""
        board = self._board
        self.stop()
        board.trips.clear()
        for _ in range(ROUND_TRIPS):
            self.stop()
        board.forget()
        return list(board.trips)

    def aim(self, command: Command) -> None:
        """Send the controller's set points, before `write`."""
        self._command = command

    def write(self, outputs: Outputs) -> None:
        """Set all outputs from the next period on."""
        command, self._command = self._command, None
        if not (math.isfinite(outputs.motor) and math.isfinite(outputs.ctrl)):
            self.stop()
            raise BoardError(
                f"{self.device}: illegal outputs {outputs}; all outputs were made safe"
            )
        held = self.loop == BOARD_LOOP and command is not None and _active(command)
        self._held = held
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
        """Whether an effort or set point leads against a tripped switch."""
        assert self._last is not None
        seen = self._last.values
        if command is not None:
            ahead = command.macro_reference - float(seen["encoder"])
            motor = ahead if command.macro_active > 0.5 else 0.0
        lines = protocol.bits(seen["lines"], SPEC["lines"])
        return bool((lines["limit_low"] and motor < 0.0) or (lines["limit_high"] and motor > 0.0))

    def _begin(self) -> None:
        crc = framing.crc16(control.words(self._params))
        self._board.urge("begin", "done", parameters=crc)
        self._board.forget()  # they may show the fault that it has cleared
        self._driving = True
        if self._last is not None:
            self._before = int(self._last.values["time"])

    def stop(self) -> None:
        """Set safe outputs at once and wait for the confirmation."""
        if self.link is None:
            return
        self._driving = self._switched = False
        self.link.urge("stop", "done")

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

    def __exit__(self, *_: object) -> None:
        if self.link is None:
            return
        try:
            self.stop()
            self.link.ask("stream", "done", on=0)
        finally:
            self.link.close()
            self.link = None


def _active(command: Command) -> bool:
    return command.macro_active > 0.5 or command.micro_active > 0.5
