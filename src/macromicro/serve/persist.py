"""The position file: what is known of the position while nothing runs.

It says `moving` from before a motion begins until the machine is at rest, so a killed process
leaves a file that the next start does not trust.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import os
import time
import zlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from macromicro import portable
from macromicro.errors import MacromicroError
from macromicro.schema.text import printable
from macromicro.serve._background import in_thread

FORMAT = "macromicro position 3"
_OLDER = ("macromicro position 1", "macromicro position 2")
SAME = 50e-6  # m by which the laser may differ at the same position
TELLING = 1e-3  # m: nearer to 0 a laser may just have been switched on
NEAR = 2.0  # counts by which the encoder may differ at the same position


class Kept(NamedTuple):
    """The position as it was saved."""

    rig: str
    encoder: float  # counts
    offset: float  # encoder counts at coordinate 0
    trusted: bool
    why: str
    moving: bool
    saved: float  # s since 1970
    laser: float = math.nan  # carriage position by the laser
    others: tuple[tuple[float, float], ...] = ()  # counts and offset of each further stage


def identity(rig: str, machine: str, settings: Mapping[str, Any]) -> str:
    """What a saved position belongs to: machine, rig and the settings that affect the position."""
    text = "\n".join(f"{path} = {value!r}" for path, value in settings.items())
    return f"{rig} {machine} {zlib.crc32(text.encode()):08x}"


class Evident(NamedTuple):
    """Evidence at a start that the carriage stands where it was left."""

    counted: bool = False  # the counter keeps counting while nothing runs
    laser: float = math.nan


class Restored(NamedTuple):
    """What a start may assume of the position."""

    trusted: bool
    offset: float  # encoder counts at coordinate 0; NaN: unknown
    why: str
    others: tuple[float, ...] = ()  # offsets of the further stages


def default_path(rig: str) -> Path:
    """The file for a rig in the user's state folder (XDG_STATE_HOME, ~/.local/state)."""
    home = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    name = "".join(c if c.isalnum() or c in "._-" else "_" for c in rig)
    return Path(home) / "macromicro" / f"{name}.json"


def save(path: Path, kept: Kept) -> None:
    """Replace the file atomically; that it moves is written in place, which waits for less.

    A file that is torn by that is not trusted either.
    """
    text = json.dumps({"format": FORMAT, **kept._asdict()}, indent=1) + "\n"
    path.parent.mkdir(parents=True, exist_ok=True)
    if kept.moving:
        fd = os.open(path, portable.READ_WRITE, 0o644)
        try:
            # In one piece, over all of it: whoever reads it meanwhile finds a whole text.
            portable.write_at(fd, text.encode().ljust(os.fstat(fd).st_size), 0)
            os.fsync(fd)
        finally:
            os.close(fd)
        return
    part = path.with_name(f"{path.name}.part")
    with part.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    os.replace(part, path)
    if hasattr(os, "O_DIRECTORY"):  # Windows opens no folders
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def load(path: Path) -> Kept | str:
    """The content of the file, or why there is none."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return "no position was saved"
    except (OSError, ValueError, RecursionError) as error:
        return f"{path}: the saved position cannot be read ({printable(error, 80)})"
    try:
        if (written := found.pop("format")) in _OLDER:
            return f"{path}: an older version saved the position"
        if written != FORMAT:
            raise ValueError
        kept = Kept(**found)
        others = tuple((count, offset) for count, offset in kept.others)
        places = (kept.encoder, kept.offset, *(x for pair in others for x in pair))
        numbers = (*places, kept.saved, kept.laser)
        flags = (kept.trusted, kept.moving)
        if not all(isinstance(x, int | float) and not isinstance(x, bool) for x in numbers):
            raise ValueError
        if not all(isinstance(x, bool) for x in flags) or not isinstance(kept.why, str):
            raise ValueError
        encoder, offset, saved, laser = (
            math.nan if math.isnan(x) else float(x)
            for x in (kept.encoder, kept.offset, kept.saved, kept.laser)
        )
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
        return f"{path}: the saved position cannot be read (not written by this version)"
    kept = kept._replace(encoder=encoder, offset=offset, saved=saved, laser=laser)
    return kept._replace(others=tuple((float(count), float(offset)) for count, offset in others))


def restore(
    kept: Kept | str, rig: str, count: float, evident: Evident, others: Sequence[float] = ()
) -> Restored:
    """Whether the saved position may be trusted.

    Only if it was known, at rest, on the same rig, with the same reading of every stage, and a
    witness confirms it: a counter that restarts at 0, or a laser near 0, proves nothing.
    """
    if isinstance(kept, str):
        return Restored(False, math.nan, kept)
    why = _void(kept, rig, count)
    if not why and len(others) != len(kept.others):
        why = "the saved position is that of other stages"
    for seen, (left, _) in zip(others, kept.others, strict=False):
        why = why or _why_moved(seen, left)
    if why:
        return Restored(False, math.nan, why)
    offsets = tuple(offset for _, offset in kept.others)
    if evident.counted:
        why = "restored; the encoder's reading is unchanged"
        return Restored(True, kept.offset, why, offsets)
    if abs(evident.laser - kept.laser) <= SAME and abs(kept.laser) >= TELLING:
        why = "restored; the readings of encoder and laser are unchanged"
        return Restored(True, kept.offset, why, offsets)
    found = "the encoder's reading is unchanged, but nothing else confirms it; home"
    return Restored(False, kept.offset, f"unconfirmed: {found}", offsets)


def _void(kept: Kept, rig: str, count: float) -> str:
    """Why the saved position is void, or ""."""
    if kept.rig != rig:
        other, mine = (each.rpartition(" ")[0] for each in (kept.rig, rig))
        if mine and mine == other:
            return (
                "the saved position belongs to other settings of encoder, stops, switches or homing"
            )
        return f"the saved position belongs to another rig, {other or kept.rig}"
    if kept.moving:
        return "a motion was interrupted when the last run ended"
    if not kept.trusted or not math.isfinite(kept.offset):
        return f"untrusted when the last run ended: {kept.why}"
    return _why_moved(count, kept.encoder)


def _why_moved(count: float, left: float) -> str:
    """Why the encoder's readings are no evidence, or ""."""
    if abs(count - left) <= NEAR:
        return ""
    return (
        "the encoder was moved or reset since the last run "
        f"(it reads {count:.0f}, was left at {left:.0f})"
    )


class Lock:
    """Lock file beside the position file; the loop process inherits the lock."""

    def __init__(self, path: Path) -> None:
        self.path = path.with_name(f"{path.name}.lock")
        self.fd = -1

    def take(self) -> None:
        """Take the lock, or raise an error that names the process holding it."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            fd = os.open(self.path, portable.READ_WRITE, 0o644)
        except OSError as error:
            raise MacromicroError(
                f"{self.path}: the position cannot be saved there: {error.strerror}; make the "
                "folder writable, or name another state file"
            ) from None
        try:
            portable.lock(fd)
        except OSError:
            text = portable.read_at(fd, 200, 0).decode("utf-8", "replace")
            os.close(fd)
            raise MacromicroError(
                f"this machine is already being served by {printable(text.strip(), 80)} "
                f"({self.path} is locked); end that one first (kill it where it does not "
                "answer), or name another state file"
            ) from None
        self.fd = fd
        self.write(f"process {os.getpid()}")

    def write(self, text: str) -> None:
        """Name the holder, for the message to others."""
        os.ftruncate(self.fd, 0)
        portable.write_at(self.fd, text.encode(), 0)

    def drop(self) -> None:
        if self.fd >= 0:
            with contextlib.suppress(OSError):
                os.close(self.fd)
            self.fd = -1


FLICKER = 1.0  # counts: a carriage at rest may stand on an encoder's edge
RETRY_S = 1.0  # after which a file that could not be written is tried again


NOWHERE = Kept("", math.nan, math.nan, False, "not known", True, 0.0)
Shown = tuple[int, Kept]  # number of a row of telemetry, and the position that it shows


class PositionStore:
    """Writes the position file; `begin_motion` precedes every request that moves."""

    def __init__(
        self, path: Path, rig: str, look: Callable[[], Shown | None], report: Callable[[str], None]
    ) -> None:
        self._path, self._rig = path, rig
        self._look, self._report = look, report
        self._writing = asyncio.Lock()
        self._pending = 0
        self._barrier = -1
        self._moving = False
        self._saved: Kept | None = None  # content of the file; None: unknown
        self._failed = -math.inf  # when it could not be written, unless it was since
        self._told = False

    @property
    def moving(self) -> bool:
        return self._moving

    async def begin_motion(self) -> None:
        """Mark the file as moving, or remove it; raises MacromicroError if neither works."""
        self._pending += 1
        async with self._writing:
            if self._moving:
                return
            shown = self._look()
            known = NOWHERE if shown is None else shown[1]
            try:
                await self._save(known._replace(moving=True))
            except MacromicroError:
                self._pending -= 1
                raise
            self._moving = True

    def answered(self, row: int) -> None:
        """Note the loop's answer, which rows after number `row` reflect."""
        self._pending -= 1
        self._barrier = max(self._barrier, row)

    async def update(self) -> None:
        """Write the position if the machine rests and the file differs, or trust has changed."""
        async with self._writing:
            row, place = self._look() or (0, NOWHERE)
            if not math.isfinite(place.encoder):
                return
            if self._pending or row <= self._barrier or self._says(place):
                return
            if time.monotonic() - self._failed < RETRY_S:
                return
            await self._save(place)
            self._moving = place.moving

    async def lose(self, why: str) -> None:
        """Mark the position as unknown after the loop has died: the next start must home."""
        async with self._writing:
            shown = self._look()
            if self._moving or shown is None:  # "moving" says so already
                return
            await self._save(shown[1]._replace(trusted=False, why=why))

    def _says(self, place: Kept) -> bool:
        saved = self._saved
        if saved is None or saved.moving != place.moving or saved.why != place.why:
            return False
        if len(saved.others) != len(place.others):  # written before the first period
            return False
        same = saved.trusted == place.trusted and saved.offset == place.offset
        near = place.moving or abs(saved.encoder - place.encoder) <= FLICKER
        for (left, before), (count, offset) in zip(saved.others, place.others, strict=True):
            same = same and _equal(before, offset, 0.0)
            near = near and (place.moving or _equal(left, count, FLICKER))
        return near and (same or not (saved.trusted or place.trusted))

    async def _save(self, place: Kept) -> None:
        kept = place._replace(rig=self._rig, saved=time.time())
        self._saved = None
        try:
            await in_thread(save, self._path, kept)
            self._saved, self._failed, self._told = kept, -math.inf, False
        except OSError as error:
            self._failed = time.monotonic()
            text = f"{self._path}: the position cannot be saved: {error.strerror}"
            try:
                self._path.unlink(missing_ok=True)
            except OSError:
                raise MacromicroError(f"{text}, and this file cannot be removed") from None
            if not self._told:
                self._told = True
                self._report(f"{text}; the next start will have to home")


def _equal(a: float, b: float, within: float) -> bool:
    return abs(a - b) <= within or (math.isnan(a) and math.isnan(b))
