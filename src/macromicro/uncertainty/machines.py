"""Machines drawn from the table: a Latin hypercube, impossible ones replaced."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.sampling import latin, scale
from macromicro.schema import config, keys
from macromicro.schema.par import changed, entries, value_at
from macromicro.settings import Settings
from macromicro.uncertainty.ranges import FACTOR, SHIFT, VALUE
from macromicro.uncertainty.table import Uncertain

LEAST, MOST = 10, 100_000  # machines of a sample
_ROUNDS = 50


class Sample(NamedTuple):
    amounts: Array  # A row for each machine, each quantity on its own scale
    refused: int  # number of impossible draws
    reason: str  # of the first of those; "" where there is none


def centre(base: Settings, uncertain: Sequence[Uncertain]) -> Array:
    """Amounts of the settings themselves."""
    neutral = {FACTOR: 1.0, SHIFT: 0.0}
    return np.array(
        [
            value_at(base, each.parts[0][0]) if each.kind == VALUE else neutral[each.kind]
            for each in uncertain
        ],
        dtype=float,
    )


def settings_at(base: Settings, uncertain: Sequence[Uncertain], amounts: Array) -> Settings:
    """Unchecked settings of one drawn machine."""
    changes = {}
    for each, amount in zip(uncertain, amounts, strict=True):
        for path, weight in each.parts:
            now = float(value_at(base, path))
            new = {FACTOR: now * amount, SHIFT: now + weight * amount, VALUE: amount}
            changes[path] = float(new[each.kind])
    tree: Settings = changed(base, changes)
    return tree


def refusal(tree: Settings, uncertain: Sequence[Uncertain]) -> str | None:
    """Reason why settings are no machine."""
    varied = {path for each in uncertain for path, _ in each.parts}
    try:
        for entry in entries(tree):
            if entry.path in varied:
                entry.check(entry.value, entry.path)
        config.check(tree, "these settings", together=False)
    except InputError as error:
        return str(error)
    return None


def check_count(samples: int) -> int:
    return keys.whole(samples, LEAST, MOST, "--samples")


def draw(
    base: Settings, uncertain: Sequence[Uncertain], n: int, seed: int | Sequence[int]
) -> Sample:
    """Draw `n` possible machines."""
    # Each of n equal parts of a range is used once; impossible rows are replaced from further
    # hypercubes and counted.
    stream = (seed,) if isinstance(seed, int) else tuple(seed)
    good: list[Array] = []
    refused, reason = 0, ""
    for again in range(_ROUNDS):
        missing = n - len(good)
        if not missing:
            break
        shares = latin(len(uncertain), missing, (*stream, again) if again else seed)
        drawn = [scale(shares[:, k], u.low, u.high) for k, u in enumerate(uncertain)]
        for amounts in np.stack(drawn, axis=1):
            why = refusal(settings_at(base, uncertain, amounts), uncertain)
            if why is None:
                good.append(amounts)
            else:
                refused, reason = refused + 1, reason or why
    if len(good) < n:
        raise ProblemError(
            "--config",
            f"no machine near these settings is possible: {reason}",
            "Change the settings, so that the parameters can vary.",
        )
    return Sample(np.array(good), refused, reason)
