"""The sample: a Latin hypercube over the uncertain parameters, impossible machines replaced."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from macromicro.errors import InputError
from macromicro.robustness.uncertain import Uncertain, applied, nominal, refusal
from macromicro.settings import Settings

LEAST, MOST = 10, 100_000
_ROUNDS = 50

Floats = NDArray[np.float64]


class Sample(NamedTuple):
    """`amounts` (n, k) on each parameter's own scale; `refused`: how many were drawn that no
    machine can be, with the reason of the first."""

    amounts: Floats
    refused: int
    reason: str


def settings_at(base: Settings, uncertain: Sequence[Uncertain], amounts: Floats) -> Settings:
    """The settings of one row of amounts; not yet checked."""
    tree = base
    for each, amount in zip(uncertain, amounts, strict=True):
        tree = applied(tree, each, float(amount))
    return tree


def centre(base: Settings, uncertain: Sequence[Uncertain]) -> Floats:
    """Where the settings themselves stand, on each parameter's scale."""
    return np.array([nominal(each, base) for each in uncertain])


def latin_hypercube(base: Settings, uncertain: Sequence[Uncertain], n: int, seed: int) -> Sample:
    """`n` possible machines.

    Each parameter's range is cut into n equal parts, and each part is used once. A row that
    is no machine (a parameter's bounds, the settings' `problems()`) is replaced from further
    hypercubes and counted. Raises `InputError` where hardly any row is possible.
    """
    from scipy.stats import qmc

    generator = np.random.default_rng(seed)
    low = np.array([u.low for u in uncertain])
    high = np.array([u.high for u in uncertain])
    good: list[Floats] = []
    refused, reason = 0, ""
    for _ in range(_ROUNDS):
        missing = n - len(good)
        if not missing:
            break
        drawn = qmc.LatinHypercube(len(uncertain), seed=generator).random(missing)
        for amounts in low + drawn * (high - low):
            why = refusal(settings_at(base, uncertain, amounts))
            if why is None:
                good.append(amounts)
            else:
                refused, reason = refused + 1, reason or why
    if len(good) < n:
        raise InputError("--config", reason, "settings around which the parameters can vary")
    return Sample(np.array(good), refused, reason)
