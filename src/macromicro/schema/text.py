"""Reading a text file that a user names; every error is one sentence."""

from __future__ import annotations

import math
import re
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from macromicro.errors import InputError, ProblemError

MAX_BYTES = 20_000_000
_JUNK = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]")


def read_text(path: Path, what: str) -> str:
    """The text of a UTF-8 file, without a byte order mark."""
    where = printable(path, 300)
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise ProblemError(where, "this is a folder", f"Expected: {what}.")
        if not stat.S_ISREG(status.st_mode):
            raise ProblemError(where, "not a regular file", f"Expected: {what}.")
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise ProblemError(where, "no such file", f"Expected: {what}.") from None
    except OSError as error:
        raise ProblemError(
            where, error.strerror or "cannot be read", f"Expected: {what}."
        ) from None
    except ValueError:  # a NUL in the name
        raise ProblemError(where, "not a valid file name", f"Expected: {what}.") from None
    if len(data) > MAX_BYTES:
        size = f"{max(status.st_size, len(data)) / 1e6:.1f} MB"
        raise InputError(where, size, f"{what} of at most {MAX_BYTES / 1e6:.0f} MB")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        found = f"byte 0x{data[error.start]:02x} at offset {error.start} is not UTF-8"
        raise ProblemError(where, found, f"Expected: {what}.") from None
    if junk := _JUNK.search(text):
        offset = len(text[: junk.start()].encode())
        found = f"there is control character 0x{ord(junk[0]):02x} at offset {offset}"
        raise ProblemError(where, found, f"Expected: {what}.") from None
    text = text.removeprefix("\ufeff")
    if not text.strip():
        raise ProblemError(where, "the file is empty", f"Expected: {what}.")
    return text


def is_toml(name: str) -> bool:
    """Whether a name is that of a TOML file."""
    return name.lower().endswith(".toml")


def read_toml(path: Path, what: str) -> dict[str, Any]:
    if path.suffix.lower() != ".toml" and not path.is_dir():  # reading says what a directory is
        found = f"the suffix is {printable(path.suffix)}" if path.suffix else "there is no suffix"
        raise ProblemError(printable(path, 300), found, f"Expected: {what}.")
    return parsed_toml(read_text(path, what), printable(path, 300))


def parsed_toml(text: str, where: str) -> dict[str, Any]:
    import tomllib

    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ProblemError(where, f"not valid TOML: {printable(error, 120)}") from None
    except RecursionError:
        raise ProblemError(where, "not valid TOML: too deeply nested") from None
    except ValueError as error:  # a whole number of thousands of digits, the 31st of June
        raise ProblemError(where, f"not valid TOML: {printable(error, 80)}") from None


def write_text(path: Path, text: str, newline: str | None = None) -> None:
    """Write UTF-8; characters outside it, as in an invalid file name, are escaped."""
    path.write_text(text, encoding="utf-8", errors="backslashreplace", newline=newline)


def printable(value: object, length: int = 60) -> str:
    """A value as one line that is safe to print."""
    try:
        text = str(value)
    except ValueError:  # Python prints no whole number of more than 4300 digits
        return "a very long number"
    except Exception:  # an object of somebody's own
        return f"<{type(value).__name__}>"
    safe = text if text.isprintable() else ascii(text)[1:-1]
    return safe if len(safe) <= length else f"{safe[:length]}..."


def plain(value: Any, *, spelled: bool = False) -> Any:
    """A value as JSON can hold it."""
    if hasattr(value, "tolist"):  # of numpy
        value = value.tolist()
    if isinstance(value, float):
        if math.isinf(value) and spelled:
            return str(value)
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(item, spelled=spelled) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item, spelled=spelled) for item in value]
    return value if value is None or isinstance(value, bool | int | str) else str(value)
