"""Summary, figures and page of a run, into its folder."""

from __future__ import annotations

from typing import Any

from macromicro.drawing.page import saved
from macromicro.report import _figures
from macromicro.report._page import page
from macromicro.report.summary import as_json, summary
from macromicro.runs import folder, keeping
from macromicro.runs.job import Ended
from macromicro.schema.text import write_text


def write(ended: Ended, started: str) -> dict[str, Any]:
    """Write everything beside the recording; the summary first."""
    out = ended.job.out
    learned = None if ended.fault else keeping.text(ended.recording, ended.job.settings)
    (out / folder.LEARNED).unlink(missing_ok=True)
    if learned is not None:
        write_text(out / folder.LEARNED, learned)
    content = summary(ended, started)
    write_text(out / folder.SUMMARY, as_json(content))
    pictures = saved(_figures.draw(ended), out, ended.job.request.figures)
    write_text(out / folder.PAGE, page(ended, pictures, started))
    return content
