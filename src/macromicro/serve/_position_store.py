"""Keeps the position file true: "moving" before any motion, the position at rest."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable
from pathlib import Path

from macromicro.errors import MacromicroError
from macromicro.serve import persist
from macromicro.serve._background import in_thread
from macromicro.serve.persist import Kept

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
            await in_thread(persist.save, self._path, kept)
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
