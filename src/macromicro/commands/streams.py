"""Standard output and error for a command whose reader may close (``macromicro run | head``).

Unread output is dropped, and the exit status is that of the work, not of the pipe.
"""

from __future__ import annotations

import io
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


class Pipe(io.FileIO):
    """A file whose reader may have closed it."""

    def write(self, data: Any, /) -> int:
        """Write; data that a closed pipe refuses counts as written."""
        try:
            return super().write(data)
        except BrokenPipeError:
            return memoryview(data).nbytes


def prepare() -> None:
    """Let both streams outlive their readers; characters that a terminal lacks become ASCII."""
    sys.stdout = _patient(sys.stdout)
    sys.stderr = _patient(sys.stderr)


def _patient(stream: Any) -> Any:
    """The stream over a `Pipe`; other kinds, such as a test's, unchanged."""
    if type(stream) is not io.TextIOWrapper:
        return stream
    stream.reconfigure(errors="backslashreplace")
    plain = isinstance(stream.buffer, io.RawIOBase)  # unbuffered: python -u
    raw = stream.buffer if plain else getattr(stream.buffer, "raw", None)
    if type(raw) is not io.FileIO:
        return stream
    stream.flush()
    pipe = Pipe(raw.fileno(), "wb", closefd=False)
    return io.TextIOWrapper(
        pipe if plain else io.BufferedWriter(pipe),
        stream.encoding,
        "backslashreplace",
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )


def say(text: str) -> None:
    """A message of the program itself on standard error."""
    print(f"macromicro: {text}", file=sys.stderr)


@contextmanager
def printing_warnings() -> Iterator[list[str]]:
    """Print each of our warnings of what runs within, once; the list has them at its end."""
    said: list[str] = []
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                yield said
            finally:
                ours = [w for w in caught if issubclass(w.category, UserWarning)]
                texts = [f"{w.category.__name__}: {w.message}" for w in ours]
                said += dict.fromkeys(texts)
    finally:
        for text in said:
            say(text)
