"""What a person sees of a sweep: a bar with rate and time left, or plain lines."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

from macromicro.drawing.bar import progress_bar
from macromicro.sweep.results import Written

EVERY = 10.0  # s between plain lines
_BAR = 0.1  # s between moves of the bar


class Shown(NamedTuple):
    """What `run.execute` tells of its progress."""

    begin: Callable[[int, int], None]
    report: Callable[[int, int], None]


class Pace:
    """How far a sweep is, how fast, and how long it will take.

    The rate is of this time, from the first finished block on: before it workers start and
    compile.
    """

    def __init__(self) -> None:
        self.count = self.done = self.impossible = 0
        self._started, self._base = math.nan, 0

    def begin(self, count: int, before: int) -> None:
        """`count` variants, of which `before` are finished already."""
        self.count, self.done = count, before

    def add(self, variants: int, impossible: int) -> None:
        """A block is finished."""
        self.done += variants
        self.impossible += impossible
        if math.isnan(self._started):
            self._started, self._base = time.monotonic(), self.done

    @property
    def rate(self) -> float:
        """Variants per second; NaN before there is one to tell."""
        if self.done == self._base or math.isnan(self._started):
            return math.nan
        return (self.done - self._base) / max(time.monotonic() - self._started, 1e-6)

    def words(self) -> str:
        """The same for a person."""
        text = f"{self.done} of {self.count}"
        if self.impossible:
            text += f", {self.impossible} impossible"
        if not math.isnan(self.rate):
            left = (self.count - self.done) / self.rate
            text += f", {_short(self.rate)}/s, {span(left)} left"
        return text


@contextmanager
def progress() -> Iterator[Shown]:
    """A bar on stderr; a line now and then where that is no terminal."""
    pace = Pace()
    if not sys.stderr.isatty():
        yield _lines(pace)
        return
    with progress_bar() as bar:
        task = bar.add_task("", total=None)
        shown = 0.0

        def begin(count: int, before: int) -> None:
            pace.begin(count, before)
            bar.update(task, total=count, completed=before, description=pace.words())

        def report(variants: int, impossible: int) -> None:
            nonlocal shown
            pace.add(variants, impossible)
            if time.monotonic() - shown >= _BAR or pace.done == pace.count:
                shown = time.monotonic()
                bar.update(task, completed=pace.done, description=pace.words())

        yield Shown(begin, report)


def _lines(pace: Pace) -> Shown:
    told = time.monotonic()

    def begin(count: int, before: int) -> None:
        nonlocal told
        pace.begin(count, before)
        told = time.monotonic()
        print(f"{count} variants, {before} finished before", file=sys.stderr, flush=True)

    def report(variants: int, impossible: int) -> None:
        nonlocal told
        pace.add(variants, impossible)
        if time.monotonic() - told >= EVERY:
            told = time.monotonic()
            print(pace.words(), file=sys.stderr, flush=True)

    return Shown(begin, report)


def ranges(written: Written, units: dict[str, str]) -> Iterator[str]:
    """A line for each metric: its range and mean over the variants."""
    width = max((len(name) for name in units), default=0)
    for name, unit in units.items():
        if name not in written.ranges:
            yield f"{name:{width}}  never a number"
            continue
        least, mean, most = written.ranges[name][1:]
        line = f"{name:{width}}  {least:.6g} to {most:.6g}{_unit(unit)}, mean {mean:.6g}"
        finite = written.ranges[name].finite
        if finite < written.rows:
            line += f", a number in {finite} of {written.rows}"
        yield line


def _unit(unit: str) -> str:
    return "" if unit in ("", "1", "-") else f" {unit}"


def _short(rate: float) -> str:
    return f"{rate:.0f}" if rate >= 10.0 else f"{rate:.2g}"


def span(seconds: float) -> str:
    """A time in words: 12 s, 3 min 20 s, 5 h 10 min, 3.2 days."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    if whole < 172_800:
        return f"{whole // 3600} h {whole % 3600 // 60} min"
    return f"{whole / 86_400:.1f} days"
