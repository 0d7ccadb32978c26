"""The report of a run of any machine, into its folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from macromicro.report import _figures, machine, run, two_stage
from macromicro.report.run import RunReport
from macromicro.runs import folder, keeping
from macromicro.runs.job import Ended
from macromicro.schema.text import write_text


def reported(ended: Any, started: str) -> RunReport:
    if isinstance(ended, Ended):
        return two_stage.report(ended, started)
    return machine.report(ended, started)


def write(ended: Any, report: RunReport) -> Path | None:
    """Write the report; the settings that the law has learned, where it learns."""
    if not isinstance(ended, Ended):
        run.write(ended, report, machine.draw(ended))
        return None
    learned = _keep(ended)
    run.write(ended, report, _figures.draw(ended))
    return learned


def _keep(ended: Ended) -> Path | None:
    """What the law has learned, for the next run."""
    file = ended.job.out / folder.LEARNED
    learned = None if ended.fault else keeping.text(ended.recording, ended.job.settings)
    file.unlink(missing_ok=True)
    if learned is None:
        return None
    write_text(file, learned)
    return file
