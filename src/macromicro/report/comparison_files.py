"""The folder of a comparison: compare.json, a zoomable page, figures of columns and moves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro import traces
from macromicro.drawing import files
from macromicro.drawing.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, RED, finish, new
from macromicro.report import zoomable
from macromicro.report.comparison import QUANTITIES, Comparison, content
from macromicro.report.run import as_json
from macromicro.runs import folder
from macromicro.schema.text import write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

JSON = "compare.json"
OVERLAY, MOVES, COLUMNS = "overlay", "moves", "columns"
PAGE = f"{OVERLAY}.html"
BYTES = 20_000_000 + zoomable.BYTES
_PANELS = 6  # of a figure
_MOST = 40  # figures of columns
_COLOURS = (BLUE, RED, GREEN, PURPLE, BLACK, ORANGE)
_MARKERS = "o^sDvx"
FILES = (
    JSON,
    PAGE,
    *files.names((OVERLAY, MOVES, *(f"{COLUMNS}-{k}" for k in range(1, _MOST + 1)))),
)


def write(out: Path, found: Comparison, kinds: Sequence[str] = files.DEFAULT) -> None:
    """Write everything, all of it or nothing; an earlier comparison there is replaced."""
    with folder.staged(out, remove=FILES) as place:
        write_text(place / JSON, as_json(content(found)))
        recordings = [side.recording for side in found.sides]
        text = zoomable.page(recordings, labels=[side.name for side in found.sides])
        write_text(place / PAGE, text)
        for name, figure in draw(found) if kinds else ():
            files.save(figure, place, name, kinds)


def draw(found: Comparison) -> Iterator[tuple[str, Figure]]:
    """Draw the main columns, the moves, and all other columns that vary."""
    recordings = [side.recording for side in found.sides]
    labels = [side.name for side in found.sides]
    main = traces.chosen(recordings)
    yield OVERLAY, traces.overlay(*recordings, columns=main, labels=labels)
    if found.moves:
        yield MOVES, _moves(found)
    rest = traces.panels(
        recordings, [n for n in found.columns if n not in main and _told(found, n)]
    )
    for k in range(min(_MOST, -(-len(rest) // _PANELS))):
        some = rest[k * _PANELS : (k + 1) * _PANELS]
        names = [name for _, inside in some for name in inside]
        yield f"{COLUMNS}-{k + 1}", traces.overlay(*recordings, columns=names, labels=labels)


def _told(found: Comparison, name: str) -> bool:
    """Whether a column varies in one of them, or differs between them."""
    values = [side.recording[name] for side in found.sides]
    return any(bool(np.any(each != values[0][0])) for each in values)


def _moves(found: Comparison) -> Figure:
    """Settling, error and overshoot of each move, a column for each stage."""
    stages = [s for s in ("macro", "micro") if any(m.stage == s for m in found.moves)]
    figure, axes = new(6.4, len(QUANTITIES), len(stages), sharex="col")
    for column, stage in enumerate(stages):
        moves = [m for m in found.moves if m.stage == stage]
        unit = moves[0].unit
        words = (("settling", "s"), ("final error", unit), ("overshoot", unit))
        for row, (quantity, (name, its)) in enumerate(zip(QUANTITIES, words, strict=True)):
            ax = axes[row, column]
            for k, side in enumerate(found.sides):
                shown = [m for m in moves if m.results[k] is not None]
                y: list[Any] = [getattr(m.results[k], quantity) for m in shown]
                _dots(ax, [m.move + 1 for m in shown], y, k, side.name)
            if quantity == "final_error":
                ax.axhline(0.0, color=BLACK, linewidth=0.6)
            else:
                ax.set_ylim(bottom=-0.05 * ax.get_ylim()[1])  # whole markers at 0
            last = row == len(QUANTITIES) - 1
            title = f"{stage}-stage" if row == 0 else ""
            finish(ax, title, "move" if last else "", f"{name} [{its}]")
            ax.margins(x=0.04)
            ax.xaxis.get_major_locator().set_params(integer=True)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper left", ncols=4, fontsize=7.5, frameon=False)
    rows = -(-len(labels) // 4)
    figure.subplots_adjust(hspace=0.2, wspace=0.25, top=0.93 - 0.025 * rows)
    return figure


def _dots(ax: Any, x: list[int], y: list[Any], k: int, label: str) -> None:
    """The first recording's markers are hollow and larger, so that others show within."""
    colour, marker = _COLOURS[k % len(_COLOURS)], _MARKERS[k % len(_MARKERS)]
    values = [float("nan") if v is None else v for v in y]
    ax.plot(
        x, values, marker, color=colour, label=label, markersize=7 if k == 0 else 4,
        markerfacecolor="none" if k == 0 else colour,
    )  # fmt: skip
