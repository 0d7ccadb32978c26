"""The folder of a robustness study of a machine of one stage: numbers, words, figure."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import macromicro
from macromicro.columns import quantities
from macromicro.drawing import files as drawings
from macromicro.drawing.style import BLUE, GREEN, RED, finish, new
from macromicro.place import LENGTH, Place
from macromicro.robustness.requirements import Requirement
from macromicro.robustness.stage import Study
from macromicro.robustness.statistics import CONFIDENCE, LEVELS, rank_correlation, spread
from macromicro.robustness.words import number
from macromicro.runs import folder
from macromicro.schema.text import plain, write_text

NUMBERS, FIGURE = "robust.json", "robust"
FILES = (NUMBERS, *drawings.names((FIGURE,)))
_FOUR = (  # those of the first row that a machine has are drawn
    ("contour", "rms_contour", "true_contour", "true_error"),
    ("settling", "peak_error", "rest_error", "true_error"),
)


def _place(found: Study) -> Place:
    """The unit of the machine's positions; two axes are linear."""
    kind = getattr(found.machine, "kind", None)
    return LENGTH if kind is None else kind.place


def _shown(found: Study) -> tuple[str, ...]:
    """Figures that are drawn: four at most."""
    known = type(found.nominal)._fields
    for names in _FOUR:
        if set(names) <= set(known):
            return names
    return tuple(known[2:6])  # beside fault and moves that did not arrive


def metrics(found: Study) -> dict[str, dict[str, Any]]:
    amounts = found.amounts[: len(found.found)]
    told: dict[str, dict[str, Any]] = {}
    for name, about in quantities(type(found.nominal), _place(found)).items():
        if name == "fault":
            continue
        values = np.array([getattr(t, name) for t in found.found])
        s = spread(values)
        one: dict[str, Any] = {
            "unit": about.unit,
            "meaning": about.meaning,
            "nominal": getattr(found.nominal, name),
            "known": s.known,
            "never": s.never,
        }
        if s.known:
            one["quantiles"] = dict(zip(map(str, LEVELS), s.quantiles, strict=True))
            one["worst"] = s.most
        ranks = {
            row.name: rank
            for k, row in enumerate(found.rows)
            if (rank := rank_correlation(amounts[:, k], values)).significant(len(found.rows))
        }
        if ranks:
            one["goes_with"] = max(ranks, key=lambda r: abs(ranks[r].value))
            one["rank_correlation"], one["p_value"] = ranks[one["goes_with"]]
        told[name] = one
    return told


def content(found: Study) -> dict[str, Any]:
    arrives = found.arrives
    return {
        "machine": found.machine.name,
        "version": macromicro.__version__,
        "seed": found.seed,
        "asked": found.asked,
        "done": len(found.found),
        "arrives": {**arrives._asdict(), "confidence": CONFIDENCE},
        "requirements": [
            {
                "metric": r.metric.name,
                "unit": r.metric.unit,
                "limit": r.limit,
                "nominal": getattr(found.nominal, r.metric.name),
                **found.met(r)._asdict(),
            }
            for r in found.required
        ],
        "metrics": metrics(found),
        "varied": [
            {"name": r.name, "range": [r.low, r.high], "meaning": r.meaning, "source": r.source}
            for r in found.rows
        ],
        "machines": [
            {
                **dict(zip((r.name for r in found.rows), amounts.tolist(), strict=True)),
                **t._asdict(),
            }
            for amounts, t in zip(found.amounts, found.found, strict=False)
        ],
    }


def lines(found: Study) -> list[str]:
    a = found.arrives
    told = [
        f"every move arrives, without a fault, on {a.passed} of {a.total} machines: "
        f"{100.0 * a.share:.1f} % ({100.0 * a.low:.1f} to {100.0 * a.high:.1f} % at 95 %)"
    ]
    told += [_required(found, f"{r.metric.name} {r.text}", r) for r in found.required]
    if len(found.required) > 1:
        told.append(_required(found, "all of them", *found.required))
    stopped = sum(t.fault != 0.0 for t in found.found)
    if stopped:
        of = len(found.found)
        told.append(f"a fault stopped {stopped} of {of} machines; the results below exclude them")
    return told + [_metric(name, m) for name, m in metrics(found).items() if m["known"]]


def _metric(name: str, m: dict[str, Any]) -> str:
    """The distribution of a metric, and its strongest correlation."""
    low, middle, high = (number(m["quantiles"][level]) for level in ("0.05", "0.5", "0.95"))
    unit = "" if m["unit"] == "1" or m["never"] else f" {m['unit']}"
    text = f"{name}: nominal {number(m['nominal'])}, median {middle}, 5 to 95 % {low} to {high}"
    text += f", worst {number(m['worst'])}{unit}"
    if m["never"]:
        text += f" [{m['unit']}]; {m['never']} of {m['known']} never settled"
    if "goes_with" in m:
        p = max(m["p_value"], 1e-6)
        text += (
            f"; strongest correlation: {m['goes_with']} ({m['rank_correlation']:+.2f}, p {p:.1g})"
        )
    return text


def _required(found: Study, words: str, *required: Requirement) -> str:
    s = found.met(*required)
    return (
        f"required: {words}: met on {s.passed} of {s.total}, {100.0 * s.share:.1f} % "
        f"({100.0 * s.low:.1f} to {100.0 * s.high:.1f} % at 95 %)"
    )


def draw_figure(found: Study) -> Any:
    """Distributions of settling and errors, or of the distance from the path."""
    figure, axes = new(5.4, 2, 2)
    shown = _shown(found)
    for ax, name in zip(axes.flat, shown, strict=True):
        about = quantities(type(found.nominal), _place(found))[name]
        values = np.array([getattr(t, name) for t in found.found])
        s, nominal = spread(values), getattr(found.nominal, name)
        finite = values[np.isfinite(values)]
        if len(finite):
            never = f"{s.never} more never settled" if s.never else None
            ax.hist(finite, bins=30, color=BLUE, label=never)
        for value, color, style, label in (
            (s.quantiles[-1], RED, "-", "95 %"),
            (nominal, GREEN, "--", "nominal"),
        ):
            if np.isfinite(value):
                ax.axvline(value, color=color, linestyle=style, label=label)
        finish(
            ax, name.replace("_", " "), f"{about.meaning} [{about.unit}]", "machines", legend=True
        )
    figure.subplots_adjust(hspace=0.6)
    return figure


def write(out: Path, found: Study, kinds: Sequence[str]) -> None:
    with folder.staged(out, remove=FILES) as place:
        text = json.dumps(plain(content(found), spelled=True), indent=2, allow_nan=False)
        write_text(place / NUMBERS, text + "\n")
        drawings.save(draw_figure(found), place, FIGURE, kinds)
