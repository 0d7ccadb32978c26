"""The folder of a command's results: checked beforehand and locked by one command at a time.

The lock is on the folder itself (flock): it leaves no file behind, and the system releases it when
the process ends. File systems without such locks have none here.
"""

from __future__ import annotations

import atexit
import contextlib
import itertools
import os
import shutil
import tempfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from macromicro import portable
from macromicro.columns import Column
from macromicro.drawing import files
from macromicro.errors import MacromicroError, ProblemError
from macromicro.recorder import Recorder
from macromicro.recording import check_space
from macromicro.recording_format import Attribute
from macromicro.rig.faults import Fault, end_attributes
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
_PLACE = "Choose a folder."
ACCEPTED = "Choose another folder, or wait until that run has ended."


@contextmanager
def recorder(
    path: Path,
    columns: Sequence[Column],
    capacity: int,
    dt: float,
    attributes: Mapping[str, Attribute],
) -> Iterator[Recorder]:
    """The recording of a run, unfinished until `conclude`; an error becomes its `fault`."""
    with Recorder(
        path, columns, capacity, dt, {**attributes, **end_attributes(False, None)}
    ) as made:
        try:
            yield made
        except Exception as error:
            kind = "" if isinstance(error, MacromicroError) else f"{type(error).__name__}: "
            made.attribute("fault", f"{kind}{error}")
            raise


def conclude(recording: Recorder, finished: bool, fault: Fault | None) -> None:
    for name, value in end_attributes(finished, fault).items():
        recording.attribute(name, value)


def check(folder: Path, needed: int, *, overwrite: bool, names: Sequence[str] = FILES) -> None:
    """Refuse a folder that cannot hold results; leaves nothing on the disk.

    An empty folder is free; with `overwrite` one whose files of these names may be replaced.
    """
    where = folder_name(folder)
    try:
        if folder.is_dir():
            check_content(folder, where, overwrite, names)
    except OSError as error:
        raise ProblemError(where, error.strerror or "cannot be read", _PLACE) from None
    _check_writable(folder, where)
    check_space(folder, needed + REPORT_BYTES)


def choose_folder(out: Path | None, usual: Path, *, overwrite: bool, resume: bool = False) -> Path:
    """The folder that a user names, or a new one: results/thesis, results/thesis-2, ...

    A new one is made at once, so that simultaneous commands get one each; `tidy` removes it if it
    stays empty.
    """
    if out is not None or overwrite:
        return out or usual
    row = (usual.with_name(f"{usual.name}-{k}") for k in itertools.count(2))
    if resume:
        there = [usual, *itertools.takewhile(Path.is_dir, row)]
        return there[-1]
    with contextlib.suppress(OSError):  # `check` says what is wrong with it
        _make(usual.parent)
        for place in itertools.chain([usual], row):
            with contextlib.suppress(FileExistsError):
                place.mkdir()
                _made_here.insert(0, place.absolute())
                return place
    return usual


def folder_name(folder: Path) -> str:
    where = f"--out {printable(folder, 300)}"
    if "\0" in str(folder):
        raise ProblemError(where, "not a valid name", _PLACE)
    try:
        if folder.exists() and not folder.is_dir():
            raise ProblemError(where, "this is a file", _PLACE)
    except OSError as error:
        raise ProblemError(where, error.strerror or "cannot be read", _PLACE) from None
    return where


def _check_writable(folder: Path, where: str) -> None:
    """Try it: the superuser passes all permissions, and /proc keeps no files."""
    place = next((p for p in (folder, *folder.absolute().parents) if os.path.lexists(p)), None)
    if place is None or not place.is_dir():
        return
    try:
        os.rmdir(tempfile.mkdtemp(prefix=".macromicro-", dir=place))
    except OSError:
        raise ProblemError(
            where, f"{printable(place, 300)} is not writable", "Choose another folder."
        ) from None


def check_content(folder: Path, where: str, overwrite: bool, names: Sequence[str]) -> None:
    content = {path.name for path in folder.iterdir()}
    if content and not overwrite:
        raise ProblemError(
            where, "the folder already exists", "Choose another one or add --overwrite."
        )
    for name in names:
        path = folder / name
        if path.is_dir() and not path.is_symlink():
            raise ProblemError(
                f"{where}, {name}",
                "a folder has the name of a result file",
                "Choose another place.",
            )


def recording(place: Path, accepted: str = "a recording (.h5) or the folder of a run") -> Path:
    """The file of a recording that a user named by it or by its run's folder."""
    if not place.is_dir():
        return place
    file = place / RECORDING
    if not file.exists():
        raise ProblemError(
            printable(place, 300), f"the folder has no {RECORDING}", f"Give {accepted}."
        )
    return file


def make(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name in FILES:
        (folder / name).unlink(missing_ok=True)


@contextmanager
def staging(folder: Path, remove: Sequence[str] = ()) -> Iterator[Path]:
    """A temporary folder whose files move to `folder` if the block succeeds."""
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
def locked(place: Path, *, overwrite: bool, names: Sequence[str] = FILES) -> Iterator[None]:
    """Lock a folder from before the work until its results are written.

    Makes the folder; one that stays empty is removed again.
    """
    where = f"--out {printable(place, 300)}"
    _make(place)
    file = _open_for_lock(place)
    try:
        _lock(file, where)
        check_content(place, where, overwrite, names)
        yield
    finally:
        tidy()
        os.close(file)


def _open_for_lock(place: Path) -> int:
    """A descriptor to lock a folder by; Windows opens no folders, so a file stands for it."""
    if os.name != "nt":
        return os.open(place, os.O_RDONLY)
    name = f"macromicro-{zlib.crc32(str(place.resolve()).encode()):08x}.lock"
    return os.open(Path(tempfile.gettempdir()) / name, portable.READ_WRITE)


def tidy() -> None:
    """Remove folders made here that are still empty."""
    while _made_here:
        with contextlib.suppress(OSError):  # it has content
            _made_here.pop(0).rmdir()


atexit.register(tidy)  # what was chosen, and then refused


def _lock(file: int, where: str) -> None:
    try:
        portable.lock(file)
    except BlockingIOError:
        raise ProblemError(where, f"in use by {holder(file)}", ACCEPTED) from None
    except OSError:
        return


def _make(place: Path) -> None:
    """Make the folder, and note which folders had to be made."""
    missing = [p for p in (place, *place.parents) if not p.exists()]
    place.mkdir(parents=True, exist_ok=True)
    _made_here.extend(p.absolute() for p in missing)


def holder(file: int) -> str:
    """The process that has locked an open folder, as far as the system knows."""
    inode = str(os.fstat(file).st_ino)
    with contextlib.suppress(OSError):
        for line in Path("/proc/locks").read_text(encoding="ascii").splitlines():
            words = line.split()
            if len(words) > 5 and words[1] == "FLOCK" and words[5].rpartition(":")[2] == inode:
                return _process(words[4])
    return "another process"


def _process(number: str) -> str:
    try:
        words = Path(f"/proc/{number}/cmdline").read_bytes().decode(errors="replace").split("\0")
    except OSError:
        return f"process {number}"
    if len(words) > 1 and "python" in Path(words[0]).name:
        words = [Path(words[1]).name, *words[2:]]
    return f"process {number} ({printable(' '.join(words).strip(), 200)})"
