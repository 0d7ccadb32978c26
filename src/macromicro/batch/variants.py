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
    """Read the shipped Hall calibration, once.

    Returns
    -------
    Calibration
        The table.
    """
    return calibration.shipped()


class Variants(NamedTuple):
    """Values at paths of a job's parameter tree.

    Attributes
    ----------
    paths : tuple of str
        k dotted paths.
    values : ndarray, shape (n, k)
        In the units that the parameters are stored in.
    """

    paths: tuple[str, ...]
    values: Array


class Metric(NamedTuple):
    """A number that a run gives.

    Attributes
    ----------
    name : str
        One word.
    unit : str
        As in `macromicro.units`, "" for none.
    meaning : str
        For a person.
    """

    name: str
    unit: str
    meaning: str


class Trajectories(NamedTuple):
    """The courses of runs; one that ended early is NaN from there on.

    Attributes
    ----------
    t : ndarray, shape (rows,)
        Time [s].
    columns : dict of str to ndarray, shape (n, rows)
        By name.
    units : dict of str to str
        By the same names.
    """

    t: Array
    columns: dict[str, Array]
    units: dict[str, str]


class Job(Protocol):
    """What turns variants into metrics.

    Attributes
    ----------
    name : str
        As in `batch.JOBS`.
    metrics : tuple of Metric
        What `evaluate` gives.
    block : int
        How many variants are computed together.
    """

    name: str
    metrics: tuple[Metric, ...]
    block: int

    def base(self) -> Any:
        """Give the parameter tree that variants start from.

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
            With variant and key: an impossible value.
        """

    def trace(self, variants: Variants, every: int = 10, first: int = 0) -> Trajectories:
        """Give each run's course.

        Parameters
        ----------
        variants : Variants
            n of them.
        every : int
            Every so many samples.
        first : int
            Number of the first variant, for seeds and errors.

        Returns
        -------
        Trajectories
            Of all runs.
        """


Known = dict[str, Entry]


def table(tree: Any) -> Known:
    """List all parameters of a tree by path: made once a job, because it takes a while.

    Parameters
    ----------
    tree : Any
        A set of parameters.

    Returns
    -------
    dict of str to Entry
        By dotted path.
    """
    return {e.path: e for e in entries(tree)}


def _chosen(every: Known, paths: tuple[str, ...], extra: tuple[str, ...]) -> Known:
    """The parameters at `paths`, by path.

    Raises
    ------
    InputError
        An unknown path (`extra` are known, too), a path named twice, a parameter that is no number.
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
    """Check variants' values.

    Parameters
    ----------
    every : dict of str to Entry
        The job's parameters, by path.
    variants : Variants
        n of them.
    first : int
        Number of the first one, for errors.
    extra : tuple of str
        Paths beside those of the job's tree, which the job checks itself.

    Returns
    -------
    ndarray, shape (n, k)
        The values, each within its parameter's bounds.

    Raises
    ------
    InputError
        A wrong shape, an unknown path, one named twice, a value out of its bounds.
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
    """Say how a variant's parameter is called in an error.

    Parameters
    ----------
    number : int
        Of the variant, from 0.
    path : str
        Of the parameter.

    Returns
    -------
    str
        Where.
    """
    return f"variant {number}, {path}"


def seeds(variants: Variants, values: Array, seed: int, first: int) -> list[int]:
    """Give the noise seed of each variant.

    Parameters
    ----------
    variants : Variants
        n of them, perhaps with a column `SEED`.
    values : ndarray, shape (n, k)
        Theirs, checked.
    seed : int
        Of all, where there is no such column.
    first : int
        Number of the first one, for errors.

    Returns
    -------
    list of int
        n seeds.

    Raises
    ------
    InputError
        With the variant: no whole number from 0 to 2^53.
    """
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
    """Make the tree of one variant.

    Parameters
    ----------
    tree : Any
        That it starts from.
    paths : tuple of str
        k dotted paths.
    row : ndarray, shape (k,)
        Its values, checked.
    number : int
        Of the variant, for errors.
    extra : tuple of str
        Paths beside those of the tree.

    Returns
    -------
    Any
        The tree with these values, and what is derived from them.

    Raises
    ------
    InputError
        With the variant's number: what is impossible together.
    """
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
