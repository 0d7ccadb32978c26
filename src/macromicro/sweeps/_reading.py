"""The results of a sweep read back for a figure, in the units of the clients."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.extras import remedy
from macromicro.schema.par import NO_UNIT, Entry
from macromicro.schema.text import printable
from macromicro.sweeps.folder import RESULTS
from macromicro.units import convert

METRICS = 4  # the first ones
MAX_CELLS = 20_000_000
_ACCEPTED = "Give the folder of a finished sweep."


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
    # how many values each of the parameters that vary takes in a grid that was read whole; else
    # empty
    shape: tuple[int, ...]
    parameters: tuple[Quantity, ...]  # those that vary, in the order of the spec
    metrics: tuple[Quantity, ...]  # the first few


def load(folder: str | Path) -> Results:
    path = Path(folder) / RESULTS
    where = printable(path, 300)
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise ProblemError(
            "results", "pyarrow is not installed", f"Install it {remedy('sweep')}"
        ) from None
    if not path.is_file():
        raise ProblemError(where, "no such file", _ACCEPTED)
    try:
        file = pq.ParquetFile(path)
        spec = json.loads((file.schema_arrow.metadata or {})[b"macromicro.sweep"])
        axes = {p: spec[f"parameters.{p}"] for p in spec["order"]}
        varied = [p for p, axis in axes.items() if len(set(axis)) > 1]
        names = [*varied, *spec["metrics"][:METRICS]]
        most = max(1, MAX_CELLS // len(names) // file.metadata.row_group(0).num_rows)
        count = file.num_row_groups
        groups = np.unique(np.linspace(0, count - 1, min(count, most)).astype(int))
        table = file.read_row_groups(groups.tolist(), columns=names)
        units = {f.name: f.metadata[b"unit"].decode() for f in table.schema}
    except (pa.ArrowException, KeyError, TypeError, ValueError, OSError) as error:
        raise ProblemError(where, f"not part of a sweep ({printable(error)})", _ACCEPTED) from None
    known = _known(spec["job"])
    values = {n: np.asarray(table[n].to_numpy(), float) for n in names}
    parameters = tuple(_parameter(p, units[p], values[p], axes[p], known.get(p)) for p in varied)
    metrics = tuple(
        Quantity(n, "" if units[n] in NO_UNIT else units[n], values[n])
        for n in names[len(varied) :]
    )
    whole = spec["method"] == "grid" and table.num_rows == file.metadata.num_rows
    shape = tuple(len(axes[p]) for p in varied) if whole else ()
    rows = file.metadata.num_rows
    return Results(spec["job"], spec["method"], rows, shape, parameters, metrics)


def _known(job: str) -> dict[str, Entry]:
    """A job's parameters by path; none for a job that is not ours."""
    from macromicro import batch
    from macromicro.sweeps.subject import parameters

    try:
        return parameters(batch.job(job))
    except InputError:
        return {}


def _parameter(
    path: str, unit: str, values: Array, axis: list[Any], entry: Entry | None
) -> Quantity:
    shown = (entry.par.shown if entry is not None else "") or unit
    if shown != unit:
        values = values * convert(1.0, unit, shown)
    log = axis[-1] == "log" if isinstance(axis[-1], str) else _geometric(axis)
    return Quantity(path, "" if shown in NO_UNIT else shown, values, log)


def _geometric(levels: list[float]) -> bool:
    """Whether the values are evenly spaced in the logarithm, rather than linearly."""
    if len(levels) < 3 or min(levels) <= 0.0:
        return False
    ratios, steps = np.diff(np.log(levels)), np.diff(levels)
    return bool(np.ptp(ratios) < 1e-6 * abs(ratios[0])) and not math.isclose(steps[0], steps[-1])
