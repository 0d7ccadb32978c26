"""The folder of a sweep: its files, what is missing in it, and whether it can be resumed.

sweep.toml       the spec, as given
study.json       the sweep, the version of the code, and the state
parts/           finished parts as Parquet files; removed when the results are complete
results.parquet  the results, once all variants are finished
sweep.png        their figure; or as SVG or PDF
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.errors import ProblemError
from macromicro.schema.text import printable, write_text
from macromicro.sweeps._evaluate import Block, Part
from macromicro.sweeps._provenance import Provenance
from macromicro.sweeps._spec import Spec
from macromicro.sweeps.results import FIGURES, RESULTS, Summary, summarise

if TYPE_CHECKING:
    import pyarrow as pa

    from macromicro.batch import Metric

SPEC, STUDY, PARTS = "sweep.toml", "study.json", "parts"
FILES = (SPEC, STUDY, RESULTS, *FIGURES)
GROUP = 65_536  # rows of a row group
_LEAST_PARTS, _MOST_PARTS, _USUAL = 128, 65_536, 32
_NUMBER, _FOOTER = 8, 4096  # bytes


def part_size(variants: int) -> int:
    """Variants in a part, a power of two that only the sweep's size decides.

    A part is one variant or at most 1/128 of a sweep, and there are at most 131 072 of them.
    """
    size = max(1, min(variants // _LEAST_PARTS, _USUAL), variants // _MOST_PARTS)
    return 1 << (size.bit_length() - 1)


class Folder:
    """The folder of one sweep; whoever writes to it holds `runs.folder.held`."""

    def __init__(
        self, place: Path, spec: Spec, metrics: Sequence[Metric], provenance: Provenance
    ) -> None:
        self.place, self._spec = place, spec
        self._where = f"--out {printable(place, 300)}"
        self._metrics = [metrics[k] for k in spec.columns]
        self._provenance = provenance._asdict()
        self._origin = {**self._provenance, "digest": spec.digest, "spec": spec.canonical}
        self.size = part_size(spec.variants)  # variants in a part
        self.count = -(-spec.variants // self.size)  # parts

    def resumed(self, *, resume: bool, overwrite: bool) -> bool:
        """Whether to continue what the folder holds; refuses a folder of something else."""
        content = {path.name for path in self.place.iterdir()} if self.place.is_dir() else set()
        if resume and STUDY in content:
            self._check_same()
            return True
        # A sweep that was killed before it wrote its study.json has computed nothing.
        begun = resume and content <= {SPEC, PARTS, f".{STUDY}.new"}
        if content and not overwrite and not begun:
            raise ProblemError(
                self._where,
                "the folder already exists",
                "Choose another one, or add --resume or --overwrite.",
            )
        if PARTS in content and not (self.place / PARTS).is_dir():
            problem = "not part of a sweep"
            raise ProblemError(f"{self._where}, {PARTS}", problem, "Choose another folder.")
        return False

    def _check_same(self) -> None:
        """Refuse what was begun with another spec or other code: one file never mixes two."""
        begun = self._study()
        then, now = {**begun, **begun["spec"]}, {**self._origin, **self._spec.canonical}
        for key in dict.fromkeys([*self._provenance, *now, *begun["spec"]]):
            if key not in ("digest", "spec") and then.get(key) != now.get(key):
                was, shown = (printable(each.get(key, "missing"), 100) for each in (then, now))
                raise ProblemError(
                    f"{self._where}, {key}",
                    f"{shown} now, but the folder was begun with {was}",
                    "Restore that to resume, choose another folder, or add --overwrite.",
                )

    def _study(self) -> dict[str, Any]:
        try:
            record: dict[str, Any] = json.loads((self.place / STUDY).read_text(encoding="utf-8"))
            if isinstance(record, dict) and {"state", *self._origin} <= record.keys():
                return record
        except (ValueError, OSError):
            pass
        raise ProblemError(
            f"{self._where}, {STUDY}",
            "not part of a sweep",
            "Choose a sweep's folder, or add --overwrite.",
        )

    def completed(self) -> Summary | None:
        """The summary of the results where they are complete."""
        complete = self._study()["state"] == "complete" and (self.place / RESULTS).exists()
        return summarise(self.place / RESULTS) if complete else None

    def begin(self, text: str) -> None:
        """Replace an earlier sweep; without its study.json nothing is resumed."""
        for name in (STUDY, RESULTS, *FIGURES):
            (self.place / name).unlink(missing_ok=True)
        self.drop_parts()
        (self.place / PARTS).mkdir()
        write_text(self.place / SPEC, text)
        self._write_study({"state": "begun"})

    def complete(self, summary: Summary, facts: dict[str, Any]) -> None:
        self._write_study({"state": "complete", "results": summary.as_json(), **facts})
        self.drop_parts()

    def drop_parts(self) -> None:
        shutil.rmtree(self.place / PARTS, ignore_errors=True)

    def _write_study(self, facts: dict[str, Any]) -> None:
        text = json.dumps({**self._origin, **facts}, indent=2, ensure_ascii=False)
        write_text(_temporary(self.place / STUDY), f"{text}\n")
        _publish(self.place / STUDY)

    def part(self, number: int) -> Path:
        return self.place / PARTS / f"part-{number:06d}.parquet"

    def span(self, number: int) -> tuple[int, int]:
        """Index of the first variant of a part, and their number."""
        first = number * self.size
        return first, min(self.size, self._spec.variants - first)

    def missing(self) -> list[int]:
        """Numbers of the parts that are not there, or damaged."""
        return [number for number in range(self.count) if not self._is_sound(number)]

    def _is_sound(self, number: int) -> bool:
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            rows: int = pq.read_metadata(self.part(number)).num_rows
        except (pa.ArrowException, OSError):
            return False
        return rows == self.span(number)[1]

    def needed_bytes(self, parts: int) -> int:
        """Space for so many parts and the results."""
        columns = 1 + len(self._spec.axes) + len(self._spec.metrics)
        rows = self._spec.variants + min(parts * self.size, self._spec.variants)
        return rows * columns * _NUMBER + parts * _FOOTER + 1_000_000

    def write_part(self, part: Part, block: Block) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        values = part.variants.values
        index = np.arange(part.first, part.first + len(values), dtype=np.int64)
        words = pa.array([block.errors.get(k) for k in range(len(index))], pa.string())
        names = ["index", *part.variants.paths, *self._spec.metrics, "error"]
        table = pa.table(dict(zip(names, [index, *values.T, *block.rows.T, words], strict=True)))
        path = self.part(part.number)
        pq.write_table(table, _temporary(path), use_dictionary=False, write_statistics=False)
        _temporary(path).replace(path)  # one that a power failure damages is computed again

    def write_results(self, stop: Callable[[], bool]) -> Summary | None:
        """Join the parts, in order and in bounded memory; None where `stop` ends it.

        Columns: `index`, the parameters by path, the metrics by name, `error` (why a variant is
        infeasible); units and meanings in the fields' metadata, the spec and the provenance in the
        schema's. The file depends on spec, metrics and provenance only.
        """
        import pyarrow as pa
        import pyarrow.parquet as pq

        schema = self._schema()
        step = max(1, GROUP // self.size)
        fresh = _temporary(self.place / RESULTS)
        with pq.ParquetWriter(fresh, schema, compression="zstd") as writer:
            for low in range(0, self.count, step):
                if stop():
                    fresh.unlink()
                    return None
                numbers = range(low, min(low + step, self.count))
                tables = [pq.ParquetFile(self.part(number)).read() for number in numbers]
                writer.write_table(pa.concat_tables(tables).cast(schema), GROUP)
        _publish(self.place / RESULTS)
        return summarise(self.place / RESULTS)

    def _schema(self) -> pa.Schema:
        import pyarrow as pa

        notes = {
            axis.path: {"unit": axis.unit, "shown": axis.shown or axis.unit, "scale": axis.scale}
            for axis in self._spec.axes
        }
        notes |= {m.name: {"unit": m.unit, "meaning": m.meaning} for m in self._metrics}
        fields = [pa.field(name, pa.float64(), False, each) for name, each in notes.items()]
        fields = [pa.field("index", pa.int64(), False), *fields, pa.field("error", pa.string())]
        record = {"macromicro.sweep": json.dumps(self._spec.canonical, sort_keys=True)}
        record |= {f"macromicro.{key}": value for key, value in self._provenance.items()}
        return pa.schema(fields, metadata=record)


def _temporary(path: Path) -> Path:
    """Where a file is written before it gets its name."""
    return path.with_name(f".{path.name}.new")


def _publish(path: Path) -> None:
    """Give a complete file its name, when it is on the disk."""
    with _temporary(path).open("rb") as file:
        os.fsync(file.fileno())
    _temporary(path).replace(path)
