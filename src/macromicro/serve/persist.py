"""What is known of the position when nothing runs: a small file, replaced as a whole.

It says `moving` from before a motion begins until the machine is at rest again. So a
process killed on the way leaves "moving" behind, and the next start knows that what the
file says of the position is not to be trusted.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import math
import os
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.errors import MacromicroError
from macromicro.schema.text import printable

FORMAT = "macromicro position 2"
_OLDER = ("macromicro position 1",)
SAME = 50e-6  # m between what the laser said of the carriage and says that is the same place
TELLING = 1e-3  # m: nearer to 0 a laser may just have been switched on
NEAR = 2.0  # counts between what was left and what is found that count as the same place


class Kept(NamedTuple):
    """The position as it was left. `encoder` [counts]: its reading, as it gives it; `offset`
    [counts]: what it reads at coordinate 0; `trusted`: was the position known? `why`: in
    words; `moving`: was a motion under way? `saved`: when, seconds since 1970. `laser` [m]:
    the carriage by the laser's reading, contraction taken off, NaN without one; `second`,
    `second_offset` [counts]: as `encoder` and `offset`, of a second axis."""

    rig: str
    encoder: float
    offset: float
    trusted: bool
    why: str
    moving: bool
    saved: float
    laser: float = math.nan
    second: float = math.nan
    second_offset: float = math.nan


def identity(rig: str, machine: str, settings: Mapping[str, Any]) -> str:
    """What a position is kept of: a machine on a rig, with those settings that a position depends
    on."""
    text = "\n".join(f"{path} = {value!r}" for path, value in settings.items())
    return f"{rig} {machine} {zlib.crc32(text.encode()):08x}"


class Evident(NamedTuple):
    """What else shows at a start whether the carriage stands where it was left. `counted`: the
    rig's counter keeps its count and counts on while nothing runs; `laser` [m] as in `Kept`."""

    counted: bool = False
    laser: float = math.nan


class Restored(NamedTuple):
    """What a start may assume: trust, what the encoder reads at coordinate 0 [counts]
    (NaN: nothing is known of it), and why; `second_offset`: of a second axis."""

    trusted: bool
    offset: float
    why: str
    second_offset: float = math.nan


def default_path(rig: str) -> Path:
    """The file for a rig in the user's state folder (XDG_STATE_HOME, ~/.local/state)."""
    home = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    name = "".join(c if c.isalnum() or c in "._-" else "_" for c in rig)
    return Path(home) / "macromicro" / f"{name}.json"


def save(path: Path, kept: Kept) -> None:
    """Replace the file, so that at any instant the old or the new text is there, on the disk.

    Raises OSError.
    """
    text = json.dumps({"format": FORMAT, **kept._asdict()}, indent=1)
    part = path.with_name(f"{path.name}.part")
    path.parent.mkdir(parents=True, exist_ok=True)
    with part.open("w", encoding="utf-8") as file:
        file.write(text + "\n")
        file.flush()
        os.fsync(file.fileno())
    os.replace(part, path)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def load(path: Path) -> Kept | str:
    """What the file says, or why it says nothing (no such file, damaged)."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return "no position was kept"
    except (OSError, ValueError, RecursionError) as error:
        return f"{path}: the kept position cannot be read ({printable(error, 80)})"
    try:
        if (written := found.pop("format")) in _OLDER:
            return f"{path}: an older version kept the position, without its settings"
        if written != FORMAT:
            raise ValueError
        kept = Kept(**found)
        places = (kept.encoder, kept.offset, kept.second, kept.second_offset)
        numbers = (*places, kept.saved, kept.laser)
        flags = (kept.trusted, kept.moving)
        if not all(isinstance(x, int | float) and not isinstance(x, bool) for x in numbers):
            raise ValueError
        if not all(isinstance(x, bool) for x in flags) or not isinstance(kept.why, str):
            raise ValueError
        encoder, offset, second, second_offset, saved, laser = (
            math.nan if math.isnan(x) else float(x) for x in numbers
        )
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
        return f"{path}: the kept position cannot be read (not written by this version)"
    kept = kept._replace(encoder=encoder, offset=offset, saved=saved, laser=laser)
    return kept._replace(second=second, second_offset=second_offset)


def restore(
    kept: Kept | str, rig: str, count: float, evident: Evident, second: float = math.nan
) -> Restored:
    """May the kept position be trusted on a rig whose encoder now reads `count`, and that of a
    second axis `second`?

    Only where it was known, at rest, on the same rig, the encoder still reads what it was left
    at, and a witness confirms that. A counter alone does not: one that begins at 0 when it is
    switched on reads 0 wherever the carriage was pushed meanwhile. Neither does a laser near 0.
    Without a witness the place is named, and not trusted.
    """
    if isinstance(kept, str):
        return Restored(False, math.nan, kept)
    why = _void(kept, rig, count)
    if not why and not (math.isnan(second) and math.isnan(kept.second)):
        why = _moved(second, kept.second)
    if why:
        return Restored(False, math.nan, why)
    other = kept.second_offset
    if evident.counted:
        return Restored(True, kept.offset, "restored; the encoder reads what it was left at", other)
    if abs(evident.laser - kept.laser) <= SAME and abs(kept.laser) >= TELLING:
        return Restored(
            True, kept.offset, "restored; encoder and laser read as they were left", other
        )
    found = "the encoder reads what it was left at, and nothing else confirms it; home"
    return Restored(False, kept.offset, f"unconfirmed: {found}", other)


def _void(kept: Kept, rig: str, count: float) -> str:
    """Why what was kept says nothing of where the carriage is now; "" if it does."""
    if kept.rig != rig:
        other, mine = (each.rpartition(" ")[0] for each in (kept.rig, rig))
        if mine and mine == other:
            return "the kept position is of other settings: of encoder, stops, switches or homing"
        return f"the kept position is of another rig, {other or kept.rig}"
    if kept.moving:
        return "a motion was interrupted when the last run ended"
    if not kept.trusted or not math.isfinite(kept.offset):
        return f"untrusted when the last run ended: {kept.why}"
    return _moved(count, kept.encoder)


def _moved(count: float, left: float) -> str:
    """Why an encoder that reads `count` and was left at `left` says nothing; "" if it does."""
    if abs(count - left) <= NEAR:
        return ""
    return (
        "the encoder was moved or reset since the last run "
        f"(it reads {count:.0f}, was left at {left:.0f})"
    )


class Lock:
    """The state file's lock: a file beside it that holds the process that serves.

    The lock is of the open file, so the loop process that inherits `fd` keeps it too: as
    long as one of both lives no other server can take the same machine. The system drops it
    with the last of them; a file that is left behind locks nothing.
    """

    def __init__(self, path: Path) -> None:
        self.path = path.with_name(f"{path.name}.lock")
        self.fd = -1

    def take(self) -> None:
        """Lock. Raises MacromicroError: it names the process that has it, or says why no file
        can be made."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            fd = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise MacromicroError(
                f"{self.path}: the position cannot be kept there: {error.strerror}; make the "
                "folder writable, or name another state file"
            ) from None
        try:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            text = os.pread(fd, 200, 0).decode("utf-8", "replace")
            os.close(fd)
            raise MacromicroError(
                f"this machine is being served already, by {printable(text.strip(), 80)} "
                f"({self.path} is locked); end that one first (kill it where it does not "
                "answer), or name another state file"
            ) from None
        self.fd = fd
        self.write(f"process {os.getpid()}")

    def write(self, text: str) -> None:
        """Who has it, in words, for the message of whoever comes second."""
        os.ftruncate(self.fd, 0)
        os.pwrite(self.fd, text.encode(), 0)

    def drop(self) -> None:
        """Unlock (where the loop process has ended, too)."""
        if self.fd >= 0:
            with contextlib.suppress(OSError):
                os.close(self.fd)
            self.fd = -1
