"""Machines drawn from the table: a Latin hypercube, impossible ones replaced.

A machine is a row of amounts, one for each uncertain quantity on its own scale; `settings_at`
makes settings of it, `columns` what a batch varies.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.sampling import latin, scaled
from macromicro.schema import config, keys
from macromicro.schema.par import changed, entries, value_at
from macromicro.settings import Settings
from macromicro.uncertainty.table import FACTOR, SHIFT, VALUE, Uncertain

LEAST, MOST = 10, 100_000  # machines of a sample
_ROUNDS = 50


class Sample(NamedTuple):
    """Machines that were drawn.

    Attributes
    ----------
    amounts : ndarray, shape (n, k)
        A row for each machine, each quantity on its own scale.
    refused : int
        How many were drawn that no machine can be.
    reason : str
        Of the first of those; "" where there is none.
    """

    amounts: Array
    refused: int
    reason: str


def centre(base: Settings, uncertain: Sequence[Uncertain]) -> Array:
    """Tell where the settings themselves stand.

    Parameters
    ----------
    base : Settings
        The nominal machine.
    uncertain : sequence of Uncertain
        k rows of the table.

    Returns
    -------
    ndarray, shape (k,)
        Amounts, each on its quantity's scale.
    """
    neutral = {FACTOR: 1.0, SHIFT: 0.0}
    return np.array(
        [
            value_at(base, each.parts[0][0]) if each.kind == VALUE else neutral[each.kind]
            for each in uncertain
        ],
        dtype=float,
    )


def settings_at(base: Settings, uncertain: Sequence[Uncertain], amounts: Array) -> Settings:
    """Make the settings of one machine; they are not checked yet.

    Parameters
    ----------
    base : Settings
        The nominal machine.
    uncertain : sequence of Uncertain
        k rows of the table, no two of which move the same parameter.
    amounts : array_like, shape (k,)
        One row of a `Sample`.

    Returns
    -------
    Settings
        `base` with these parameters, and what is derived from them.
    """
    changes = {}
    for each, amount in zip(uncertain, amounts, strict=True):
        for path, weight in each.parts:
            now = float(value_at(base, path))
            new = {FACTOR: now * amount, SHIFT: now + weight * amount, VALUE: amount}
            changes[path] = float(new[each.kind])
    tree: Settings = changed(base, changes)
    return tree


def refusal(tree: Settings, uncertain: Sequence[Uncertain]) -> str | None:
    """Say why settings cannot be a machine.

    Parameters
    ----------
    tree : Settings
        Of one machine.
    uncertain : sequence of Uncertain
        The rows that were varied; their parameters' bounds are checked.

    Returns
    -------
    str or None
        A parameter out of its bounds, or what cannot physically be so; None where they can.
    """
    varied = {path for each in uncertain for path, _ in each.parts}
    try:
        for entry in entries(tree):
            if entry.path in varied:
                entry.check(entry.value, entry.path)
        config.check(tree, "these settings", together=False)
    except InputError as error:
        return str(error)
    return None


def counted(samples: int) -> int:
    """How many machines are asked for.

    Parameters
    ----------
    samples : int
        By a person.

    Returns
    -------
    int
        As it is.

    Raises
    ------
    InputError
        Below `LEAST` or above `MOST`.
    """
    return keys.whole(samples, LEAST, MOST, "--samples")


def draw(
    base: Settings, uncertain: Sequence[Uncertain], n: int, seed: int | Sequence[int]
) -> Sample:
    """Draw `n` possible machines.

    Each quantity's range is cut into n equal parts, and each part is used once. A row that is
    no machine is replaced from further hypercubes and counted.

    Parameters
    ----------
    base : Settings
        The nominal machine.
    uncertain : sequence of Uncertain
        k rows of the table.
    n : int
        How many, 1 or more.
    seed : int or sequence of int
        Of the draw.

    Returns
    -------
    Sample
        With amounts (n, k).

    Raises
    ------
    InputError
        Hardly any combination is possible around these settings.
    """
    stream = (seed,) if isinstance(seed, int) else tuple(seed)
    good: list[Array] = []
    refused, reason = 0, ""
    for again in range(_ROUNDS):
        missing = n - len(good)
        if not missing:
            break
        shares = latin(len(uncertain), missing, (*stream, again) if again else seed)
        drawn = [scaled(shares[:, k], u.low, u.high) for k, u in enumerate(uncertain)]
        for amounts in np.stack(drawn, axis=1):
            why = refusal(settings_at(base, uncertain, amounts), uncertain)
            if why is None:
                good.append(amounts)
            else:
                refused, reason = refused + 1, reason or why
    if len(good) < n:
        raise InputError("--config", reason, "settings around which the parameters can vary")
    return Sample(np.array(good), refused, reason)


def columns(
    uncertain: Sequence[Uncertain], trees: Sequence[Settings]
) -> tuple[tuple[str, ...], Array]:
    """Give what settings have at the parameters that are varied, as a batch takes it.

    Parameters
    ----------
    uncertain : sequence of Uncertain
        The rows that were varied.
    trees : sequence of Settings
        n machines.

    Returns
    -------
    paths : tuple of str
        Dotted paths within the settings.
    values : ndarray, shape (n, paths)
        In the units that the parameters are stored in.
    """
    paths = tuple(path for each in uncertain for path, _ in each.parts)
    return paths, np.array([[float(value_at(tree, path)) for path in paths] for tree in trees])


def on_model(uncertain: Sequence[Uncertain], amounts: Array, quantity: str) -> Array:
    """Give the factor that each machine has on a quantity of the macro-stage's model.

    Parameters
    ----------
    uncertain : sequence of Uncertain
        k rows of the table, all of them factors where they name the model.
    amounts : ndarray, shape (n, k)
        n machines.
    quantity : str
        `table.GAIN`, `table.POLE` or `table.WIDTH`.

    Returns
    -------
    ndarray, shape (n,)
        1 for the nominal machine.
    """
    powers = np.array([dict(each.model).get(quantity, 0.0) for each in uncertain])
    found: Array = np.prod(np.where(powers == 0.0, 1.0, amounts) ** powers, axis=1)
    return found
