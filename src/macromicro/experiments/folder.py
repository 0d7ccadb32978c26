"""The folder of a run's results: refused before the run where it cannot be used."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from macromicro.errors import InputError
from macromicro.recording import check_space
from macromicro.schema.text import printable

RECORDING = "recording.h5"
SUMMARY = "summary.json"
PAGE = "report.html"
FIGURES = ("response", "tracking", "vibration", "micro", "efforts", "temperatures", "cycles")
FILES = (RECORDING, SUMMARY, PAGE, *(f"{name}.png" for name in FIGURES))
# Summary, page and figures together stay well below this.
REPORT_BYTES = 4_000_000


def check(folder: Path, needed: int, *, overwrite: bool, names: Sequence[str] = FILES) -> None:
    """InputError unless the results can go to `folder`: free, writable, with `needed` bytes.

    An empty folder is free; with `overwrite` one whose files of these `names`, by default
    a run's, may be replaced. Nothing is left on the disk.
    """
    where = f"--out {printable(folder, 300)}"
    if "\0" in str(folder):
        raise InputError(where, "not a file name", "a folder, or a place to make one")
    try:
        if folder.exists() and not folder.is_dir():
            raise InputError(where, "a file", "a folder, or a place to make one")
        if folder.is_dir():
            check_content(folder, where, overwrite, names)
    except OSError as error:
        found = error.strerror or "cannot be read"
        raise InputError(where, found, "a folder, or a place to make one") from None
    _check_writable(folder, where)
    check_space(folder, needed + REPORT_BYTES)


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
    """InputError for content that must not be replaced."""
    content = {path.name for path in folder.iterdir()}
    if content and not overwrite:
        raise InputError(where, "exists already", "a new or empty folder, or --overwrite")
    for name in names:
        path = folder / name
        if path.is_dir() and not path.is_symlink():
            raise InputError(f"{where}, {name}", "a folder", "a file that can be replaced")


def make(folder: Path) -> None:
    """Create `folder`; of an earlier run's results remove the files that a run writes."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in FILES:
        (folder / name).unlink(missing_ok=True)


@contextmanager
def staged(folder: Path, remove: Sequence[str] = ()) -> Iterator[Path]:
    """A place for files, in folders or not, that all go to `folder` when the block ends well,
    else nowhere.

    `remove`: files of an earlier result that must not stay beside the new ones.
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
