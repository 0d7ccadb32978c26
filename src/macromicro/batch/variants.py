"""Variants of a job: values at dotted paths of its parameter tree, checked and applied."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.schema.config import check
from macromicro.schema.keys import EXACT
from macromicro.schema.par import Entry, changed, entries

SEED = "seed"  # beside the tree's paths: the seed of the measurement noise


class Variants(NamedTuple):
    """Values at paths of a job's parameter tree."""

    paths: tuple[str, ...]  #: k dotted paths
    values: Array  #: in the units that the parameters are stored in


class Metric(NamedTuple):
    """A metric of a run."""

    name: str  #: one word
    unit: str  #: as in `macromicro.units`, "" for none
    meaning: str  #: for a person


# What every run has first and last. A code is a name, not a quantity: nothing is ranked or
# limited by it.
FAULT = Metric("fault", "", "stops by the guard")
CODE = Metric("fault_code", "", "which fault stopped the run, 0 for none")


class Job(Protocol):
    """A job that turns variants into metrics."""

    name: str  #: as in `batch.JOBS`
    metrics: tuple[Metric, ...]  #: what `evaluate` gives
    block: int  #: how many variants are computed together

    def base(self) -> Any:
        """The parameter tree that variants start from.

        Returns
        -------
        Any
            A set of parameters, which `schema.par.entries` lists.
        """

    def evaluate(self, variants: Variants, first: int = 0) -> Array:
        """Evaluate variants.

        Any division into calls gives the same bits; threads may call it at the same time.

        Parameters
        ----------
        variants : Variants
            n of them.
        first : int
            Number of the first one, for seeds and errors.

        Returns
        -------
        ndarray, shape (n, metrics)
            As `metrics`.

        Raises
        ------
        InputError
            An impossible value; names variant and key.
        """


Known = dict[str, Entry]


def table(tree: Any) -> Known:
    """All parameters of a tree by path, listed once a job, as it takes a while."""
    return {e.path: e for e in entries(tree)}


def _choose(every: Known, paths: tuple[str, ...], extra: tuple[str, ...]) -> Known:
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


def check_rows(every: Known, variants: Variants, first: int, extra: tuple[str, ...] = ()) -> Array:
    values = np.asarray(variants.values, dtype=np.float64)
    if values.ndim != 2 or values.shape[1] != len(variants.paths):
        accepted = f"(n, {len(variants.paths)}), a column a path"
        raise InputError("variants, shape of the values", values.shape, accepted)
    for path, entry in _choose(every, variants.paths, extra).items():
        column = values[:, variants.paths.index(path)]
        good = entry.admits(column)
        if not good.all():
            row = int(np.argmin(good))
            spoken = entry.par.spoken(float(column[row]))
            raise InputError(variant_name(first + row, path), spoken, entry.accepted)
    return values


def variant_name(number: int, path: str) -> str:
    return f"variant {number}, {path}"


def seeds(variants: Variants, values: Array, seed: int, first: int) -> list[int]:
    if SEED not in variants.paths:
        return [seed] * len(values)
    column = values[:, variants.paths.index(SEED)]
    good = (column >= 0.0) & (column <= EXACT) & (column == np.floor(column))
    if not good.all():
        row = int(np.argmin(good))
        accepted = f"a whole number from 0 to {EXACT}"
        raise InputError(variant_name(first + row, SEED), float(column[row]), accepted)
    return [int(v) for v in column]


def apply(
    tree: Any, paths: tuple[str, ...], row: Array, number: int, extra: tuple[str, ...] = ()
) -> Any:
    changes = {
        path: _as_type(tree, path, float(value))
        for path, value in zip(paths, row, strict=True)
        if path not in extra
    }
    tree = changed(tree, changes)
    # A machine that cannot work is a result of a study; one that cannot be is a slip.
    check(tree, f"variant {number}", together=False)
    return tree


def _as_type(tree: Any, path: str, value: float) -> float | int:
    """`value` in the type of the parameter at `path`."""
    for name in path.split("."):
        tree = getattr(tree, name)
    return int(value) if isinstance(tree, int) else value
