"""The report of a run of any machine, into its folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from macromicro.report import _figures, machine, run, two_stage
from macromicro.report.run import RunReport
from macromicro.runs import folder
from macromicro.runs.job import Ended
from macromicro.runs.programmed import TwoStageSetup
from macromicro.schema.text import write_text

_WORDS: dict[type, Any] = {TwoStageSetup: two_stage.report}
_DRAWN: dict[type, Any] = {TwoStageSetup: _figures.draw}


def run_report(ended: Ended, started: str) -> RunReport:
    report: RunReport = _WORDS.get(type(ended.job.setup), machine.report)(ended, started)
    return report


def write(ended: Ended, report: RunReport) -> Path | None:
    """Write the report; the settings that the law has learned, where it learns."""
    learned = _keep(ended)
    draw = _DRAWN.get(type(ended.job.setup), machine.draw)
    run.write(ended, report, draw(ended))
    return learned


def _keep(ended: Ended) -> Path | None:
    """What the law has learned, for the next run."""
    file = ended.job.out / folder.LEARNED
    learned = None if ended.fault else ended.job.setup.learned(ended.recording)
    file.unlink(missing_ok=True)
    if learned is None:
        return None
    write_text(file, learned)
    return file
