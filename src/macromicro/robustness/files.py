"""The folder of a study: page, JSON, samples, figures, worst cases as settings files."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import macromicro
from macromicro.drawing import files as drawings
from macromicro.drawing.page import Picture, fill, save_figures
from macromicro.robustness import _figures, words
from macromicro.robustness._findings import Influence, Worst, influences, overall, worst, yields
from macromicro.robustness.statistics import CONFIDENCE, LEVELS, rank_correlation, spread
from macromicro.robustness.study import Study
from macromicro.robustness.words import About
from macromicro.runs import folder
from macromicro.schema.text import plain, write_text

PAGE, JSON, SAMPLES = "robust.html", "robust.json", "samples.csv"
FILES = (PAGE, JSON, SAMPLES, *drawings.names(_figures.FIGURES))
BYTES = 4_000_000
TEMPLATE = Path(__file__).parent / "templates" / "robust.html.j2"


def write(out: Path, study: Study, about: About, kinds: Sequence[str] = drawings.DEFAULT) -> None:
    """Write everything, all of it or nothing; an earlier study there is replaced."""
    with folder.staging(out, remove=_earlier(out)) as place:
        write_text(place / JSON, as_json(study, about))
        write_text(place / SAMPLES, as_csv(study), newline="")
        for found in worst(study):
            write_text(place / words.file_name(found), as_toml(study, found, about))
        shown = save_figures(_figures.draw(study), place, kinds)
        write_text(place / PAGE, page(study, about, shown, str(out)))


def _earlier(out: Path) -> list[str]:
    return [*FILES, *(p.name for p in out.glob("worst-*.toml"))]


def as_toml(study: Study, found: Worst, about: About) -> str:
    """The settings of a worst case as a file for `macromicro run --config`."""
    metric = found.requirement.metric
    lines = [
        f"# Sample {found.sample} of {len(study.rows)}: the worst for {metric.name},",
        f"# {metric.meaning}: {words.number(found.value, metric.unit)}"
        f" (required: {found.requirement.text}). Repeat it with",
        f"#   {words.replay(study, found, about, '')}",
        "\n",
    ]
    return "\n".join(lines) + study.subject.as_toml(study.settings(found.sample))


def as_csv(study: Study) -> str:
    """A line for each machine of the sample: seed, parameters on their scales, metrics."""
    names = [u.name for u in study.subject.uncertain]
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["sample", "seed", *names, *(m.name for m in study.subject.metrics)])
    for i, row in enumerate(study.rows):
        cells = [_cell(v) for v in (*study.sample.amounts[i], *row)]
        writer.writerow([str(i), str(study.request.seed + i), *cells])
    return text.getvalue()


def _cell(value: float) -> str:
    return "" if math.isnan(value) else repr(float(value))


def as_json(study: Study, about: About) -> str:
    """Everything but the pictures."""
    content = plain(_content(study, about), spelled=True)
    return json.dumps(content, indent=2, allow_nan=False) + "\n"


def _content(study: Study, about: About) -> dict[str, Any]:
    request = study.request
    return {
        "version": macromicro.__version__,
        "machine": study.subject.name,
        "programme": about.programme,
        "fan": about.fan,
        "started": about.started,
        "seconds": about.seconds,
        "overrides": about.overrides,
        "seed": request.seed,
        "samples": request.samples,
        "samples_done": len(study.rows),
        "interrupted": study.interrupted,
        "remarks": words.remarks(study),
        "interval": f"Clopper-Pearson, {CONFIDENCE:.0%}",
        "parameters": [u._asdict() for u in study.subject.uncertain],
        "requirements": [
            {
                "metric": y.requirement.metric.name,
                "unit": y.requirement.metric.unit,
                "limit": y.requirement.limit,
                "source": y.requirement.source,
                "nominal": y.nominal,
                "yield": y.all._asdict(),
                "yield_where_known": y.known._asdict(),
            }
            for y in yields(study)
        ],
        "overall": overall(study)._asdict(),
        "metrics": {
            m.name: {
                "unit": m.unit,
                "meaning": m.meaning,
                "nominal": study.nominal[k],
                **_spread(study, m.name),
                "influences": [_as_row(i) for i in influences(study, m.name)],
            }
            for k, m in enumerate(study.quantities)
        },
        "worst": [
            {
                "metric": w.requirement.metric.name,
                "value": w.value,
                "unit": w.requirement.metric.unit,
                "sample": w.sample,
                "seed": request.seed + w.sample,
                "fault_code": w.fault,
                "file": words.file_name(w),
            }
            for w in worst(study)
        ],
    }


def _as_row(i: Influence) -> dict[str, Any]:
    return {
        "parameter": i.parameter.name,
        "low": i.low,
        "high": i.high,
        "effect": i.effect,
        "rank_correlation": i.correlation.value,
        "p_value": i.correlation.p,
    }


def _spread(study: Study, metric: str) -> dict[str, Any]:
    found = spread(study.column(metric))
    levels = dict(zip((f"{level:g}" for level in LEVELS), found.quantiles, strict=True))
    return {**found._asdict(), "quantiles": levels}


def page(study: Study, about: About, pictures: Sequence[Picture], out: str) -> str:
    whole = overall(study)
    return fill(
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
    rows = []
    for w in worst(study):
        needed, replay = w.requirement, words.replay(study, w, about, out)
        rows.append((needed.metric.meaning, words.worst_value(study, w), needed.text, replay))
    return rows


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
