"""The folder of a command's results: refused beforehand where it cannot be used, and held by one
command at a time.

The lock is of the folder itself (flock): it leaves no file behind, and the system takes it
back when the process ends, however that was. A file system without such locks has none here.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from macromicro.drawing import files
from macromicro.errors import InputError
from macromicro.recording import check_space
from macromicro.schema.text import printable

RECORDING = "recording.h5"
SUMMARY = "summary.json"
PAGE = "report.html"
FIGURES = ("response", "tracking", "vibration", "micro", "efforts", "temperatures", "cycles")
LEARNED = "learned.toml"
FILES = (RECORDING, SUMMARY, PAGE, LEARNED, *files.names(FIGURES))
# Summary, page and figures together stay well below this.
REPORT_BYTES = 4_000_000

_made_here: list[Path] = []  # by this process, for commands under way; innermost first
_PLACE = "a folder, or a place to make one"
ACCEPTED = "another folder, or this one when that has ended"


def check(folder: Path, needed: int, *, overwrite: bool, names: Sequence[str] = FILES) -> None:
    """Refuse a folder that results cannot go to. Nothing is left on the disk.

    An empty folder is free; with `overwrite` one whose files of these names may be replaced.

    Parameters
    ----------
    folder : Path
        Where they are to go.
    needed : int
        Space needed, bytes.
    overwrite : bool
        Whether files may be replaced.
    names : Sequence[str], optional
        Names of the files, by default a run's.

    Raises
    ------
    InputError
        It is not free, not writable, or has too little space.
    """
    where = named(folder)
    try:
        if folder.is_dir():
            check_content(folder, where, overwrite, names)
    except OSError as error:
        raise InputError(where, error.strerror or "cannot be read", _PLACE) from None
    _check_writable(folder, where)
    check_space(folder, needed + REPORT_BYTES)


def named(folder: Path) -> str:
    """Say how a folder is called in an error.

    Parameters
    ----------
    folder : Path
        It need not be there.

    Returns
    -------
    str
        The option that names it.

    Raises
    ------
    InputError
        What cannot be a folder's name, or is a file.
    """
    where = f"--out {printable(folder, 300)}"
    if "\0" in str(folder):
        raise InputError(where, "not a file name", _PLACE)
    try:
        if folder.exists() and not folder.is_dir():
            raise InputError(where, "a file", _PLACE)
    except OSError as error:
        raise InputError(where, error.strerror or "cannot be read", _PLACE) from None
    return where


def _check_writable(folder: Path, where: str) -> None:
    """Try it: rights say little to the superuser, and /proc and the like keep no files."""
    place = next((p for p in (folder, *folder.absolute().parents) if os.path.lexists(p)), None)
    if place is None or not place.is_dir():
        return
    try:
        os.rmdir(tempfile.mkdtemp(prefix=".macromicro-", dir=place))
    except OSError:
        found = f"nothing can be made in {printable(place, 300)}"
        raise InputError(where, found, "a folder that can be written to") from None


def check_content(folder: Path, where: str, overwrite: bool, names: Sequence[str]) -> None:
    """Refuse content that must not be replaced.

    Parameters
    ----------
    folder : Path
        It exists.
    where : str
        For the message.
    overwrite : bool
        Whether files of `names` may be replaced.
    names : Sequence[str]
        Names of the files.

    Raises
    ------
    InputError
        There is such content.
    """
    content = {path.name for path in folder.iterdir()}
    if content and not overwrite:
        raise InputError(where, "exists already", "a new or empty folder, or --overwrite")
    for name in names:
        path = folder / name
        if path.is_dir() and not path.is_symlink():
            raise InputError(f"{where}, {name}", "a folder", "a file that can be replaced")


def recording(place: Path, accepted: str = "a recording (.h5) or the folder of a run") -> Path:
    """The file of a recording that a user named by it or by its run's folder.

    Parameters
    ----------
    place : Path
        File or folder; a file need not be there.
    accepted : str, optional
        For the message.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        A folder without a recording.
    """
    if not place.is_dir():
        return place
    file = place / RECORDING
    if not file.exists():
        raise InputError(printable(place, 300), f"a folder without {RECORDING}", accepted)
    return file


def make(folder: Path) -> None:
    """Create a folder; of an earlier run's results remove the files that a run writes.

    Parameters
    ----------
    folder : Path
        The folder.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name in FILES:
        (folder / name).unlink(missing_ok=True)


@contextmanager
def staged(folder: Path, remove: Sequence[str] = ()) -> Iterator[Path]:
    """A place for files, in folders or not, that all go to a folder when the block ends well, else
    nowhere.

    Parameters
    ----------
    folder : Path
        Where they go.
    remove : Sequence[str], optional
        Files of an earlier result that must not stay beside the new ones.

    Yields
    ------
    Path
        The place.
    """
    existing = next(p for p in (folder, *folder.absolute().parents) if p.is_dir())
    place = Path(tempfile.mkdtemp(prefix=".macromicro-", dir=existing))
    try:
        yield place
        folder.mkdir(parents=True, exist_ok=True)
        moves = {p: folder / p.relative_to(place) for p in sorted(place.rglob("*")) if p.is_file()}
        for target in moves.values():
            target.parent.mkdir(parents=True, exist_ok=True)
        for name in remove:
            (folder / name).unlink(missing_ok=True)
        for path, target in moves.items():
            path.replace(target)
    finally:
        shutil.rmtree(place, ignore_errors=True)


@contextmanager
def held(place: Path, *, overwrite: bool, names: Sequence[str] = FILES) -> Iterator[None]:
    """Keep a folder for this command, from before its work until its results are written.

    Makes the folder; one that is still empty in the end is removed again.

    Parameters
    ----------
    place : Path
        The folder.
    overwrite : bool
        As for `check`.
    names : Sequence[str], optional
        As for `check`.

    Yields
    ------
    None
        Nothing.

    Raises
    ------
    InputError
        Another process holds it (names that process), or has left there what must not be replaced.
    """
    where = f"--out {printable(place, 300)}"
    _make(place)
    file = os.open(place, os.O_RDONLY)
    try:
        _lock(file, where)
        check_content(place, where, overwrite, names)
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
    """The process that has locked an open folder, as well as the system knows.

    Parameters
    ----------
    file : int
        Descriptor of the folder.

    Returns
    -------
    str
        In words.
    """
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
