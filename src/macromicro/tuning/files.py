"""The folder of a tuning: settings for ``macromicro run --config``, numbers, figures."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import macromicro
from macromicro.drawing import files as drawings
from macromicro.runs import folder
from macromicro.schema import config
from macromicro.schema.text import plain, printable, write_text
from macromicro.settings import Settings
from macromicro.tuning import _pictures, tables
from macromicro.tuning.tune import Plan, Tuning

SETTINGS, NUMBERS = "tuned.toml", "tuning.json"
FILES = (SETTINGS, NUMBERS, *drawings.names((_pictures.RESPONSE, _pictures.BODE)))
_BYTES = 2_000_000


def check(out: Path, *, overwrite: bool) -> None:
    """Refuse a folder that the results cannot go to."""
    folder.check(out, _BYTES, overwrite=overwrite, names=FILES)


def write(out: Path, found: Tuning, kinds: Iterable[str] = drawings.DEFAULT) -> None:
    with folder.staged(out, remove=FILES) as place:
        write_text(place / SETTINGS, as_toml(found))
        write_text(place / NUMBERS, as_json(found))
        for name, figure in _pictures.drawn(found):
            drawings.save(figure, place, name, kinds)


def as_toml(found: Tuning) -> str:
    """The tuned law as a file for `macromicro run --config`."""
    plan, tuned = found.plan, found.tuned
    ways = "the thesis' route" if plan.request.route == "thesis" else "differential evolution"
    about = [
        f"# {plan.request.stage} law {plan.law.name}, tuned by {ways} for {plan.objective.name}",
        f"# {found.evaluations} {_tried(plan)}, macromicro {macromicro.__version__}",
        *(f"# {printable(line, 300)}" for line in tables.remarks(found)),
    ]
    return "\n".join(about) + "\n\n" + config.changed_toml(tuned, Settings(), plan.law.chosen)


def _tried(plan: Plan) -> str:
    if plan.request.route == "thesis":
        return "trials on the thesis' model"
    return f"evaluations on {plan.engine}, seed {plan.seed}"


def as_json(found: Tuning) -> str:
    """Everything but the recordings."""
    plan, request = found.plan, found.plan.request
    record: dict[str, Any] = {
        "version": macromicro.__version__,
        "stage": request.stage,
        "law": plan.law.name,
        "route": request.route,
        "objective": {
            "name": plan.objective.name,
            "unit": plan.objective.unit,
            "formula": plan.objective.formula,
            "penalties": plan.weights,
        },
        "engine": plan.engine,
        "seed": None if request.route == "thesis" else plan.seed,
        "evaluations": found.evaluations,
        "search": [k._asdict() for k in plan.law.knobs],
        "gains": _pairs(tables.gains(found)),
        "engine_cost": _pair(found.engine_costs),
        "bench_objective": _pair(found.bench_values),
        "bench": _pairs(tables.measured(found)),
        "bench_metrics": _pair([shown.metrics for shown in found.bench]),
        "better_on_the_bench": found.better,
        "judged_on": "the bench" if found.held_out is None else "held-out benches",
        "remarks": list(tables.remarks(found)),
        "margins": None if found.margins is None else _pair([m._asdict() for m in found.margins]),
        "ripple_margin": None if found.ripple_margins is None else _pair(found.ripple_margins),
        "ensemble": _ensemble(found),
        "passed_over": found.rejected,
        "history": found.history,
        "trials": found.trials,
        "overrides": config.difference(found.tuned, Settings()),
    }
    return json.dumps(plain(record, spelled=True), indent=2, allow_nan=False) + "\n"


def _ensemble(found: Tuning) -> dict[str, Any] | None:
    searched, fresh = found.plan.ensemble, found.plan.held_out
    if searched is None or fresh is None:
        return None
    return {
        "aggregate": searched.aggregate,
        "seed": searched.seed,
        "ranges": [each._asdict() for each in searched.uncertain],
        "draws": searched.draws.tolist(),
        "bench_cost": None if found.robust_costs is None else _pair(found.robust_costs),
        "held_out": {
            "draws": fresh.draws.tolist(),
            "bench_cost": None if found.held_out is None else _pair(found.held_out.costs),
            "cheaper_on": None if found.held_out is None else found.held_out.cheaper,
        },
    }


def _pair(values: Any) -> dict[str, Any]:
    before, after = values
    return {"before": before, "after": after}


def _pairs(lines: list[tables.Line]) -> list[dict[str, Any]]:
    return [line._asdict() for line in lines]
