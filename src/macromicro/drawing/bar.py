"""Progress of a long computation on stderr: a bar in a terminal, else occasional lines."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from macromicro.drawing.console import progress_bar

EVERY = 10.0  # s between plain lines
_BAR = 0.1  # s between moves of the bar


class Pace:
    """Progress, rate and remaining time of a computation.

    The rate counts from the first report on, as workers start and compile before it.
    """

    def __init__(
        self, title: str = "", unit: str = "", show: Callable[[str | None], None] = lambda _: None
    ) -> None:
        self.count = self.done = self.infeasible = 0
        self.remark = ""
        self._title, self._unit, self._show = title, unit, show
        self._started, self._base = math.nan, 0

    def begin(self, count: int, before: int | None = None) -> None:
        self.count, self.done = count, before or 0
        earlier = "" if before is None else f", {before} finished before"
        self._show(f"{self._title}: {count} {self._unit}{earlier}")

    def add(self, done: int, infeasible: int = 0) -> None:
        self.infeasible += infeasible
        self.reach(self.done + done, self.count, self.remark)

    def reach(self, done: int, count: int, remark: str = "") -> None:
        if not self.count:
            self.begin(count)
        self.done, self.remark = done, remark
        if math.isnan(self._started):
            self._started, self._base = time.monotonic(), done
        self._show(None)

    @property
    def rate(self) -> float:
        """Items per second; NaN before there are any."""
        if self.done == self._base or math.isnan(self._started):
            return math.nan
        return (self.done - self._base) / max(time.monotonic() - self._started, 1e-6)

    def words(self) -> str:
        text = f"{self.done} of {self.count}"
        if self.infeasible:
            text += f", {self.infeasible} infeasible"
        if self.remark:
            text += f", {self.remark}"
        if not math.isnan(self.rate):
            left = (self.count - self.done) / self.rate
            text += f", {_short(self.rate)}/s, {span(left)} left"
        return text


@contextmanager
def progress(title: str, unit: str) -> Iterator[Pace]:
    """Show the progress of a computation during the block."""
    shown = 0.0
    if not sys.stderr.isatty():

        def line(first: str | None) -> None:
            nonlocal shown
            if first is not None or time.monotonic() - shown >= EVERY:
                shown = time.monotonic()
                print(first or pace.words(), file=sys.stderr, flush=True)

        pace = Pace(title, unit, line)
        yield pace
        return
    with progress_bar() as bar:
        task = bar.add_task(title, total=None)

        def move(first: str | None) -> None:
            nonlocal shown
            ended = pace.done == pace.count
            if first is not None or ended or time.monotonic() - shown >= _BAR:
                shown = time.monotonic()
                bar.update(
                    task, total=pace.count, completed=pace.done, description=first or pace.words()
                )

        pace = Pace(title, unit, move)
        yield pace


def _short(rate: float) -> str:
    return f"{rate:.0f}" if rate >= 10.0 else f"{rate:.2g}"


def span(seconds: float) -> str:
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    if whole < 172_800:
        return f"{whole // 3600} h {whole % 3600 // 60} min"
    return f"{whole / 86_400:.1f} days"
