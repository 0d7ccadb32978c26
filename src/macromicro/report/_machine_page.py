"""The page and the files of a run of any machine from a file."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import macromicro
from macromicro.drawing.page import PageFigure, Picture, filled, saved
from macromicro.machines import doubts
from macromicro.report._page import TEMPLATE
from macromicro.report.provenance import software
from macromicro.report.summary import as_json
from macromicro.runs import folder
from macromicro.schema.text import write_text


class Words(NamedTuple):
    headings: Any  # of the table
    table: Any  # A row a move
    remarks: Any  # below it
    verdict: str  # what it came to
    problems: Any  # what went wrong
    footnote: str  # how the columns are meant
    settings: str  # all settings, as TOML


def warnings(settings: Any) -> list[tuple[str, str]]:
    return [("warning", each.text) for each in doubts.found(settings)]


def doubt(settings: Any) -> str:
    """Reason to doubt the arrivals of a run."""
    wide = [d for d in doubts.found(settings) if d.path.endswith(doubts.ARRIVAL)]
    return "".join(f", but {d.path} = {d.value} is in doubt (see warning)" for d in wide)


def page(ended: Any, pictures: list[Picture], started: str, words: Words) -> str:
    job, rows = ended.job, ended.recording
    cycles = f"{job.request.cycles} cycle{'' if job.request.cycles == 1 else 's'}"
    return filled(
        TEMPLATE,
        opening=f"{cycles} on the machine {job.machine.name} ({job.machine.title}), simulated, "
        f"seed {job.request.seed}, run on {started} with macromicro {macromicro.__version__}.",
        ended=ended,
        programme=job.programme,
        overrides=job.overrides,
        pictures=pictures,
        provenance=[
            ("programme", job.programme.source),
            ("settings", str(job.request.config)),
            ("results", str(job.out)),
            *software(),
            ("rows recorded", f"{len(rows)}, one every {rows.dt * 1e3:g} ms"),
        ],
        **words._asdict(),
    )


def pictures(ended: Any, content: Any, drawn: Iterable[PageFigure]) -> list[Picture]:
    write_text(ended.job.out / folder.SUMMARY, as_json(content))
    return saved(drawn, ended.job.out, ended.job.request.figures)
