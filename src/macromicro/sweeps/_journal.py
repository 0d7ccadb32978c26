"""The journal: every finished block of variants is appended to a file at once.

Each writer has its own file. It begins with a head that names the sweep; a record
holds consecutive variants:

    mark (8 bytes) | first index (u64) | rows (u32) | bytes of error text (u32)
    | metrics (rows x columns float64) | error text (JSON: place in the block -> words) | CRC-32

all little-endian, the checksum over everything between mark and itself. A torn or corrupt
record fails its checksum: its variants count as not finished.
"""

from __future__ import annotations

import json
import mmap
import os
import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import ProblemError

Spans = npt.NDArray[np.int64]

SUFFIX = ".journal"
_HEAD = b"macromicro sweep 1\n"
_MARK = b"\xf1block\r\n"
_FIXED = struct.Struct("<QII")
_CRC = struct.Struct("<I")
_DIGEST = 64  # characters of the spec's digest in the head


class Block(NamedTuple):
    first: int  # index of the first one
    rows: Array  # their metrics, NaN where a variant is impossible
    errors: Mapping[int, str]  # why rows were impossible, by their place in the block


class Place(NamedTuple):
    # first, rows: its variants
    first: int
    rows: int
    # offset, size: its bytes in the file
    offset: int
    size: int


class Writer:
    """Appends blocks to a new file; appended blocks outlive the process.

    Power cuts may take what was appended since the last `sync`.
    """

    def __init__(self, path: Path, digest: str, columns: int) -> None:
        self._columns = columns
        self._file = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_APPEND, 0o644)
        self._write(_HEAD + digest.encode().ljust(_DIGEST) + columns.to_bytes(4, "little"))

    def append(self, block: Block) -> None:
        """Append one record, in one write."""
        rows = np.ascontiguousarray(block.rows, dtype="<f8")
        if rows.ndim != 2 or rows.shape[1] != self._columns:
            raise ValueError(f"metrics of shape {rows.shape} for {self._columns} columns")
        text = json.dumps(block.errors).encode() if block.errors else b""
        body = _FIXED.pack(block.first, len(rows), len(text)) + rows.tobytes() + text
        self._write(_MARK + body + _CRC.pack(zlib.crc32(body)))

    def _write(self, data: bytes) -> None:
        rest = memoryview(data)
        while rest:
            rest = rest[os.write(self._file, rest) :]

    def sync(self) -> None:
        """Return when the appended blocks are on the disk."""
        os.fdatasync(self._file)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        os.close(self._file)


def scan(path: Path, digest: str, columns: int) -> Iterator[Place]:
    head = len(_HEAD) + _DIGEST + 4
    with path.open("rb") as file:
        opening = file.read(head)
        if len(opening) < head:
            return
        if opening != _HEAD + digest.encode().ljust(_DIGEST) + columns.to_bytes(4, "little"):
            raise ProblemError(str(path), "the journal belongs to another sweep")
        if os.fstat(file.fileno()).st_size == head:
            return
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            at = head
            while (at := data.find(_MARK, at)) >= 0:
                place = _sound(data, at, columns)
                if place is not None:
                    yield place
                # Behind a record that fails its checksum the next mark may be a sound one's.
                at += place.size if place is not None else 1


def _sound(data: mmap.mmap, at: int, columns: int) -> Place | None:
    """The record at this offset, if it is complete and sound."""
    start = at + len(_MARK)
    if start + _FIXED.size > len(data):
        return None
    first, count, text = _FIXED.unpack_from(data, start)
    end = start + _FIXED.size + count * columns * 8 + text
    if not count or end + _CRC.size > len(data):
        return None
    with memoryview(data) as view, view[start:end] as body:
        if zlib.crc32(body) != _CRC.unpack_from(data, end)[0]:
            return None
    return Place(first, count, at, end + _CRC.size - at)


def read(file: int, place: Place, columns: int) -> Block:
    data = os.pread(file, place.size, place.offset)
    start = len(_MARK) + _FIXED.size
    end = start + place.rows * columns * 8
    rows = np.frombuffer(data[start:end], dtype="<f8").reshape(place.rows, columns)
    text = data[end : -_CRC.size]
    errors = {int(k): str(v) for k, v in json.loads(text).items()} if text else {}
    return Block(place.first, rows, errors)


def joined(blocks: Sequence[Block]) -> Block:
    first = blocks[0].first
    errors = {b.first - first + k: words for b in blocks for k, words in b.errors.items()}
    return Block(first, np.concatenate([b.rows for b in blocks]), errors)


def merged(spans: Spans) -> Spans:
    if not len(spans):
        return np.zeros((0, 2), dtype=np.int64)
    spans = spans[np.argsort(spans[:, 0], kind="stable")]
    ends = np.maximum.accumulate(spans[:, 1])
    opens = np.r_[True, spans[1:, 0] > ends[:-1]]
    closes = np.r_[opens[1:], True]
    return np.stack([spans[opens, 0], ends[closes]], axis=1)


def gaps(done: Spans, first: int, last: int) -> list[tuple[int, int]]:
    found = []
    for low, high in done.tolist():
        if low > first:
            found.append((first, min(low, last)))
        first = max(first, high)
        if first >= last:
            break
    if first < last:
        found.append((first, last))
    return [(low, high) for low, high in found if low < high]
