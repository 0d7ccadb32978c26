"""Many designs at once: gains, and benches if asked for, through the batch engine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class Engine:
    """A job of `macromicro.batch` whose gains at `paths` are varied, on one bench or on
    `members`, each with its `values` (members, k) at `member_paths`.

    `evaluations` counts the variants that were computed.
    """

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
        self.variants = 0
        self._paths = (*paths, *member_paths)

    def metrics(self, gains: Array) -> dict[str, Array]:
        """Each metric, (n, members), for gains (n, paths): one call of the engine."""
        from macromicro import batch

        count, each = len(gains), len(self.members)
        rows = np.concatenate(
            (np.repeat(gains, each, axis=0), np.tile(self.members, (count, 1))), axis=1
        )
        blocks = [block for _, block in batch.run(self.job, batch.Variants(self._paths, rows))]
        self.variants += len(rows)
        found = np.concatenate(blocks).reshape(count, each, len(self.names))
        return {name: found[:, :, k] for k, name in enumerate(self.names)}
