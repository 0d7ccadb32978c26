"""One self-contained HTML file: text, table and figures, no network, no script."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import macromicro
from macromicro.drawing.page import Picture, filled
from macromicro.report import words
from macromicro.report.provenance import software
from macromicro.runs.job import Ended
from macromicro.schema import config

TEMPLATE = Path(__file__).parent / "templates" / "report.html.j2"
_FOOTNOTE = """\
Settling runs from the move's start until the error stays within the band, by the
encoder (macro) or the laser (micro). The final error is the target minus the mean reading over
the hold's last 0.5 s. Integral action makes the Hall error of a micro move zero by construction;
the laser and the bench's truth are independent. Without a laser the Hall sensor detects the arrival
of a micro move."""


def page(ended: Ended, pictures: Sequence[Picture], started: str) -> str:
    request = ended.job.request
    opening = (
        f"{request.cycles} cycle{'' if request.cycles == 1 else 's'} on the virtual bench,\n"
        f"{'with' if request.fan else 'without'} fan, seed {request.seed}, run on {started} with\n"
        f"macromicro {macromicro.__version__}."
    )
    return filled(
        TEMPLATE,
        opening=opening,
        footnote=_FOOTNOTE,
        ended=ended,
        programme=ended.job.programme,
        overrides=ended.job.overrides,
        headings=words.HEADINGS,
        table=words.table(ended),
        remarks=words.remarks(ended),
        verdict=words.verdict(ended),
        problems=words.problems(ended),
        pictures=pictures,
        provenance=_provenance(ended),
        settings=config.as_toml(ended.job.settings),
    )


def _provenance(ended: Ended) -> list[tuple[str, str]]:
    return [
        ("programme", ended.job.programme.source),
        ("settings", str(ended.job.request.config or "the defaults")),
        ("results", str(ended.job.out)),
        *software(),
        ("rows recorded", f"{len(ended.recording)}, one every {ended.recording.dt * 1e3:g} ms"),
    ]
