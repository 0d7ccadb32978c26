"""Many designs at once: gains, and benches if asked for, through the batch engine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from macromicro.arrays import Array


class Engine:
    """A job of `macromicro.batch` whose gains are varied, on one bench or on several.

    Parameters
    ----------
    job : Job
        The batch's.
    paths : sequence of str
        Of the gains.
    member_paths : sequence of str
        Of what the benches differ by.
    values : ndarray, shape (members, member_paths), optional
        Each bench's; one bench, the job's, without it.
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
        self._paths = (*paths, *member_paths)

    def metrics(self, gains: Array) -> dict[str, Array]:
        """Compute each metric, by one call of the engine.

        Parameters
        ----------
        gains : ndarray, shape (n, paths)
            Of n designs.

        Returns
        -------
        dict of str to ndarray, shape (n, members)
            By the metric's name.
        """
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
