"""Summary, figures and page of a run, into its folder."""

from __future__ import annotations

from typing import Any

from macromicro.drawing import files
from macromicro.drawing.page import Picture
from macromicro.report import figures
from macromicro.report.page import page
from macromicro.report.summary import as_json, summary
from macromicro.runs import folder, keeping
from macromicro.runs.job import Ended


def write(ended: Ended, started: str) -> dict[str, Any]:
    """Write everything beside the recording; the summary first.

    Parameters
    ----------
    ended : Ended
        The run.
    started : str
        When, in words a person reads (ISO 8601).

    Returns
    -------
    dict[str, Any]
        Content of the summary.

    Raises
    ------
    OSError
        The disk refuses.
    """
    out = ended.job.out
    learned = None if ended.fault else keeping.text(ended.recording, ended.job.settings)
    (out / folder.LEARNED).unlink(missing_ok=True)
    if learned is not None:
        (out / folder.LEARNED).write_text(learned, encoding="utf-8")
    content = summary(ended, started)
    (out / folder.SUMMARY).write_text(as_json(content), encoding="utf-8")
    pictures = []
    for drawn in figures.draw(ended):
        data = files.save(drawn.figure, out, drawn.name, ended.job.request.figures)
        pictures.append(Picture(drawn.name, drawn.title, drawn.caption, data))
    (out / folder.PAGE).write_text(page(ended, pictures, started), encoding="utf-8")
    return content
