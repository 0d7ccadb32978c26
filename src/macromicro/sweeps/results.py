"""From the journal to a Parquet file: in the order of the index, in bounded memory."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.extras import remedy
from macromicro.sweeps import _journal
from macromicro.sweeps._journal import Block, joined
from macromicro.sweeps._origin import Code
from macromicro.sweeps._sampling import Sampler
from macromicro.sweeps._spec import Spec

if TYPE_CHECKING:
    import pyarrow as pa

    from macromicro.batch import Metric

GROUP = 65_536  # rows of a row group
_RECORD = np.dtype(
    [("first", "<i8"), ("count", "<i8"), ("file", "<i4"), ("offset", "<i8"), ("size", "<i8")]
)


class Range(NamedTuple):
    finite: int  # how many are a number
    # least, mean, most: of those
    least: float
    mean: float
    most: float


class Written(NamedTuple):
    # rows, impossible: variants, and how many of them are impossible
    rows: int
    impossible: int
    words: str  # why the first of those is
    ranges: dict[str, Range]  # by metric, where it is ever a number


def require() -> None:
    """Refuse to go on without pyarrow."""
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError:
        raise ProblemError(
            "results", "pyarrow is not installed", f"Install it {remedy('sweep')}"
        ) from None


def write(
    path: Path,
    spec: Spec,
    metrics: Sequence[Metric],
    journals: Sequence[Path],
    code: Code,
    stop: Callable[[], bool] = lambda: False,
) -> Written | None:
    """Write the results of all variants, all or nothing.

    Columns: `index`, the parameters by path, the metrics by name, `error` (text where a variant is
    impossible, its metrics NaN); units and meanings in the fields' metadata, the spec and the code
    in the schema's. The file depends on spec, metrics and code only.
    """
    import pyarrow.parquet as pq

    schema = _schema(spec, metrics, code)
    sampler = Sampler(spec)
    tally = _Tally(spec.metrics)
    fresh = path.with_name(f".{path.name}.new")
    try:
        with fresh.open("wb") as file:
            with pq.ParquetWriter(file, schema, compression="zstd") as writer:
                for block in _groups(_ordered(spec, journals), spec.variants):
                    if stop():
                        return None
                    tally.add(block)
                    writer.write_table(_table(schema, sampler, block))
            file.flush()
            os.fsync(file.fileno())
        fresh.replace(path)
    finally:
        fresh.unlink(missing_ok=True)
    return tally.written()


def _schema(spec: Spec, metrics: Sequence[Metric], code: Code) -> pa.Schema:
    import pyarrow as pa

    fields = [pa.field("index", pa.int64(), nullable=False)]
    for axis in spec.axes:
        fields.append(
            pa.field(axis.path, pa.float64(), nullable=False, metadata={"unit": axis.unit})
        )
    for metric in (metrics[k] for k in spec.columns):
        notes = {"unit": metric.unit, "meaning": metric.meaning}
        fields.append(pa.field(metric.name, pa.float64(), nullable=False, metadata=notes))
    fields.append(pa.field("error", pa.string()))
    record = {"macromicro.sweep": json.dumps(spec.canonical, sort_keys=True)}
    record |= {f"macromicro.{key}": value for key, value in code._asdict().items()}
    return pa.schema(fields, metadata=record)


def _table(schema: pa.Schema, sampler: Sampler, block: Block) -> pa.Table:
    import pyarrow as pa

    count = len(block.rows)
    index = np.arange(block.first, block.first + count, dtype=np.int64)
    words: list[str | None] = [None] * count
    for place, text in block.errors.items():
        words[place] = text
    columns = [index, *sampler.values(block.first, count).T, *block.rows.T, words]
    arrays = [pa.array(c, type=f.type) for c, f in zip(columns, schema, strict=True)]
    return pa.Table.from_arrays(arrays, schema=schema)


def _ordered(spec: Spec, journals: Sequence[Path]) -> Iterator[Block]:
    """The journals' blocks by index, each variant once."""
    columns = len(spec.metrics)
    places = (
        (place.first, place.rows, number, place.offset, place.size)
        for number, path in enumerate(journals)
        for place in _journal.scan(path, spec.digest, columns)
    )
    records = np.fromiter(places, dtype=_RECORD)
    records = records[np.argsort(records["first"], kind="stable")]
    with ExitStack() as stack:
        files = [stack.enter_context(path.open("rb")).fileno() for path in journals]
        begin = 0
        for first, count, number, offset, size in records:
            if first + count <= begin:
                continue
            place = _journal.Place(int(first), int(count), int(offset), int(size))
            block = _journal.read(files[number], place, columns)
            cut = max(0, begin - block.first)
            begin = block.first + len(block.rows)
            yield _part(block, cut, len(block.rows))


def _part(block: Block, low: int, high: int) -> Block:
    """Rows `low` to `high` (exclusive) of a block."""
    errors = {k - low: words for k, words in block.errors.items() if low <= k < high}
    return Block(block.first + low, block.rows[low:high], errors)


def _groups(blocks: Iterator[Block], count: int) -> Iterator[Block]:
    """The same rows in blocks of `GROUP`; ValueError unless they are 0 to `count` - 1."""
    waiting: list[Block] = []
    held = begin = 0
    for block in blocks:
        if block.first != begin:
            raise ValueError(f"variants {begin} to {block.first - 1} are missing")
        begin += len(block.rows)
        while held + len(block.rows) >= GROUP:
            cut = GROUP - held
            yield joined([*waiting, _part(block, 0, cut)])
            waiting, held = [], 0
            block = _part(block, cut, len(block.rows))  # noqa: PLW2901
        if len(block.rows):
            waiting.append(block)
            held += len(block.rows)
    if begin != count:
        raise ValueError(f"variants {begin} to {count - 1} are missing")
    if waiting:
        yield joined(waiting)


class _Tally:
    """Ranges of the metrics, accumulated by group."""

    def __init__(self, names: Sequence[str]) -> None:
        self._names = names
        width = len(names)
        self._finite = np.zeros(width, dtype=np.int64)
        self._sum = np.zeros(width)
        self._least, self._most = np.full(width, math.inf), np.full(width, -math.inf)
        self._rows = self._impossible = 0
        self._words = ""

    def add(self, block: Block) -> None:
        rows: Array = block.rows
        good = np.isfinite(rows)
        self._rows += len(rows)
        self._finite += good.sum(axis=0)
        self._sum += np.where(good, rows, 0.0).sum(axis=0)
        self._least = np.minimum(self._least, np.where(good, rows, math.inf).min(axis=0))
        self._most = np.maximum(self._most, np.where(good, rows, -math.inf).max(axis=0))
        self._impossible += len(block.errors)
        if block.errors and not self._words:
            place = min(block.errors)
            words = block.errors[place]
            named = words.startswith("variant ")  # a job may say itself which
            self._words = words if named else f"variant {block.first + place}: {words}"

    def written(self) -> Written:
        ranges = {}
        for k, name in enumerate(self._names):
            finite = int(self._finite[k])
            if finite:
                mean = float(self._sum[k]) / finite
                ranges[name] = Range(finite, float(self._least[k]), mean, float(self._most[k]))
        return Written(self._rows, self._impossible, self._words, ranges)


def ranges(written: Written, units: dict[str, str]) -> Iterator[str]:
    """The metrics' ranges in words."""
    width = max((len(name) for name in units), default=0)
    for name, unit in units.items():
        if name not in written.ranges:
            yield f"{name:{width}}  always NaN"
            continue
        least, mean, most = written.ranges[name][1:]
        line = f"{name:{width}}  {least:.6g} to {most:.6g}{_unit(unit)}, mean {mean:.6g}"
        finite = written.ranges[name].finite
        if finite < written.rows:
            line += f", a number in {finite} of {written.rows}"
        yield line


def _unit(unit: str) -> str:
    return "" if unit in ("", "1", "-") else f" {unit}"


def constant(written: Written) -> bool:
    possible = written.rows - written.impossible
    return possible > 1 and all(
        r.least == r.most and r.finite == possible for r in written.ranges.values()
    )


def as_json(written: Written, metrics: Sequence[Metric]) -> dict[str, Any]:
    """The same for the summary."""
    units = {m.name: m.unit for m in metrics}
    record = {n: {"unit": units[n], **r._asdict()} for n, r in written.ranges.items()}
    found = {"rows": written.rows, "impossible": written.impossible, "metrics": record}
    return {**found, "first_impossible": written.words} if written.words else found


def restored(record: Mapping[str, Any]) -> Written:
    """The inverse of `as_json`."""
    ranges = {
        name: Range(**{key: one[key] for key in Range._fields})
        for name, one in record["metrics"].items()
    }
    words = str(record.get("first_impossible", ""))
    return Written(int(record["rows"]), int(record["impossible"]), words, ranges)
