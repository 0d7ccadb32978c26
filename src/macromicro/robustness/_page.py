"""One self-contained HTML file of a study: tables and figures, no network, no script."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import macromicro
from macromicro.drawing.page import Picture, filled
from macromicro.robustness import words
from macromicro.robustness._findings import overall, worst
from macromicro.robustness.statistics import rank_correlation
from macromicro.robustness.study import Study
from macromicro.robustness.words import About

TEMPLATE = Path(__file__).parent / "templates" / "robust.html.j2"


def page(study: Study, about: About, pictures: Sequence[Picture], out: str) -> str:
    whole = overall(study)
    return filled(
        TEMPLATE,
        about=about,
        request=study.request,
        machine=study.subject.name,
        done=len(study.rows),
        whole=whole,
        share=words.percent(whole.share),
        interval=words.interval(whole),
        remarks=words.remarks(study),
        yield_headings=words.YIELD_HEADINGS,
        yields=words.yield_rows(study, whole),
        influences=[
            (study.metric(name).meaning, words.influence(study, name))
            for name in study.subject.main
        ],
        spread_headings=words.SPREAD_HEADINGS,
        spreads=words.spread_rows(study),
        correlation_headings=study.subject.main,
        correlations=_correlations(study),
        worst=_worst(study, about, out),
        parameters=_parameters(study),
        pictures=pictures,
        version=macromicro.__version__,
        out=out,
    )


def _correlations(study: Study) -> list[tuple[str, ...]]:
    lines = []
    for k, each in enumerate(study.subject.uncertain):
        x = study.sample.amounts[: len(study.rows), k]
        found = (rank_correlation(x, study.column(m)) for m in study.subject.main)
        lines.append((each.name, *(words.rank(r, len(study.subject.uncertain)) for r in found)))
    return lines


def _worst(study: Study, about: About, out: str) -> list[tuple[str, str, str, str]]:
    """Metric, value, limit and the command that repeats the case."""
    return [
        (
            w.requirement.metric.meaning,
            words.worst_value(study, w),
            w.requirement.text,
            words.replay(study, w, about, out),
        )
        for w in worst(study)
    ]


def _parameters(study: Study) -> list[tuple[str, str, str, str, str]]:
    return [
        (
            u.name,
            f"{words.amount(u, u.low)} to {words.amount(u, u.high)}",
            u.meaning,
            ", ".join(path for path, _ in u.parts),
            u.source,
        )
        for u in study.subject.uncertain
    ]
