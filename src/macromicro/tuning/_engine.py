"""Batches of designs, on one bench or an ensemble, through the batch engine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from macromicro.arrays import Array


class Engine:
    def __init__(
        self,
        job: Any,
        paths: Sequence[str],
        member_paths: Sequence[str] = (),
        values: Array | None = None,
    ) -> None:
        self.job = job
        self.names = tuple(metric.name for metric in job.metrics)
        self.members = np.empty((1, 0)) if values is None else values
        self._paths = (*paths, *member_paths)

    def metrics(self, gains: Array) -> dict[str, Array]:
        from macromicro import batch

        count, each = len(gains), len(self.members)
        rows = np.concatenate(
            (np.repeat(gains, each, axis=0), np.tile(self.members, (count, 1))), axis=1
        )
        variants = batch.Variants(self._paths, rows)
        if len(rows) <= self.job.block:  # no threads for a single block
            found = self.job.evaluate(variants)
        else:
            found = np.concatenate([block for _, block in batch.run(self.job, variants)])
        found = found.reshape(count, each, len(self.names))
        return {name: found[:, :, k] for k, name in enumerate(self.names)}
