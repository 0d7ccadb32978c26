"""The server's position file and recording folder."""

from __future__ import annotations

import os
import stat
from collections.abc import Sequence
from pathlib import Path

from macromicro import portable
from macromicro.columns import Column
from macromicro.errors import InputError, ProblemError
from macromicro.recorder import check_space
from macromicro.recording_format import needed_bytes
from macromicro.schema.text import printable
from macromicro.serve.shared import COLUMNS

_FILE = "Choose a file in a folder that you may write to."
_FOLDER = "Choose a folder that you may write to."


def check_state(path: Path, option: str = "--state") -> None:
    """Make the position file's folder and try its lock file."""
    where = f"{option} {printable(path, 300)}"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        found = kind(path)
        if found:
            raise ProblemError(where, f"this is {found}", _FILE)
        for each in (path.with_name(f"{path.name}.lock"), *([path] if path.exists() else [])):
            os.close(os.open(each, portable.READ_WRITE, 0o644))
        if not os.access(path.parent, os.W_OK | os.X_OK):  # the file is replaced as a whole
            raise ProblemError(where, "its folder is not writable", _FILE)
    except OSError as error:
        raise ProblemError(where, error.strerror or str(error), _FILE) from None


def kind(path: Path) -> str:
    """What a path is that cannot be a file, or ""."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return ""
    return "" if stat.S_ISREG(mode) else "a folder" if stat.S_ISDIR(mode) else "no regular file"


def make_folder(
    path: Path, rows: int, option: str = "--record", columns: Sequence[Column] = COLUMNS
) -> None:
    """Make the folder for recordings, with space for one of `rows`."""
    where = f"{option} {printable(path, 300)}"
    try:
        path.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise ProblemError(where, "not a folder", _FOLDER) from None
    except OSError as error:
        raise ProblemError(where, error.strerror or str(error), _FOLDER) from None
    try:
        check_space(path, needed_bytes(columns, rows))
    except InputError as error:
        raise error.at(where) from None
