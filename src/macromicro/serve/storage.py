"""Where the server writes: looked at before anything starts, and named by their options."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from macromicro.errors import InputError
from macromicro.recorder import check_space
from macromicro.recording_format import needed_bytes
from macromicro.schema.text import printable
from macromicro.serve.shared import COLUMNS

_FILE = "a file in a folder that can be made and written to"
_FOLDER = "a folder that exists or can be made, and be written to"


def check_state(path: Path, option: str = "--state") -> None:
    """Make the position file's folder; InputError where the file could not be kept there.

    Its lock file is made: the only trial that works for every file system.
    """
    where = f"{option} {printable(path, 300)}"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        found = kind(path)
        if found:
            raise InputError(where, found, _FILE)
        for each in (path.with_name(f"{path.name}.lock"), *([path] if path.exists() else [])):
            os.close(os.open(each, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644))
        if not os.access(path.parent, os.W_OK | os.X_OK):  # the file is replaced as a whole
            raise InputError(where, "its folder may not be written to", _FILE)
    except OSError as error:
        raise InputError(where, error.strerror or str(error), _FILE) from None


def kind(path: Path) -> str:
    """What a path is that no file can be kept at; "" for a file, or nothing yet."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return ""
    return "" if stat.S_ISREG(mode) else "a folder" if stat.S_ISDIR(mode) else "no regular file"


def make_folder(path: Path, rows: int, option: str = "--record") -> None:
    """Make the folder for recordings; InputError where it cannot be, or lacks the space that
    one of so many `rows` takes."""
    where = f"{option} {printable(path, 300)}"
    try:
        path.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise InputError(where, "not a folder", _FOLDER) from None
    except OSError as error:
        raise InputError(where, error.strerror or str(error), _FOLDER) from None
    try:
        check_space(path, needed_bytes(COLUMNS, rows))
    except InputError as error:
        raise InputError(where, error.value, error.accepted) from None
