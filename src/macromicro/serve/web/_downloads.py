"""Recordings offered for download."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from macromicro.serve._programmes import Planned
from macromicro.serve.web._orders import Refusal, number, text

if TYPE_CHECKING:
    from macromicro.serve.snapshot import RecordingState
    from macromicro.serve.station import Station


MOST = 4_000_000  # characters of a programme: some 100,000 rows
_NAME = re.compile(r"[\w .()+-]{1,100}\.(toml|csv)", re.IGNORECASE)


class Upload:
    """One viewer's programme: the pieces so far, and its plan once complete."""

    def __init__(self) -> None:
        self.name = ""
        self.plan: Any = None
        self._pieces: list[str] = []
        self._size = 0

    def take(self, order: dict[str, Any], load: Callable[[str, str], Planned]) -> dict[str, Any]:
        """Take one piece of a programme; how much has come, and at the end the number of moves."""
        name, offset, piece = text(order, "name"), number(order, "offset"), order.get("text")
        if not _NAME.fullmatch(name):
            raise Refusal(
                f"{name!r:.60} is not a file name of a programme", "a name with .toml or .csv"
            )
        if not isinstance(piece, str):
            raise Refusal("a piece without text", "send text")
        if offset == 0.0:
            self.name, self.plan, self._pieces, self._size = name, None, [], 0
        if name != self.name or offset != self._size:
            raise Refusal(f"a piece at {offset:.0f} of {name}", "begin the upload again")
        self._size += len(piece)
        if self._size > MOST:
            self._pieces, self._size = [], 0
            raise Refusal(f"{name} has more than {MOST} characters", "shorten the programme")
        self._pieces.append(piece)
        if order.get("last") is not True:
            return {"size": self._size}
        whole, self._pieces = "".join(self._pieces), []
        found = load(whole, name)
        self.plan = found.plan
        return {"size": self._size, "moves": found.moves}


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
