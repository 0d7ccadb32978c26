"""The report of a run of any machine, into its folder."""

from __future__ import annotations

from typing import Any

from macromicro.report import _figures, machine, run, two_stage
from macromicro.report.run import Told
from macromicro.runs import folder, keeping
from macromicro.runs.job import Ended
from macromicro.schema.text import write_text


def write(ended: Any, started: str) -> Told:
    if not isinstance(ended, Ended):
        told = machine.told(ended, started)
        run.write(ended, told, machine.draw(ended))
        return told
    told = two_stage.told(ended, started)
    _keep(ended)
    run.write(ended, told, _figures.draw(ended))
    return told


def _keep(ended: Ended) -> None:
    """What the law has learned, for the next run."""
    file = ended.job.out / folder.LEARNED
    learned = None if ended.fault else keeping.text(ended.recording, ended.job.settings)
    file.unlink(missing_ok=True)
    if learned is not None:
        write_text(file, learned)
