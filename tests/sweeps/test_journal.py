"""A journal gives back exactly the blocks that were wholly written."""

from __future__ import annotations

import multiprocessing
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.sweeps import _journal
from macromicro.sweeps._journal import Block, Writer

DIGEST = "d" * 64
COLUMNS = 3


def blocks(sizes: list[int], start: int = 0) -> list[Block]:
    """Consecutive blocks, some rows impossible."""
    found = []
    for size in sizes:
        rows = np.random.default_rng(start).normal(size=(size, COLUMNS))
        errors = {0: f"no such variant {start}: ümlaut"} if start % 3 == 0 else {}
        found.append(Block(start, rows, errors))
        start += size
    return found


def written(path: Path, content: list[Block]) -> list[int]:
    """Sizes of the file after its head and after each block."""
    ends = []
    with Writer(path, DIGEST, COLUMNS) as writer:
        ends.append(path.stat().st_size)
        for block in content:
            writer.append(block)
            ends.append(path.stat().st_size)
        writer.sync()
    return ends


def restored(path: Path) -> list[Block]:
    places = list(_journal.scan(path, DIGEST, COLUMNS))
    with path.open("rb") as file:
        return [_journal.read(file.fileno(), place, COLUMNS) for place in places]


def same(found: list[Block], expected: list[Block]) -> bool:
    return len(found) == len(expected) and all(
        a.first == b.first and np.array_equal(a.rows, b.rows) and a.errors == b.errors
        for a, b in zip(found, expected, strict=True)
    )


SIZES = st.lists(st.integers(1, 20), min_size=1, max_size=8)


@given(SIZES, st.data())
def test_a_torn_tail_loses_only_its_block(
    tmp_path_factory: pytest.TempPathFactory, sizes: list[int], data: st.DataObject
) -> None:
    """Cut anywhere, even within the head."""
    path = tmp_path_factory.mktemp("j") / "a.journal"
    content = blocks(sizes)
    ends = written(path, content)
    cut = data.draw(st.integers(0, ends[-1]))
    path.write_bytes(path.read_bytes()[:cut])
    whole = sum(end <= cut for end in ends[1:])
    assert same(restored(path), content[:whole])


@given(SIZES, st.data())
def test_a_corrupt_byte_loses_only_its_block(
    tmp_path_factory: pytest.TempPathFactory, sizes: list[int], data: st.DataObject
) -> None:
    path = tmp_path_factory.mktemp("j") / "a.journal"
    content = blocks(sizes)
    ends = written(path, content)
    at = data.draw(st.integers(ends[0], ends[-1] - 1))
    raw = bytearray(path.read_bytes())
    raw[at] ^= data.draw(st.integers(1, 255))
    path.write_bytes(bytes(raw))
    hit = sum(end <= at for end in ends[1:])
    assert same(restored(path), content[:hit] + content[hit + 1 :])


def test_after_a_torn_record_in_the_middle_the_next_is_read(tmp_path: Path) -> None:
    """As a full disk leaves it that is given space again."""
    path = tmp_path / "a.journal"
    content = blocks([5, 6, 7])
    ends = written(path, content)
    raw = path.read_bytes()
    path.write_bytes(raw[: ends[1]] + raw[ends[1] : ends[2] - 10] + raw[ends[2] :])
    assert same(restored(path), [content[0], content[2]])


def test_marks_within_the_numbers_mislead_nobody(tmp_path: Path) -> None:
    """A block whose payload is made of marks."""
    rows = np.frombuffer(_journal._MARK * 30, dtype="<f8").reshape(10, COLUMNS)
    content = [Block(0, rows, {}), Block(10, rows, {})]
    path = tmp_path / "a.journal"
    written(path, content)
    found = restored(path)
    assert [b.rows.tobytes() for b in found] == [rows.tobytes()] * 2


def _write_many(path: Path, start: int) -> None:
    written(path, blocks([3] * 200, start))


def test_several_at_once_have_files_of_their_own(tmp_path: Path) -> None:
    """And nobody can take over a file that exists."""
    context = multiprocessing.get_context("fork")
    paths = [tmp_path / f"{k}.journal" for k in range(3)]
    writers = [
        context.Process(target=_write_many, args=(path, 600 * k)) for k, path in enumerate(paths)
    ]
    for each in writers:
        each.start()
    for each in writers:
        each.join()
    for k, path in enumerate(paths):
        assert same(restored(path), blocks([3] * 200, 600 * k))
    with pytest.raises(FileExistsError):
        Writer(paths[0], DIGEST, COLUMNS)


def test_another_sweep_s_journal_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.journal"
    written(path, blocks([2]))
    with pytest.raises(InputError, match="another sweep"):
        list(_journal.scan(path, "e" * 64, COLUMNS))


def test_metrics_of_another_shape_are_refused(tmp_path: Path) -> None:
    with (
        Writer(tmp_path / "a.journal", DIGEST, COLUMNS) as writer,
        pytest.raises(ValueError, match="shape"),
    ):
        writer.append(Block(0, np.zeros((2, COLUMNS + 1)), {}))


SPANS = st.lists(st.tuples(st.integers(0, 60), st.integers(1, 9)), max_size=12)


@given(SPANS, st.integers(0, 60), st.integers(0, 60))
def test_merged_spans_and_their_gaps(pairs: list[tuple[int, int]], low: int, high: int) -> None:
    """Against sets of the indices themselves."""
    spans = np.array([(a, a + n) for a, n in pairs], dtype=np.int64).reshape(-1, 2)
    done = {i for a, b in spans for i in range(a, b)}
    found = _journal.merged(spans)
    assert {i for a, b in found for i in range(a, b)} == done
    assert all(found[k, 1] < found[k + 1, 0] for k in range(len(found) - 1))
    open_ = [i for a, b in _journal.gaps(found, low, high) for i in range(a, b)]
    assert open_ == [i for i in range(low, high) if i not in done]
