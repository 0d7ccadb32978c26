"""Reading a text file that a user names: one sentence for everything that can be wrong."""

from __future__ import annotations

import math
import re
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from macromicro.errors import InputError

MAX_BYTES = 20_000_000
_JUNK = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]")


def read_text(path: Path, what: str) -> str:
    """The text of a UTF-8 file, without a byte order mark.

    Parameters
    ----------
    path : Path
        The file.
    what : str
        What it should be ("a motion programme (.toml or .csv)").

    Returns
    -------
    str
        The text.

    Raises
    ------
    InputError
        Names the file: missing, a directory, not a regular file, not readable, over 20 MB, empty,
        bad UTF-8 or control characters (with the byte offset).
    """
    where = printable(path, 300)
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise InputError(where, "a directory", what)
        if not stat.S_ISREG(status.st_mode):
            raise InputError(where, "not a regular file", what)
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise InputError(where, "no such file", what) from None
    except OSError as error:
        raise InputError(where, error.strerror or "cannot be read", what) from None
    except ValueError:  # a NUL in the name
        raise InputError(where, "not a file name", what) from None
    if len(data) > MAX_BYTES:
        size = f"{max(status.st_size, len(data)) / 1e6:.1f} MB"
        raise InputError(where, size, f"{what} of at most {MAX_BYTES / 1e6:.0f} MB")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        found = f"byte 0x{data[error.start]:02x} at offset {error.start}"
        raise InputError(where, found, "UTF-8 text") from None
    if junk := _JUNK.search(text):
        offset = len(text[: junk.start()].encode())
        found = f"control character 0x{ord(junk[0]):02x} at offset {offset}"
        raise InputError(where, found, "plain text") from None
    text = text.removeprefix("\ufeff")
    if not text.strip():
        raise InputError(where, "an empty file", what)
    return text


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """The tables of a TOML file.

    Parameters
    ----------
    path : Path
        The file.
    what : str
        What it should be ("a settings file (.toml)").

    Returns
    -------
    dict[str, Any]
        Nested dictionaries, as `tomllib` gives them.

    Raises
    ------
    InputError
        As for `read_text` and `parsed_toml`, and for another suffix than .toml.
    """
    if path.suffix.lower() != ".toml" and not path.is_dir():  # reading says what a directory is
        found = f"suffix {printable(path.suffix)}" if path.suffix else "no suffix"
        raise InputError(printable(path, 300), found, what)
    return parsed_toml(read_text(path, what), printable(path, 300))


def parsed_toml(text: str, where: str) -> dict[str, Any]:
    """The tables of a TOML text.

    Parameters
    ----------
    text : str
        TOML.
    where : str
        Its file, for the message.

    Returns
    -------
    dict[str, Any]
        Nested dictionaries, as `tomllib` gives them.

    Raises
    ------
    InputError
        A slip in its syntax, with the line.
    """
    import tomllib

    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(where, printable(error, 120), "TOML") from None
    except RecursionError:
        raise InputError(where, "too deeply nested", "TOML") from None
    except ValueError as error:  # a whole number of thousands of digits, the 31st of June
        raise InputError(where, printable(error, 80), "TOML") from None


def printable(value: object, length: int = 60) -> str:
    """A value as one line that is safe to print.

    Parameters
    ----------
    value : object
        Anything.
    length : int, optional
        Characters after which it is cut.

    Returns
    -------
    str
        Control characters are escaped.
    """
    try:
        text = str(value)
    except ValueError:  # Python prints no whole number of more than 4300 digits
        return "a very long number"
    except Exception:  # an object of somebody's own
        return f"<{type(value).__name__}>"
    safe = text if text.isprintable() else ascii(text)[1:-1]
    return safe if len(safe) <= length else f"{safe[:length]}..."


def plain(value: Any, *, spelled: bool = False) -> Any:
    """A value as JSON can hold it.

    Parameters
    ----------
    value : Any
        Arrays become lists, numbers of numpy plain ones, keys and unknown objects text. What is not
        a finite number becomes None.
    spelled : bool, optional
        An infinite number becomes "inf" or "-inf" instead, where it means something.

    Returns
    -------
    Any
        Made of dictionaries, lists, text, numbers, truth values and None.
    """
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
