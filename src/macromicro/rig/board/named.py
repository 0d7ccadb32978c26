"""A board by its name board:PORT with options."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from macromicro.control import calibration
from macromicro.control.settings import Control
from macromicro.errors import InputError, ProblemError
from macromicro.rig.board import control
from macromicro.rig.board.rig import BOARD_LOOP, BOTH, HOST_LOOP, LOOPS, MACRO, STAGES, BoardRig
from macromicro.rig.limits import Limits
from macromicro.schema.text import printable, read_text

BOARD = "board"
_SCHEME = f"{BOARD}:"
_KEYS = ("loop", "calibration", "stages")
MACRO_LAW, MICRO_LAW = "pd-tuned", "pi-antiwindup"  # the board's own


@dataclass(frozen=True)
class Boarded:
    """A board at a port."""

    device: str
    # of `LOOPS`; None: the board closes it where it can, which is that of the two-stage machine
    loop: str | None = None
    calibration: Path | None = None  # file of the Hall sensor's table
    stages: str | None = None  # of `STAGES`; None: both, if there is a table
    limits: Limits | None = None  # of the board's guard; None: those of the thesis' machine
    gains: Control | None = None  # of the board's laws; None: those of the thesis
    yielding: bool = False  # whether a limit switch is the end of a way, as of `BoardRig`

    def __call__(self, seed: int) -> BoardRig:
        """The rig, not opened."""
        table = None
        if self.calibration is not None:
            table = calibration.parse(read_text(self.calibration, "Hall calibration"))
        params = control.of(self.limits or Limits(), table, self.gains)
        rig = BoardRig(self.device, self.loop or BOARD_LOOP, table, params, both=self.both)
        rig.yielding = self.yielding
        return rig

    @property
    def both(self) -> bool:
        with_table = BOTH if self.calibration is not None else MACRO
        return (self.stages or with_table) == BOTH

    def check(self) -> None:
        """Read the calibration, without opening the port."""
        self(0)

    def __str__(self) -> str:
        more = [f"loop={self.loop}"] if self.loop is not None else []
        if self.calibration is not None:
            more.append(f"calibration={self.calibration}")
        more += [f"stages={self.stages}"] if self.stages is not None else []
        return ",".join([_SCHEME + self.device, *more])


def check_laws(board: Boarded, gains: Control) -> None:
    """Check that a board that closes the loop has the chosen laws."""
    asked = {"macro_law": gains.macro_law, "micro_law": gains.micro_law}
    own = {"macro_law": MACRO_LAW, "micro_law": MICRO_LAW}
    for key, name in asked.items():
        closes = (board.loop or BOARD_LOOP) == BOARD_LOOP
        if closes and name != own[key] and (key == "macro_law" or board.both):
            accepted = f"{own[key]}, which the board runs; or --loop {HOST_LOOP}"
            raise InputError(f"controller.{key}", name, accepted)


def is_board(name: str) -> bool:
    return name == BOARD or name.startswith(_SCHEME)


def parse(name: str) -> Boarded:
    device, *more = name.removeprefix(_SCHEME).split(",")
    if name == BOARD or not device:
        remedy = "Give it, such as --port /dev/ttyUSB0, or name the rig board:/dev/ttyUSB0."
        raise ProblemError("--port", "the board's serial port is missing", remedy)
    given = {}
    for part in more:
        key, sign, value = part.partition("=")
        if key not in _KEYS or not sign or not value:
            raise InputError(
                f"--rig {_SCHEME}{device}", printable(part), "loop=, calibration=, stages="
            )
        given[key] = value
    loop = given.get("loop")
    if loop is not None and loop not in LOOPS:
        raise InputError("--loop", printable(loop), " or ".join(LOOPS))
    file, stages = given.get("calibration"), given.get("stages")
    if stages is not None and stages not in STAGES:
        raise InputError(f"{_SCHEME}{device}, stages", printable(stages), " or ".join(STAGES))
    return Boarded(device, loop, Path(file) if file else None, stages)


def board_name(rig: str, port: str | None, loop: str | None, calibration: Path | None) -> str:
    """The name of a rig with the board's options of the command line."""
    given = {"--port": port, "--loop": loop, "--calibration": calibration}
    if rig != BOARD:
        for option, value in given.items():
            if value is not None:
                remedy = ""
                if option == "--port":
                    remedy = "The ports of a server are --web, --scpi and --gcs."
                raise ProblemError(option, f"needs --rig {BOARD}", remedy)
        return rig
    if port is None:
        return str(parse(rig))
    return str(parse(str(Boarded(port, loop, calibration))))
