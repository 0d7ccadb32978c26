"""A folder of results belongs to one command at a time.

The lock is of the folder itself (flock): it leaves no file behind, and the system takes it
back when the process ends, however that was. A file system without such locks has none here.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from macromicro.errors import InputError
from macromicro.experiments import folder
from macromicro.schema.text import printable

_made_here: list[Path] = []  # by this process, for commands under way; innermost first
ACCEPTED = "another folder, or this one when that has ended"


@contextmanager
def held(place: Path, *, overwrite: bool, names: Sequence[str] = folder.FILES) -> Iterator[None]:
    """Keep `place` for this command, from before its work until its results are written.

    Makes the folder; one that is still empty in the end goes again. Raises `InputError` that
    names the process which holds it, and as `folder.check` does for what another one has
    left there in the meantime.
    """
    where = f"--out {printable(place, 300)}"
    _make(place)
    file = os.open(place, os.O_RDONLY)
    try:
        _lock(file, where)
        folder.check_content(place, where, overwrite, names)
        yield
    finally:
        tidy()
        os.close(file)


def tidy() -> None:
    """Remove folders made here that are still empty; for a process that ends at once, too."""
    while _made_here:
        with contextlib.suppress(OSError):  # it has content
            _made_here.pop(0).rmdir()


def _lock(file: int, where: str) -> None:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise InputError(where, f"in use by {holder(file)}", ACCEPTED) from None
    except OSError:
        return


def _make(place: Path) -> None:
    """Make the folder, and note which folders had to be made."""
    missing = [p for p in (place, *place.parents) if not p.exists()]
    place.mkdir(parents=True, exist_ok=True)
    _made_here.extend(p.absolute() for p in missing)


def holder(file: int) -> str:
    """The process that has locked this open folder, as well as the system tells."""
    inode = str(os.fstat(file).st_ino)
    with contextlib.suppress(OSError):
        for line in Path("/proc/locks").read_text(encoding="ascii").splitlines():
            words = line.split()
            if len(words) > 5 and words[1] == "FLOCK" and words[5].rpartition(":")[2] == inode:
                return _process(words[4])
    return "another process"


def _process(number: str) -> str:
    """Number and command line of a process."""
    try:
        words = Path(f"/proc/{number}/cmdline").read_bytes().decode(errors="replace").split("\0")
    except OSError:
        return f"process {number}"
    if len(words) > 1 and "python" in Path(words[0]).name:
        words = [Path(words[1]).name, *words[2:]]
    return f"process {number} ({printable(' '.join(words).strip(), 200)})"
