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
from macromicro.machines.joint.trial import JointTrial
from macromicro.place import LENGTH, Place
from macromicro.robustness.requirements import Requirement
from macromicro.robustness.stage import Study
from macromicro.robustness.statistics import CONFIDENCE, LEAST
from macromicro.runs import folder
from macromicro.schema.text import plain

NUMBERS, FIGURE = "robust.json", "robust"
FILES = (NUMBERS, *drawings.names((FIGURE,)))
_LEVELS = (0.05, 0.5, 0.95)
_SHOWN = ("settling", "peak_error", "rest_error", "true_error")
_JOINT = ("contour", "rms_contour", "true_contour", "true_error")


def _place(found: Study) -> Place:
    """What the machine's places are counted in; two axes slide."""
    kind = getattr(found.machine, "kind", None)
    return LENGTH if kind is None else kind.place


def metrics(found: Study) -> dict[str, dict[str, Any]]:
    """What each metric was over the machines that arrive.

    Parameters
    ----------
    found : Study
        The study.

    Returns
    -------
    dict[str, dict[str, Any]]
        By metric: unit, meaning, nominal value, quantiles, the worst, and which quantity it goes
        with (rank correlation).
    """
    from scipy.stats import spearmanr

    amounts = found.amounts[: len(found.found)]
    told: dict[str, dict[str, Any]] = {}
    for name, about in quantities(type(found.nominal), _place(found)).items():
        if name == "fault":
            continue
        values = np.array([getattr(t, name) for t in found.found])
        known = np.isfinite(values)
        one: dict[str, Any] = {
            "unit": about.unit,
            "meaning": about.meaning,
            "nominal": getattr(found.nominal, name),
        }
        if known.any():
            one["quantiles"] = dict(
                zip(map(str, _LEVELS), np.quantile(values[known], _LEVELS).tolist(), strict=True)
            )
            one["worst"] = float(values[known].max())
        if known.sum() >= LEAST and np.ptp(values[known]) > 0.0:
            ranks = {
                row.name: float(spearmanr(amounts[known, k], values[known]).statistic)
                for k, row in enumerate(found.rows)
                if np.ptp(amounts[known, k]) > 0.0
            }
            one["goes_with"] = max(ranks, key=lambda r: abs(ranks[r]))
            one["rank_correlation"] = ranks[one["goes_with"]]
        told[name] = one
    return told


def content(found: Study) -> dict[str, Any]:
    """The content of robust.json.

    Parameters
    ----------
    found : Study
        The study.

    Returns
    -------
    dict[str, Any]
        Share, metrics, and each machine with its amounts.
    """
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
    """The study in words.

    Parameters
    ----------
    found : Study
        The study.

    Returns
    -------
    list[str]
        For the terminal.
    """
    a = found.arrives
    told = [
        f"every move arrives, without a fault, on {a.passed} of {a.total} machines: "
        f"{100.0 * a.share:.1f} % ({100.0 * a.low:.1f} to {100.0 * a.high:.1f} % at 95 %)"
    ]
    told += [_required(found, f"{r.metric.name} {r.text}", r) for r in found.required]
    if len(found.required) > 1:
        told.append(_required(found, "all of them", *found.required))
    for name, m in metrics(found).items():
        if "quantiles" not in m:
            continue
        low, middle, high = (f"{v:.4g}" for v in m["quantiles"].values())
        unit = "" if m["unit"] == "1" else f" {m['unit']}"
        text = f"{name}: nominal {m['nominal']:.4g}, median {middle}, 5 to 95 % {low} to {high}"
        text += f", worst {m['worst']:.4g}{unit}"
        if "goes_with" in m:
            text += f"; goes with {m['goes_with']} ({m['rank_correlation']:+.2f})"
        told.append(text)
    return told


def _required(found: Study, words: str, *required: Requirement) -> str:
    """On how many machines requirements are met."""
    s = found.met(*required)
    return (
        f"required: {words}: met on {s.passed} of {s.total}, {100.0 * s.share:.1f} % "
        f"({100.0 * s.low:.1f} to {100.0 * s.high:.1f} % at 95 %)"
    )


def draw_figure(found: Study) -> Any:
    """How settling and errors are distributed, or the distance from the path.

    Parameters
    ----------
    found : Study
        The study.

    Returns
    -------
    Any
        A figure of matplotlib.
    """
    figure, axes = new(5.4, 2, 2)
    shown = _JOINT if isinstance(found.nominal, JointTrial) else _SHOWN
    for ax, name in zip(axes.flat, shown, strict=True):
        about = quantities(type(found.nominal), _place(found))[name]
        values = np.array([getattr(t, name) for t in found.found])
        values = values[np.isfinite(values)]
        if len(values):
            ax.hist(values, bins=30, color=BLUE)
            ax.axvline(np.quantile(values, 0.95), color=RED, label="95 %")
        ax.axvline(getattr(found.nominal, name), color=GREEN, linestyle="--", label="nominal")
        finish(
            ax, name.replace("_", " "), f"{about.meaning} [{about.unit}]", "machines", legend=True
        )
    figure.subplots_adjust(hspace=0.6)
    return figure


def write(out: Path, found: Study, kinds: Sequence[str]) -> None:
    """Write all files, or none.

    Parameters
    ----------
    out : Path
        The folder.
    found : Study
        The study.
    kinds : Sequence[str]
        Formats of the figure.
    """
    with folder.staged(out, remove=FILES) as place:
        text = json.dumps(plain(content(found)), indent=2, allow_nan=False)
        (place / NUMBERS).write_text(text + "\n", encoding="utf-8")
        drawings.save(draw_figure(found), place, FIGURE, kinds)
