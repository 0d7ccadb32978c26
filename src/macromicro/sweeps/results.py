"""The results of a sweep: the ranges of its metrics, and columns read back for a figure."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.drawing import files
from macromicro.errors import ProblemError
from macromicro.extras import require
from macromicro.schema.par import NO_UNIT
from macromicro.schema.text import printable
from macromicro.units import convert

if TYPE_CHECKING:
    import pyarrow as pa


RESULTS = "results.parquet"
NAME = "sweep"  # of the figure
FIGURES = files.names([NAME])
METRICS = 4  # the first ones are read
MAX_CELLS = 20_000_000


class Range(NamedTuple):
    unit: str
    finite: int  # variants that have a number
    # least, mean, most: of those; NaN without any
    least: float = math.nan
    mean: float = math.nan
    most: float = math.nan


class Summary(NamedTuple):
    rows: int  # variants
    infeasible: int  # variants without results
    first_infeasible: str  # reason of the first of them
    metrics: dict[str, Range]

    @property
    def constant(self) -> bool:
        """Whether no metric varies between several feasible variants."""
        feasible = self.rows - self.infeasible
        return feasible > 1 and all(
            r.least == r.most and r.finite == feasible for r in self.metrics.values()
        )

    def as_json(self) -> dict[str, Any]:
        ranges = {
            name: each._asdict() if each.finite else {"unit": each.unit, "finite": 0}
            for name, each in self.metrics.items()
        }
        return {**self._asdict(), "metrics": ranges}


def summarise(path: Path) -> Summary:
    """The ranges of the metrics in a file of results, read column by column."""
    import pyarrow.parquet as pq

    file, ranges = pq.ParquetFile(path), {}
    for field in file.schema_arrow:
        if b"meaning" in (field.metadata or {}):  # else it is no metric
            values = file.read([field.name])[field.name].to_numpy()
            known, unit = values[np.isfinite(values)], field.metadata[b"unit"].decode()
            figures = (known.min(), known.mean(), known.max()) if len(known) else ()
            ranges[field.name] = Range(unit, len(known), *map(float, figures))
    errors = file.read(["index", "error"])
    errors = errors.filter(errors["error"].is_valid())
    first = ""
    if errors.num_rows:
        first = errors["error"][0].as_py()
        if not first.startswith("variant "):  # a job may say itself which
            first = f"variant {errors['index'][0]}: {first}"
    return Summary(file.metadata.num_rows, errors.num_rows, first, ranges)


def lines(summary: Summary) -> Iterator[str]:
    """The ranges of the metrics in words."""
    width = max(map(len, summary.metrics), default=0)
    for name, each in summary.metrics.items():
        if not each.finite:
            yield f"{name:{width}}  no finite value"
            continue
        unit = "" if each.unit in NO_UNIT else f" {each.unit}"
        line = f"{name:{width}}  {each.least:.6g} to {each.most:.6g}{unit}, mean {each.mean:.6g}"
        if each.finite < summary.rows:
            line += f", a number in {each.finite} of {summary.rows}"
        yield line


class Quantity(NamedTuple):
    name: str  # path of a parameter, or name of a metric
    unit: str  # of `values`; "" for none
    values: Array  # in that unit
    log: bool = False  # whether a parameter is spread evenly in its logarithm

    @property
    def label(self) -> str:
        return f"{self.name} [{self.unit}]" if self.unit else self.name


class Results(NamedTuple):
    # job, method: as in the spec
    job: str
    method: str
    total: int  # variants of the sweep; fewer rows are read where all would be too many
    # number of values of each varied parameter in a grid that was read whole; else empty
    shape: tuple[int, ...]
    parameters: tuple[Quantity, ...]  # those that vary, in the order of the spec
    metrics: tuple[Quantity, ...]  # the first few


def load(folder: str | Path) -> Results:
    """The parameters and the first metrics of a finished sweep, in the units that people read."""
    require("a sweep", "pyarrow", "sweep")
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = Path(folder) / RESULTS
    where, accepted = printable(path, 300), "Give the folder of a finished sweep."
    if not path.is_file():
        raise ProblemError(where, "no such file", accepted)
    try:
        file = pq.ParquetFile(path)
        spec = json.loads((file.schema_arrow.metadata or {})[b"macromicro.sweep"])
        axes = {name: spec[f"parameters.{name}"] for name in spec["order"]}
        varied = [name for name, axis in axes.items() if len(set(axis)) > 1]
        names = [*varied, *spec["metrics"][:METRICS]]
        most = max(1, MAX_CELLS // len(names) // file.metadata.row_group(0).num_rows)
        groups = np.unique(np.linspace(0, file.num_row_groups - 1, most).astype(int))
        table = file.read_row_groups(groups.tolist(), columns=names)
        quantities = [_quantity(table.field(name), table[name].to_numpy()) for name in names]
    except (pa.ArrowException, KeyError, TypeError, ValueError, OSError) as error:
        raise ProblemError(where, f"not part of a sweep ({printable(error)})", accepted) from None
    total = file.metadata.num_rows
    whole = spec["method"] == "grid" and table.num_rows == total
    shape = tuple(len(axes[name]) for name in varied) if whole else ()
    parameters, metrics = quantities[: len(varied)], quantities[len(varied) :]
    return Results(
        spec["job"], spec["method"], total, shape, tuple(parameters), tuple(metrics)
    )  # fmt: skip


def _quantity(field: pa.Field, values: Array) -> Quantity:
    notes = {key.decode(): value.decode() for key, value in field.metadata.items()}
    unit = notes["unit"]
    shown = notes.get("shown") or unit
    if shown != unit:
        values = values * convert(1.0, unit, shown)
    return Quantity(
        field.name, "" if shown in NO_UNIT else shown, values, notes.get("scale") == "log"
    )
