"""``macromicro latency``: how well this computer keeps the loop's period."""

from __future__ import annotations

import math
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from macromicro.commands.signals import Signals

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.serve.choosing import AnySettings
    from macromicro.serve.measuring import Cyclic, Latency

STDOUT = Path("-")
PICTURES = (".png", ".pdf", ".svg")
_EVERY = 10.0  # s between plain lines


def latency(
    seconds: Annotated[
        float, typer.Option(metavar="S", min=0.5, max=86400.0, help="Duration of the measurement.")
    ] = 10.0,
    config: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Settings file (.toml).", show_default=False),
    ] = None,
    json: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help=("Write the results as JSON to this file; with - print only JSON."),
            show_default=False,
        ),
    ] = None,
    figure: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Draw the histograms (.png, .pdf or .svg).", show_default=False
        ),
    ] = None,
    cyclictest: Annotated[
        bool, typer.Option("--cyclictest/--no-cyclictest", help="Compare with cyclictest.")
    ] = True,
) -> None:
    """Measure the live loop's wake-up latency and missed periods.

    It runs the simulated machine and also measures the computing time.
    The exit status is 1 if the machine stopped because of missed periods.
    """
    from macromicro.serve import health, measuring
    from macromicro.serve.choosing import load

    settings = load(config)
    if figure is not None:
        _check_figure(figure)
    if json is not None and json != STDOUT:
        _check(json, "--json")
    with Signals() as signals:
        if health.compiler_cache().state != health.OK:
            print("compiling the bench, once, about 10 s", file=sys.stderr, flush=True)
        signals.later()
        with _progress(seconds) as report:

            def go_on(done: float) -> bool:
                report(done)
                return not signals.received

            got = measuring.measure(settings, seconds, go_on)
        other: Cyclic | str = "not asked for"
        if cyclictest and signals.received:
            other = "interrupted before it"
        elif cyclictest:
            rt = "SCHED_FIFO" in got.realtime
            other = measuring.cyclictest(
                min(seconds, 10.0), settings.serve.priority, rt, settings.period
            )
    _give(got, other, settings, json)
    if figure is not None:
        from macromicro.drawing import files

        figure.write_bytes(files.encoded(_draw(got, settings.period), figure.suffix[1:].lower()))
    if signals.received:
        print("macromicro: interrupted; the results cover the time until then", file=sys.stderr)
        raise typer.Exit(signals.status)
    if got.fault is not None:
        words = f"{got.fault.message} {got.fault.evidence}. {got.fault.remedy}"
        print(f"macromicro: {words}", file=sys.stderr)
        raise typer.Exit(1)


def _check_figure(file: Path) -> None:
    from macromicro.errors import ProblemError
    from macromicro.schema.text import printable

    if file.suffix.lower() not in PICTURES:
        found = f"the suffix is {printable(file.suffix)}" if file.suffix else "there is no suffix"
        remedy = f"Give a name that ends in {' or '.join(PICTURES)}."
        raise ProblemError(f"--figure {printable(file, 300)}", found, remedy)
    _check(file, "--figure")


def _check(file: Path, option: str) -> None:
    """Refuse a file that cannot be written; a file made for the trial is removed."""
    from macromicro.errors import ProblemError
    from macromicro.schema.text import printable

    where, accepted = f"{option} {printable(file, 300)}", "Name a file in a folder that exists."
    try:
        new = not os.path.lexists(file)
        if new or file.is_file() or file.is_dir():  # a pipe is left to the one who made it
            file.open("ab").close()
        if new:
            file.unlink()
    except OSError as error:
        raise ProblemError(where, error.strerror or str(error), accepted) from None


@contextmanager
def _progress(seconds: float) -> Iterator[Callable[[float], None]]:
    """A bar on stderr; a line now and then where that is no terminal."""
    if not sys.stderr.isatty():
        shown = -math.inf

        def say(done: float) -> None:
            nonlocal shown
            if time.monotonic() - shown >= _EVERY:
                shown = time.monotonic()
                print(f"{done:.0f} of {seconds:g} s", file=sys.stderr, flush=True)

        yield say
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    columns = TextColumn("{task.percentage:3.0f} %"), BarColumn(bar_width=24)
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=seconds)
        yield lambda done: bar.update(task, completed=done)


def _give(got: Latency, other: Cyclic | str, settings: AnySettings, json: Path | None) -> None:
    from json import dumps

    text = dumps(_as_json(got, other, settings), indent=2) + "\n"
    if json == STDOUT:
        print(text, end="")
        return
    for line in table(got, other, settings):
        print(line)
    if json is not None:
        json.write_text(text, "utf-8")


def table(got: Latency, other: Cyclic | str, settings: AnySettings) -> Iterator[str]:
    from macromicro.serve.measuring import SHARES, quantiles

    heads = [f"{100 * share:g} %" for share in SHARES]
    yield f"{'[us]':22}" + "".join(f"{head:>9}" for head in [*heads, "greatest"])
    for name, times in (("late at wake-up", got.late), ("work in a period", got.work)):
        yield f"{name:22}" + "".join(f"{1e6 * x:9.0f}" for x in quantiles(times))
    if not isinstance(other, str):
        yield (
            f"{'cyclictest':22}mean {1e6 * other.mean:.0f}, greatest {1e6 * other.most:.0f} "
            f"({other.command})"
        )
    else:
        yield f"{'cyclictest':22}{other}"
    window = settings.serve.miss_window
    yield (
        f"missed periods: {got.missed} of {got.periods}; at most {got.share:.2%} in {window:g} s, "
        f"allowed {settings.serve.miss_share:.0%}"
    )
    yield f"emergency stop: the rig was switched off after {1e3 * got.emergency:.2f} ms"
    yield f"loop: {got.realtime}"


def _as_json(got: Latency, other: Cyclic | str, settings: AnySettings) -> dict[str, Any]:
    import numpy as np

    from macromicro.serve.measuring import SHARES, quantiles

    def times(values: Any) -> dict[str, Any]:
        names = [*(f"p{100 * share:g}_s" for share in SHARES), "greatest_s"]
        counts, edges = np.histogram(values, bins=_edges(values))
        return {
            **{n: _number(x) for n, x in zip(names, quantiles(values), strict=True)},
            "histogram": {"edges_s": edges.tolist(), "counts": counts.tolist()},
        }

    return {
        "late": times(got.late),
        "work": times(got.work),
        "periods": got.periods,
        "missed": got.missed,
        "greatest_share": got.share,
        "allowed_share": settings.serve.miss_share,
        "window_s": settings.serve.miss_window,
        "emergency_stop_s": _number(got.emergency),
        "loop": got.realtime,
        "fault": got.fault.message if got.fault is not None else None,
        "cyclictest": other if isinstance(other, str) else other._asdict(),
    }


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None  # JSON has no NaN


def _edges(values: Any) -> Any:
    """Ten bins per decade, from 1 us to beyond the largest value."""
    import numpy as np

    most = max(float(values.max()) if len(values) else 0.0, 1e-5)
    decades = int(np.ceil(np.log10(most / 1e-6)))
    return np.concatenate(
        [
            [min(0.0, float(values.min())) if len(values) else 0.0],
            np.logspace(-6, decades - 6, 10 * decades + 1),
        ]
    )


def _draw(got: Latency, period: float) -> Figure:
    from macromicro.drawing.style import BLUE, GREEN, RED, finish, new

    figure, axes = new(3.6, 1, 2)
    shown = (("(a) latency at wake-up", got.late, BLUE), ("(b) work in a period", got.work, GREEN))
    for ax, (title, values, colour) in zip(axes[0], shown, strict=True):
        edges = _edges(values)[1:]
        ax.hist(values.clip(min=edges[0]) * 1e6, bins=edges * 1e6, color=colour)
        ax.axvline(1e6 * period, color=RED, linestyle="--", label="one period")
        ax.set(xscale="log", yscale="log", ylim=(0.7, None))
        finish(ax, title, "time [us]", "periods", legend=True)
    return figure
