"""Robustness of a machine of one stage: machines that differ from its sheets under its own law.

The law, the motion, the guard and what counts as arrived stay those of the nominal settings: nobody
knows the machine that was drawn.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import macromicro
from macromicro.arrays import Array
from macromicro.columns import quantities
from macromicro.drawing import files as drawings
from macromicro.drawing.style import BLUE, GREEN, RED, finish, new
from macromicro.errors import InputError
from macromicro.machines.machine import Machine
from macromicro.machines.sequence import Plan
from macromicro.machines.trial import Trial, trials
from macromicro.robustness.statistics import CONFIDENCE, Share, share
from macromicro.runs import folder
from macromicro.schema.text import plain
from macromicro.uncertainty.machines import draw, settings_at
from macromicro.uncertainty.table import AXIS, PIEZO, WIRE, Uncertain

LEAST, MOST = 10, 100_000  # machines
NUMBERS, FIGURE = "robust.json", "robust"
FILES = (NUMBERS, *drawings.names((FIGURE,)))
KEPT = ("controller", "guard", "motion", "arrival", "travel")
_TABLES = {"axis": AXIS, "piezo": PIEZO, "wire": WIRE}
_LEVELS = (0.05, 0.5, 0.95)


class Study(NamedTuple):
    """What was found.

    Attributes
    ----------
    machine : Machine
        The machine.
    rows : tuple[Uncertain, ...]
        What was varied.
    amounts : ndarray, shape (n, rows)
        Of each machine.
    nominal : Trial
        Of the settings themselves.
    found : list[Trial]
        Of the machines, perhaps fewer than were drawn.
    asked : int
        Machines that were drawn.
    seed : int
        Of the draw.
    """

    machine: Machine
    rows: tuple[Uncertain, ...]
    amounts: Array
    nominal: Trial
    found: list[Trial]
    asked: int
    seed: int

    @property
    def arrives(self) -> Share:
        """Share of the machines on which every move arrives and no fault stops the run."""
        good = sum(t.fault == 0.0 and t.missed == 0.0 for t in self.found)
        return share(good, len(self.found))


def uncertain(machine: Machine, settings: Any) -> tuple[Uncertain, ...]:
    """What is not known about a machine, of what it has.

    Parameters
    ----------
    machine : Machine
        The machine.
    settings : Any
        Its settings.

    Returns
    -------
    tuple[Uncertain, ...]
        Rows of its table of which some parameter is not 0.

    Raises
    ------
    InputError
        There is no such table for this machine.
    """
    if machine.name not in _TABLES:
        raise InputError("--config", machine.name, f"one of {', '.join(_TABLES)}")
    rows = _TABLES[machine.name]
    return tuple(r for r in rows if any(_value(settings, path) != 0.0 for path, _ in r.parts))


def _value(tree: Any, path: str) -> float:
    for name in path.split("."):
        tree = getattr(tree, name)
    return float(tree)


def machines(
    settings: Any, rows: Sequence[Uncertain], n: int, seed: int
) -> tuple[Array, list[Any]]:
    """Draw machines around settings that control them.

    Parameters
    ----------
    settings : Any
        The nominal machine.
    rows : Sequence[Uncertain]
        What is not known.
    n : int
        How many.
    seed : int
        Of the draw.

    Returns
    -------
    amounts : ndarray, shape (n, rows)
        Of each row.
    trees : list[Any]
        Settings, with the nominal law, motion, guard and arrival.
    """
    amounts = draw(settings, rows, n, seed).amounts
    own = {name: getattr(settings, name) for name in KEPT}
    return amounts, [settings_at(settings, rows, each)._replace(**own) for each in amounts]


def study(
    machine: Machine,
    settings: Any,
    plan: Plan,
    samples: int,
    seed: int,
    workers: int,
    done: Callable[[int], bool] = lambda n: False,
) -> Study:
    """Run a plan on machines that differ from their sheets.

    Parameters
    ----------
    machine : Machine
        The machine.
    settings : Any
        The nominal one.
    plan : Plan
        What is to be run.
    samples : int
        Machines, from `LEAST` to `MOST`.
    seed : int
        Of the draw and the noise.
    workers : int
        Threads.
    done : Callable[[int], bool], optional
        Hears runs done; when it answers True, the rest is left out.

    Returns
    -------
    Study
        What was found.

    Raises
    ------
    InputError
        Too few or too many samples, or no table for this machine.
    """
    if not LEAST <= samples <= MOST:
        raise InputError("--samples", samples, f"a whole number from {LEAST} to {MOST}")
    rows = uncertain(machine, settings)
    amounts, trees = machines(settings, rows, samples, seed)
    seeds = [seed, *(seed + k for k in range(samples))]
    found = trials(machine, [settings, *trees], plan, seeds, workers, done)
    return Study(machine, rows, amounts, found[0], found[1:], samples, seed)


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
    for name, about in quantities(Trial).items():
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


def draw_figure(found: Study) -> Any:
    """How settling, errors and overshoot are distributed.

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
    for ax, name in zip(
        axes.flat, ("settling", "peak_error", "rest_error", "true_error"), strict=True
    ):
        about = quantities(Trial)[name]
        values = np.array([getattr(t, name) for t in found.found])
        values = values[np.isfinite(values)]
        if len(values):
            ax.hist(values, bins=30, color=BLUE)
            ax.axvline(np.quantile(values, 0.95), color=RED, label="95 %")
        ax.axvline(getattr(found.nominal, name), color=GREEN, linestyle="--", label="nominal")
        finish(ax, about.meaning, f"[{about.unit}]", "machines", legend=True)
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
