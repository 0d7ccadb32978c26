"""Variants of a job: values at dotted paths of its parameter tree, checked and applied."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from macromicro.control import calibration
from macromicro.control.calibration import Calibration
from macromicro.errors import InputError
from macromicro.schema.config import check
from macromicro.schema.keys import EXACT
from macromicro.schema.par import Entry, changed, entries

Array = npt.NDArray[np.float64]

SEED = "seed"  # beside the tree's paths: the seed of the measurement noise


@cache
def shipped() -> Calibration:
    """The shipped Hall calibration, read once."""
    return calibration.shipped()


class Variants(NamedTuple):
    """`paths`: k dotted paths; `values`: (n, k), in the units that the parameters are stored in."""

    paths: tuple[str, ...]
    values: Array


class Metric(NamedTuple):
    """A number that a run gives; `unit` as in `macromicro.units`, "" for none."""

    name: str
    unit: str
    meaning: str


class Trajectories(NamedTuple):
    """`t`: (rows,) [s]; `columns`: by name, each (n, rows); `units`: by the same names. A run
    that ended early is NaN from there on."""

    t: Array
    columns: dict[str, Array]
    units: dict[str, str]


class Job(Protocol):
    """What turns variants into metrics. `block`: how many variants are computed together."""

    name: str
    metrics: tuple[Metric, ...]
    block: int

    def base(self) -> Any:
        """The parameter tree (`parameters.entries` describe it) that variants start from."""

    def evaluate(self, variants: Variants, first: int = 0) -> Array:
        """(n, metrics); `first`: the number of the first variant, for seeds and errors.

        Raises `InputError` that names the variant and the key of an impossible value. Any
        division into calls gives the same bits; threads may call it at the same time.
        """

    def trace(self, variants: Variants, every: int = 10, first: int = 0) -> Trajectories:
        """Every `every`-th sample of each run."""


Known = dict[str, Entry]


def table(tree: Any) -> Known:
    """All parameters of a tree by path: made once a job, because it takes a while."""
    return {e.path: e for e in entries(tree)}


def _chosen(every: Known, paths: tuple[str, ...], extra: tuple[str, ...]) -> Known:
    """The parameters at `paths`, by path.

    Raises `InputError` for an unknown path (`extra` are known, too), a path named twice, a
    parameter that is no number.
    """
    found = {}
    for path in paths:
        if paths.count(path) > 1:
            raise InputError("variants, paths", path, "each path once")
        if path in extra:
            continue
        if path not in every:
            raise InputError("variants, paths", path, "the path of one of the job's parameters")
        if not every[path].number:
            value = str(every[path].value)
            raise InputError(f"variants, {path}", value, "a path whose value is one number")
        found[path] = every[path]
    return found


def checked(every: Known, variants: Variants, first: int, extra: tuple[str, ...] = ()) -> Array:
    """The values as (n, k) float64, each within its parameter's bounds; else `InputError`.

    `extra`: paths beside those of the job's tree, which the job checks itself.
    """
    values = np.asarray(variants.values, dtype=np.float64)
    if values.ndim != 2 or values.shape[1] != len(variants.paths):
        accepted = f"(n, {len(variants.paths)}), a column a path"
        raise InputError("variants, shape of the values", values.shape, accepted)
    for path, entry in _chosen(every, variants.paths, extra).items():
        column = values[:, variants.paths.index(path)]
        good = entry.admits(column)
        if not good.all():
            row = int(np.argmin(good))
            spoken = entry.par.spoken(float(column[row]))
            raise InputError(named(first + row, path), spoken, entry.accepted)
    return values


def named(number: int, path: str) -> str:
    """How a variant's parameter is called in an error; variants are counted from 0."""
    return f"variant {number}, {path}"


def seeds(variants: Variants, values: Array, seed: int, first: int) -> list[int]:
    """The noise seed of each variant: its own column `seed`, or `seed` for all."""
    if SEED not in variants.paths:
        return [seed] * len(values)
    column = values[:, variants.paths.index(SEED)]
    good = (column >= 0.0) & (column <= EXACT) & (column == np.floor(column))
    if not good.all():
        row = int(np.argmin(good))
        accepted = f"a whole number from 0 to {EXACT}"
        raise InputError(named(first + row, SEED), float(column[row]), accepted)
    return [int(v) for v in column]


def applied(
    tree: Any, paths: tuple[str, ...], row: Array, number: int, extra: tuple[str, ...] = ()
) -> Any:
    """The tree of one variant; `InputError` with its number for what is impossible together."""
    changes = {
        path: _typed(tree, path, float(value))
        for path, value in zip(paths, row, strict=True)
        if path not in extra
    }
    tree = changed(tree, changes)
    # A machine that cannot work is a result of a study; one that cannot be is a slip.
    check(tree, f"variant {number}", together=False)
    return tree


def _typed(tree: Any, path: str, value: float) -> float | int:
    """`value` as the type that stands at `path`."""
    for name in path.split("."):
        tree = getattr(tree, name)
    return int(value) if isinstance(tree, int) else value
