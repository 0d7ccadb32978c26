"""``macromicro doctor --seconds``: how well this computer keeps the loop's period."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from macromicro.commands.group import announce_compiling
from macromicro.commands.signals import Signals
from macromicro.commands.streams import say

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.serve.measuring import Latency
    from macromicro.serve.settings import AnySettings

PICTURES = (".png", ".pdf", ".svg")


def measure(config: Path | None, seconds: float, figure: Path | None, *, as_json: bool) -> None:
    """Run the simulated machine for some seconds and print how punctual its loop was."""
    from json import dumps

    from macromicro.drawing.bar import progress
    from macromicro.serve import health, measuring
    from macromicro.serve.settings import load

    settings = load(config)
    if figure is not None:
        _check_figure(figure)
    with Signals() as signals:
        announce_compiling(health.compiler_cache().state == health.OK)
        signals.later()
        with progress("timing", "s") as pace:
            pace.begin(round(seconds))

            def go_on(done: float) -> bool:
                pace.reach(round(done), round(seconds))
                return not signals.received

            got = measuring.measure(settings, seconds, go_on)
    if as_json:
        print(dumps(_as_json(got, settings), indent=2))
    else:
        print(*table(got, settings), sep="\n")
    if figure is not None:
        from macromicro.drawing import files

        figure.write_bytes(files.encode(_draw(got, settings.period), figure.suffix[1:].lower()))
    if signals.received:
        say("interrupted; the results cover the time until then")
        raise typer.Exit(signals.status)
    if got.fault is not None:
        words = f"{got.fault.message} {got.fault.evidence}. {got.fault.remedy}"
        say(words)
        raise typer.Exit(1)


def _check_figure(file: Path) -> None:
    """Refuse a file that cannot be written; a file made for the trial is removed."""
    from macromicro.errors import ProblemError
    from macromicro.schema.text import printable

    if file.suffix.lower() not in PICTURES:
        found = f"the suffix is {printable(file.suffix)}" if file.suffix else "there is no suffix"
        remedy = f"Give a name that ends in {' or '.join(PICTURES)}."
        raise ProblemError(f"--figure {printable(file, 300)}", found, remedy)
    try:
        new = not os.path.lexists(file)
        if new or file.is_file() or file.is_dir():  # a pipe is left to the one who made it
            file.open("ab").close()
        if new:
            file.unlink()
    except OSError as error:
        remedy = "Name a file in a folder that exists."
        where = f"--figure {printable(file, 300)}"
        raise ProblemError(where, error.strerror or str(error), remedy) from None


def table(got: Latency, settings: AnySettings) -> Iterator[str]:
    from macromicro.serve.measuring import SHARES, quantiles

    heads = [f"{100 * share:g} %" for share in SHARES]
    yield f"{'[us]':22}" + "".join(f"{head:>9}" for head in [*heads, "greatest"])
    for name, times in (("late at wake-up", got.late), ("work in a period", got.work)):
        yield f"{name:22}" + "".join(f"{1e6 * x:9.0f}" for x in quantiles(times))
    window = settings.serve.miss_window
    yield (
        f"missed periods: {got.missed} of {got.periods}; at most {got.share:.2%} in {window:g} s, "
        f"allowed {settings.serve.miss_share:.0%}"
    )
    yield f"emergency stop: the rig was switched off after {1e3 * got.emergency:.2f} ms"
    yield f"loop: {got.realtime}"


def _as_json(got: Latency, settings: AnySettings) -> dict[str, Any]:
    import numpy as np

    from macromicro.schema.text import plain
    from macromicro.serve.measuring import SHARES, quantiles

    def times(values: Any) -> dict[str, Any]:
        names = [*(f"p{100 * share:g}_s" for share in SHARES), "greatest_s"]
        counts, edges = np.histogram(values, bins=_edges(values))
        return {
            **dict(zip(names, quantiles(values), strict=True)),
            "histogram": {"edges_s": edges.tolist(), "counts": counts.tolist()},
        }

    found: dict[str, Any] = plain(
        {
            "late": times(got.late),
            "work": times(got.work),
            "periods": got.periods,
            "missed": got.missed,
            "greatest_share": got.share,
            "allowed_share": settings.serve.miss_share,
            "window_s": settings.serve.miss_window,
            "emergency_stop_s": got.emergency,
            "loop": got.realtime,
            "fault": got.fault.message if got.fault is not None else None,
        }
    )
    return found


def _edges(values: Any) -> Any:
    """Ten bins per decade, from 1 us to beyond the largest value."""
    import numpy as np

    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)
    decades = int(np.ceil(np.log10(max(high, 1e-5) / 1e-6)))
    return np.concatenate([[min(0.0, low)], np.logspace(-6, decades - 6, 10 * decades + 1)])


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
