"""Recordings offered for download."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from macromicro.serve.web._orders import Refusal

if TYPE_CHECKING:
    from macromicro.serve.snapshot import RecordingState
    from macromicro.serve.station import Station

PIECE = 1 << 18  # bytes; a viewer asks for one piece after the other
LISTED = 20


class Downloads:
    """Recordings of this station, and no other file; the page's own go to `folder`."""

    def __init__(self, station: Station, folder: Path) -> None:
        self._station, self._folder = station, folder
        self._lock = threading.Lock()

    def begin(self, client: str = "", name: Callable[[], str] | None = None) -> str:
        """Begin a recording for this client; its name."""
        stem = name() if name else time.strftime("live-%Y%m%d-%H%M%S")
        with self._lock:
            taken = (self._folder / f"{stem}.h5").exists()
            path = self._folder / (f"{stem}-{time.monotonic_ns()}.h5" if taken else f"{stem}.h5")
            self._station.record(path, client=client)
        return path.name

    def end(self, client: str = "") -> RecordingState:
        return self._station.end_recording(client)

    def listed(self) -> list[dict[str, Any]]:
        """Names and sizes in bytes of the last recordings, oldest first."""
        active = self._active()
        found = []
        for name, path in list(self._files().items())[-LISTED:]:
            try:
                size = path.stat().st_size
            except OSError:
                continue
            found.append({"name": name, "bytes": size, "active": path == active})
        return found

    def piece(self, name: str, offset: float) -> tuple[bytes, int]:
        """A piece of a complete recording from `offset` on, and the file's size in bytes."""
        path = self._files().get(name)
        if path is None or path == self._active():
            raise Refusal(f"there is no complete recording {name!r:.60}", "end it first")
        try:
            with path.open("rb") as file:
                size = path.stat().st_size
                if not 0 <= offset <= size or offset != int(offset):
                    raise Refusal(f"offset {offset!r:.40} is not in the file", "begin again")
                file.seek(int(offset))
                return file.read(PIECE), size
        except OSError as error:
            raise Refusal(f"{name}: {error.strerror}", "see the server's disk") from None

    def _files(self) -> dict[str, Path]:
        """Downloads by name, oldest first; duplicates are numbered."""
        found: dict[str, Path] = {}
        for path in dict.fromkeys(self._station.recorded):
            name, k = path.name, 2
            while name in found:
                name, k = f"{path.stem}-{k}{path.suffix}", k + 1
            found[name] = path
        return found

    def _active(self) -> Path | None:
        state = self._station.snapshot().recording
        return Path(state.path) if state.active else None
