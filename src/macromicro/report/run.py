"""The report of a run of any machine: words, figures and page."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import macromicro
from macromicro.drawing.captions import captions
from macromicro.drawing.page import PageFigure, Picture, fill, save_figures
from macromicro.report.provenance import software
from macromicro.runs import folder
from macromicro.schema.text import plain, write_text

TEMPLATE = Path(__file__).parent / "templates" / "report.html.j2"
NONE = "-"
CAPTIONS = captions(Path(__file__).with_name("figures.toml"))


MOVE = ("#", "stage", "target", "arrival")  # columns of every table of moves
PEAK, REST, TRUE, OVERSHOOT = "peak error", "error at rest", "true error", "overshoot"
# Of columns, by the start of their headings.
_MEANINGS: dict[str, str] = tomllib.loads(
    Path(__file__).with_name("columns.toml").read_text(encoding="utf-8")
)


class Line(NamedTuple):
    cells: tuple[str, ...]  # text with units, in the order of the headings
    arrived: bool  # whether the move got there


class RunReport(NamedTuple):
    """The words of a report: the same for page, terminal and files."""

    opening: str
    headings: tuple[str, ...]  # of the table
    table: list[Line]  # a line a move
    remarks: list[tuple[str, str]]  # below it
    verdict: str
    problems: list[str]  # what went wrong
    footnote: str  # how the columns are meant
    settings: str  # all settings, as TOML
    summary: dict[str, Any]  # the figures, for programs


def amount(value: float | None, digits: int, unit: str) -> str:
    # Rounded first, so that no "-0.0" appears.
    return NONE if value is None else f"{round(value, digits) + 0.0:.{digits}f} {unit}"


def line(
    number: int, stage: str, target: str, took: float | None, complete: bool, cells: Iterable[str]
) -> Line:
    """A row of the table; `took` is the time from the move's start to its arrival, s."""
    lost = "did not arrive" if complete else "cut short"
    arrival = lost if took is None else f"{took:.3f} s"
    return Line((str(number), stage, target, arrival, *cells), took is not None)


def footnote(headings: Sequence[str]) -> str:
    """What the columns of a table mean."""
    found = [t for key, t in _MEANINGS.items() if any(h.startswith(key) for h in headings)]
    return " ".join(found)


def cycles(count: int) -> str:
    return f"{count} cycle{'' if count == 1 else 's'}"


def origin(seed: int, started: str) -> str:
    return f"seed {seed}, run on {started} with macromicro {macromicro.__version__}."


def speed(ended: Any) -> list[tuple[str, str]]:
    if not ended.wall > 0.0:
        return []
    factor = ended.simulated / ended.wall
    times = f"{factor:.0f}" if factor >= 10.0 else f"{factor:.2g}"
    text = f"{ended.simulated:.1f} s simulated in {ended.wall:.2f} s, {times} times real time"
    return [("speed", text)]


def stop_lines(ended: Any, count: str) -> list[str]:
    """Why a run did not come to its end; `count` says at which move."""
    fault = ended.fault
    if fault is not None:
        return [f"fault: {fault.message} Evidence: {fault.evidence}. {fault.remedy}"]
    if ended.finished:
        return []
    return [f"the programme did not finish: {count} at {ended.simulated:.3f} s"]


def summary(ended: Any, started: str, planned: int) -> dict[str, Any]:
    """What programs read of any run."""
    job = ended.job
    return {
        "programme": job.programme.title,
        "source": job.programme.source,
        "cycles": job.request.cycles,
        "seed": job.request.seed,
        "version": macromicro.__version__,
        "started": started,
        "overrides": job.overrides,
        "finished": ended.finished,
        "fault": ended.fault and ended.fault._asdict(),
        "moves_planned": planned,
        "simulated_s": ended.simulated,
        "wall_s": ended.wall,
        "speed": ended.simulated / ended.wall if ended.wall > 0.0 else None,
    }


def as_json(content: dict[str, Any]) -> str:
    """JSON with null for NaN and infinity."""
    return json.dumps(plain(content), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def write(ended: Any, report: RunReport, drawn: Iterable[PageFigure]) -> None:
    """Write everything beside the recording; the summary first."""
    out = ended.job.out
    write_text(out / folder.SUMMARY, as_json(report.summary))
    shown = save_figures(drawn, out, ended.job.request.figures)
    write_text(out / folder.PAGE, page(ended, report, shown))


def page(ended: Any, report: RunReport, shown: Sequence[Picture]) -> str:
    """One self-contained HTML file: text, table and figures, no network, no script."""
    job, rows = ended.job, ended.recording
    return fill(
        TEMPLATE,
        ended=ended,
        report=report,
        programme=job.programme,
        overrides=job.overrides,
        pictures=shown,
        provenance=[
            ("programme", job.programme.source),
            ("settings", str(job.request.config or "the defaults")),
            ("results", str(job.out)),
            *software(),
            ("rows recorded", f"{len(rows)}, one every {rows.dt * 1e3:g} ms"),
        ],
    )
