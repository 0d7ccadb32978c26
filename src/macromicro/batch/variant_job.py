"""Jobs that run each variant of a machine's settings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.batch.variants import SEED, Metric, Variants, apply, check_rows, seeds
from macromicro.batch.variants import table as parameters
from macromicro.control.macro import NAMES
from macromicro.errors import InputError
from macromicro.runs.setup import Setup
from macromicro.schema.config import check
from macromicro.settings import choose


class VariantJob:
    """Runs each variant by itself.

    The path `beside` is an option of the job that a variant may set for itself.

    All other variants share the job's seed, so that they differ only by their parameters.
    """

    name: str
    metrics: tuple[Metric, ...]  # of a run
    block = 1
    beside = SEED
    refuses = False  # whether settings that no file could have are an error

    def __init__(self, settings: Any, seed: int = 0) -> None:
        if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
            raise InputError("seed", seed, "a whole number from 0")
        self._settings, self._seed = settings, seed
        self._known = parameters(settings)

    def base(self) -> Any:
        return self._settings

    def loaded(self, path: Path | None, law: str | None) -> Any:
        """The job's settings with those of a file, under a law."""
        return choose(self._settings, path, law)

    def laws(self) -> list[str]:
        """Names of laws of other packages, whose sources are part of what is run."""
        law = self._settings.controller.macro_law
        return [] if law in NAMES else [law]

    def kinds(self) -> list[Any]:
        """Kinds of stages of other packages, likewise."""
        return []

    def prepare(self) -> None:
        """What is made once, before threads ask for it."""

    def one(self, settings: Any, seed: Any) -> Sequence[float]:
        """The metrics of a run under other settings than the job's."""
        raise NotImplementedError

    def _own(self, variants: Variants, values: Array, first: int) -> Sequence[Any]:
        """The value `beside` the parameters of each variant."""
        return seeds(variants, values, self._seed, first)

    def _each(self, variants: Variants, first: int) -> Iterator[tuple[Any, Any]]:
        """The settings of each variant, and its value `beside`."""
        values = check_rows(self._known, variants, first, (self.beside,))
        own = self._own(variants, values, first)
        for k, row in enumerate(values):
            tree = apply(self._settings, variants.paths, row, first + k, (self.beside,))
            if self.refuses:
                check(tree, f"variant {first + k}")
            yield tree, own[k]

    def evaluate(self, variants: Variants, first: int = 0) -> Array:
        self.prepare()
        found = [self.one(*each) for each in self._each(variants, first)]
        return np.array(found, dtype=np.float64).reshape(len(found), len(self.metrics))


class MachineJob(VariantJob):
    """A machine with a programme, as `macromicro run` runs it, without a recording."""

    def setup(self, settings: Any) -> Setup:
        """The machine under settings with its programme."""
        raise NotImplementedError

    def one(self, settings: Any, seed: int) -> Any:
        return self.setup(settings).trial(seed)
