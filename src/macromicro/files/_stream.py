"""Rows of a text as bytes, in pieces: UTF-8, with one separator between cells."""

from __future__ import annotations

import codecs
from collections.abc import Callable
from pathlib import Path

import numpy as np

from macromicro.files._cells import BLANKS
from macromicro.files._layout import Layout

_SPACE, _TAB, _RETURN, _END = b" \t\r\n"
_DOT = bytes.maketrans(b",", b".")


class Rows:
    """A byte file for pyarrow that begins at the first row of data."""

    closed = False

    def __init__(
        self, path: Path, layout: Layout, told: Callable[[int], None] | None = None
    ) -> None:
        self._file = path.open("rb")
        self._told = told
        self._decoder = None
        if layout.encoding.startswith("utf-16"):
            self._decoder = codecs.getincrementaldecoder(layout.encoding)()
        self._skip = layout.lines
        self._dots = layout.comma and layout.mark != ","
        self._blanks = layout.mark == BLANKS
        self._returns = layout.returns
        self._kept = b""
        self._begun = False  # whether the present line has a cell already
        self._rest = b""  # of what was read, beyond what was asked for

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return False

    def writable(self) -> bool:
        return False

    def close(self) -> None:
        self.closed = True
        self._file.close()

    def read(self, size: int = -1) -> bytes:
        made = self._rest
        while size < 0 or len(made) < size:
            raw = self._file.read(size if size > 0 else -1)
            piece = self._as_rows(raw, last=not raw)
            made = made + piece if made else piece
            if not raw:
                break
            if self._told is not None:
                self._told(self._file.tell())
        cut = len(made) if size < 0 else size
        made, self._rest = made[:cut], made[cut:]
        return made

    def _as_rows(self, raw: bytes, *, last: bool) -> bytes:
        """A piece of the file as a piece of the rows."""
        piece = raw
        if self._decoder is not None:
            piece = self._decoder.decode(raw, last).encode()
        if self._returns:
            piece = piece.replace(b"\r", b"\n")
        while self._skip and piece:
            end = piece.find(b"\n") + 1
            if not end:
                return b""
            piece = piece[end:]
            self._skip -= 1
        if self._dots:
            piece = piece.translate(_DOT)
        return self._single(piece, last=last) if self._blanks else piece

    def _single(self, piece: bytes, *, last: bool) -> bytes:
        """Rows with single spaces between cells."""
        data = self._kept + piece
        solid = data if last else data.rstrip(b" \t\r")
        self._kept = data[len(solid) :]
        if not solid:
            return b""
        codes = np.frombuffer(solid, dtype=np.uint8)
        blank = (codes == _SPACE) | (codes == _TAB) | (codes == _RETURN)
        ends = codes == _END
        after = np.empty(len(codes), dtype=np.bool_)  # what stands before is blank, or a line's end
        after[0] = not self._begun
        after[1:] = blank[:-1] | ends[:-1]
        # Of several blanks in a row the first stays, unless nothing but blanks follows it.
        self._begun = not ends[-1]
        made = codes[~(blank & after)]
        made[(made == _TAB) | (made == _RETURN)] = _SPACE
        idle = np.zeros(len(made), dtype=np.bool_)
        idle[:-1] = (made[:-1] == _SPACE) & (made[1:] == _END)
        if last and len(made):
            idle[-1] = made[-1] == _SPACE
        return bytes((made[~idle] if idle.any() else made).tobytes())
