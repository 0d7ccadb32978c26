"""A board by its name: board:PORT, and how it is to work."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from macromicro.control import calibration
from macromicro.errors import InputError
from macromicro.rig.board.rig import BOARD_LOOP, BOTH, LOOPS, MACRO, STAGES, BoardRig
from macromicro.schema.text import printable, read_text

BOARD = "board"
_SCHEME = f"{BOARD}:"
_KEYS = ("loop", "calibration", "stages")


@dataclass(frozen=True)
class Boarded:
    """A board at a port.

    Attributes
    ----------
    device : str
        The port.
    loop : str | None
        Of `LOOPS`; None: the board closes it where it can, which is that of the two-stage machine.
    calibration : Path | None
        File of the Hall sensor's table.
    stages : str | None
        Of `STAGES`; None: both, if there is a table.
    """

    device: str
    loop: str | None = None
    calibration: Path | None = None
    stages: str | None = None

    def __call__(self, seed: int) -> BoardRig:
        """The rig; not opened. InputError for a calibration that cannot be read."""
        table = None
        if self.calibration is not None:
            table = calibration.read(read_text(self.calibration, "Hall calibration"))
        return BoardRig(self.device, self.loop or BOARD_LOOP, table, both=self._both)

    @property
    def _both(self) -> bool:
        with_table = BOTH if self.calibration is not None else MACRO
        return (self.stages or with_table) == BOTH

    def check(self) -> None:
        """Read the calibration, without opening the port.

        Raises
        ------
        InputError
            It cannot be read.
        """
        self(0)

    def __str__(self) -> str:
        more = [f"loop={self.loop}"] if self.loop is not None else []
        if self.calibration is not None:
            more.append(f"calibration={self.calibration}")
        more += [f"stages={self.stages}"] if self.stages is not None else []
        return ",".join([_SCHEME + self.device, *more])


def is_board(name: str) -> bool:
    """Whether a name of a rig is that of a board.

    Parameters
    ----------
    name : str
        Of `--rig`.

    Returns
    -------
    bool
        True for "board" alone, too.
    """
    return name == BOARD or name.startswith(_SCHEME)


def read(name: str) -> Boarded:
    """The board of a name.

    Parameters
    ----------
    name : str
        "board:/dev/ttyUSB0,loop=host,calibration=hall_calibration.csv,stages=both".

    Returns
    -------
    Boarded
        Not opened.

    Raises
    ------
    InputError
        No port, or a key, loop or stages that there are not.
    """
    device, *more = name.removeprefix(_SCHEME).split(",")
    if name == BOARD or not device:
        raise InputError(
            "--port",
            "none",
            "the board's serial port, such as /dev/ttyUSB0; or a rig's name with it, "
            "such as board:/dev/ttyUSB0",
        )
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


def joined(rig: str, port: str | None, loop: str | None, calibration: Path | None) -> str:
    """The name of a rig with what the command line says of a board.

    Parameters
    ----------
    rig : str
        Of `--rig`.
    port, loop : str | None
        Of `--port` and `--loop`.
    calibration : Path | None
        Of `--calibration`.

    Returns
    -------
    str
        `rig` itself, where it is no board.

    Raises
    ------
    InputError
        An option of a board with another rig, or none of the port.
    """
    given = {"--port": port, "--loop": loop, "--calibration": calibration}
    if rig != BOARD:
        for option, value in given.items():
            if value is not None:
                raise InputError(option, str(value), f"only with --rig {BOARD}")
        return rig
    if port is None:
        return str(read(rig))
    return str(read(str(Boarded(port, loop, calibration))))
