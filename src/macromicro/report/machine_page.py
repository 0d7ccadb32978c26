"""The page and the files of a run of any machine from a file: what all their reports share."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import macromicro
from macromicro.drawing import files
from macromicro.drawing.page import Picture, filled
from macromicro.report.figures import Drawn
from macromicro.report.page import TEMPLATE
from macromicro.report.provenance import software
from macromicro.report.summary import as_json
from macromicro.runs import folder


class Words(NamedTuple):
    """What a machine's page says of a run.

    Attributes
    ----------
    headings : Any
        Of the table.
    table : Any
        A row a move.
    remarks : Any
        Below it.
    problems : Any
        What went wrong.
    footnote : str
        How the columns are meant.
    settings : str
        All settings, as TOML.
    """

    headings: Any
    table: Any
    remarks: Any
    problems: Any
    footnote: str
    settings: str


def page(ended: Any, pictures: list[Picture], started: str, words: Words) -> str:
    """The report as HTML. All text is escaped.

    Parameters
    ----------
    ended : Any
        The run, of one stage or of two axes.
    pictures : list[Picture]
        Its figures.
    started : str
        When, in words a person reads (ISO 8601).
    words : Words
        What it says.

    Returns
    -------
    str
        One self-contained file.
    """
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


def pictures(ended: Any, content: Any, drawn: Iterable[Drawn]) -> list[Picture]:
    """Write the summary, then the figures.

    Parameters
    ----------
    ended : Any
        The run.
    content : Any
        Of the summary.
    drawn : Iterable[Drawn]
        The figures.

    Returns
    -------
    list[Picture]
        For the page.

    Raises
    ------
    OSError
        The disk refuses.
    """
    out, kinds = ended.job.out, ended.job.request.figures
    (out / folder.SUMMARY).write_text(as_json(content), encoding="utf-8")
    return [
        Picture(d.name, d.title, d.caption, files.save(d.figure, out, d.name, kinds)) for d in drawn
    ]
