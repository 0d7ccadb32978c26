"""The folder of a tuning: page, settings for ``macromicro run --config``, numbers, figures."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import macromicro
from macromicro.drawing import files as drawings
from macromicro.drawing.page import Picture, fill, save_figures
from macromicro.runs import folder
from macromicro.schema import config
from macromicro.schema.text import plain, printable, write_text
from macromicro.tuning import _pictures, words
from macromicro.tuning.search import Fresh, Tuning
from macromicro.tuning.words import Row

PAGE, SETTINGS, NUMBERS = "tuning.html", "tuned.toml", "tuning.json"
FILES = (PAGE, SETTINGS, NUMBERS, *drawings.names((_pictures.RESPONSE, _pictures.BODE)))
BYTES = 3_000_000
_TEMPLATE = Path(__file__).parent / "templates" / "tuning.html.j2"


class Report(NamedTuple):
    """A tuning with its table and remarks: the same for page, terminal and files."""

    found: Tuning
    rows: list[Row]
    remarks: list[str]

    @property
    def text(self) -> str:
        return "\n".join(words.text(*self))


def summarise(found: Tuning) -> Report:
    margins = [found.subject.margins(version.settings) for version in found.versions]
    return Report(found, words.rows(found, margins), list(words.remarks(found)))


def write(out: Path, report: Report, kinds: Sequence[str] = drawings.DEFAULT) -> None:
    """Write everything, all of it or nothing; an earlier tuning there is replaced."""
    with folder.staging(out, remove=FILES) as place:
        write_text(place / SETTINGS, as_toml(report))
        write_text(place / NUMBERS, as_json(report))
        shown = save_figures(_pictures.draw(report.found), place, kinds)
        write_text(place / PAGE, page(report, shown))


def as_toml(report: Report) -> str:
    found, subject = report.found, report.found.subject
    about = [
        f"# {subject.name} of the machine {subject.machine}: {subject.law}, tuned for "
        f"{found.objective.name}, macromicro {macromicro.__version__}",
        *(f"# {printable(line, 300)}" for line in report.remarks),
    ]
    return "\n".join(about) + "\n\n" + subject.as_toml(found.best.settings)


def as_json(report: Report) -> str:
    """Everything but the recordings."""
    content = plain(_content(report), spelled=True)
    return json.dumps(content, indent=2, allow_nan=False) + "\n"


def _content(report: Report) -> dict[str, Any]:
    found = report.found
    subject, objective = found.subject, found.objective
    weights = {p.name: found.weights.get(p.name, p.weight) for p in objective.penalties}
    uncertain = subject.uncertain if len(found.amounts) else ()
    return {
        "version": macromicro.__version__,
        "machine": subject.machine,
        "stage": subject.name,
        "law": subject.law,
        "objective": {
            "name": objective.name,
            "unit": objective.unit,
            "meaning": objective.meaning,
            "penalties": weights,
        },
        "seed": found.budget.seed,
        "evaluations": found.evaluations,
        "search": [knob._asdict() for knob in subject.knobs(found.first.settings)],
        "versions": [version.name for version in found.versions],
        "best": found.best.name,
        "better": found.better,
        "table": [row._asdict() for row in report.rows],
        "remarks": report.remarks,
        "machines": {
            "count": len(found.first.runs),
            "ranges": [each._asdict() for each in uncertain],
            "draws": found.amounts.tolist(),
            "cost": {version.name: version.cost for version in found.versions},
        },
        "fresh": None if found.fresh is None else _fresh_values(found.fresh),
        "rejected": found.rejected,
        "history": found.history,
        "overrides": config.difference(found.best.settings, subject.default),
    }


def _fresh_values(fresh: Fresh) -> dict[str, Any]:
    return {
        "count": len(fresh.amounts),
        "draws": fresh.amounts.tolist(),
        "cost": {"before": fresh.costs[0], "after": fresh.costs[1]},
        "cheaper_on": fresh.cheaper,
    }


def page(report: Report, pictures: Sequence[Picture]) -> str:
    found = report.found
    return fill(
        _TEMPLATE,
        subject=found.subject,
        objective=found.objective,
        remarks=report.remarks,
        versions=[version.name for version in found.versions],
        groups=[(name, list(rows)) for name, rows in groupby(report.rows, lambda row: row.group)],
        number=words.number,
        pictures=pictures,
    )
