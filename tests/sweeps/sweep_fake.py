"""A small batch job for tests, whose evaluations can be counted, slowed, and end their worker.

As a script: ``python sweep_fake.py SPEC.toml OUT [--workers N] [--resume] [--overwrite]``, the
command with this job.
"""

from __future__ import annotations

import argparse
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np
import numpy.typing as npt
import typer

from macromicro.batch import Metric, Variants
from macromicro.errors import InputError
from macromicro.schema.par import Par

if TYPE_CHECKING:
    from macromicro.sweeps.run import Outcome

Array = npt.NDArray[np.float64]
Make = Callable[..., Path]
FACTORY = "sweep_fake:job"


class Part(NamedTuple):
    mass: Annotated[float, Par("kg", "moving mass", lo=0.0, hi=10.0, positive=True)] = 1.0
    force: Annotated[float, Par("N", "load", shown="mN", lo=-5.0, hi=5.0)] = 0.5


class Tree(NamedTuple):
    part: Part = Part()
    gain: Annotated[float, Par("", "gain", hi=1e6)] = 2.0
    teeth: Annotated[int, Par("", "teeth", lo=1, hi=99)] = 20
    law: Annotated[str, Par("", "law", choices=("a", "b"))] = "a"


class Fake:
    """Products of the parameters. `log`: file that gets "first count" of each evaluation;
    `delay` [s] per call; `marks`: folder where each variant of `fatal` ends its worker once, or
    always without it; variants below `least` gain are impossible, those above `worst` a bug."""

    name = "fake"
    metrics = (
        Metric("product", "kg", "all parameters multiplied"),
        Metric("noise", "", "a number that the index decides"),
        Metric("often", "1", "NaN where the index divides by 7"),
    )

    def __init__(
        self,
        block: int = 4,
        log: str = "",
        delay: float = 0.0,
        fatal: int = -1,
        marks: str = "",
        least: float = -1e9,
        worst: float = 1e9,
    ) -> None:
        self.block = block
        self.log, self.delay, self.fatal, self.marks = log, delay, fatal, marks
        self.least, self.worst = least, worst

    def base(self) -> Tree:
        return Tree()

    def evaluate(self, variants: Variants, first: int = 0) -> Array:
        values = variants.values
        count = len(values)
        time.sleep(self.delay)
        self._end(first, count)
        if "gain" in variants.paths:
            gain = values[:, variants.paths.index("gain")]
            if gain.min() < self.least:
                raise InputError("gain", float(gain.min()), f"{self.least} or more")
            if gain.max() > self.worst:
                raise ValueError("a bug of the job")
        index = np.arange(first, first + count, dtype=np.float64)
        often = np.where(index % 7 == 0, np.nan, index)
        if self.log:
            file = os.open(self.log, os.O_CREAT | os.O_APPEND | os.O_WRONLY)
            os.write(file, f"{first} {count}\n".encode())
            os.close(file)
        return np.stack([values.prod(axis=1), np.sin(index), often], axis=1)

    def _end(self, first: int, count: int) -> None:
        if not first <= self.fatal < first + count:
            return
        if self.marks:
            mark = Path(self.marks) / str(self.fatal)
            if mark.exists():
                return
            mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)


def swept(
    spec: Path, out: Path, workers: int | None = 1, stop: int | None = None, **how: object
) -> Outcome:
    """A whole sweep from this process; `stop`: end after so many variants."""
    from macromicro.sweeps import run

    done = 0

    def report(variants: int, infeasible: int) -> None:
        nonlocal done
        done += variants

    request = run.Request(spec, out, workers, factory=FACTORY, **how)  # type: ignore[arg-type]
    ready = run.check(request)
    return run.execute(
        ready, lambda *_: None, report, lambda: stop is not None and done >= stop, [("a", "b")]
    )


def evaluated(log: Path) -> list[int]:
    """Every index that was computed, as often as it was."""
    lines = [line.split() for line in log.read_text().splitlines()] if log.exists() else []
    return [i for first, count in lines for i in range(int(first), int(first) + int(count))]


def job(name: str, **options: object) -> Fake:
    if name != "fake":
        raise InputError("job", name, "fake")
    return Fake(**options)  # type: ignore[arg-type]


def main() -> None:
    from macromicro.commands import sweep
    from macromicro.commands.signals import Signals
    from macromicro.sweeps.run import Request

    parser = argparse.ArgumentParser()
    parser.add_argument("spec", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--resume", action="store_true")
    parser.add_argument("--overwrite", action="store_true")
    told = parser.parse_args()
    request = Request(
        told.spec, told.out, told.workers, None, told.resume, told.overwrite, "sweep_fake:job"
    )
    try:
        with Signals() as signals:
            sweep._sweep(request, signals)
    except typer.Exit as end:
        raise SystemExit(end.exit_code) from None


if __name__ == "__main__":
    main()
