"""Whole tunings, small ones."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro import tuning
from macromicro.control.settings import Control
from macromicro.errors import InputError
from macromicro.experiments import macro_design
from macromicro.settings import Settings
from macromicro.tuning import laws, loops, tables
from macromicro.tuning.tune import Request, check, judge, search


@pytest.fixture(scope="module")
def quick() -> tuning.Tuning:
    return tuning.macro(evaluations=128)


def test_macro_on_the_model(quick: tuning.Tuning) -> None:
    """By the thesis' own standard, no overshoot and no saturation, it beats (4.10), and says
    that this costs time."""
    before, after = (shown.metrics for shown in quick.bench)
    assert quick.plan.engine == "macro-model"
    assert quick.engine_costs[1] < quick.engine_costs[0]
    assert before["saturated"] > 0.0
    assert after["saturated"] == after["overshoot"] == 0.0
    assert quick.bench_costs[1] == pytest.approx(after["settling_time"])
    assert quick.better
    said = " ".join(tables.remarks(quick))
    assert "is better on the bench" in said
    assert "Worse on the bench than before: settling into 2 %" in said


def test_a_seed_repeats_it(quick: tuning.Tuning) -> None:
    again = tuning.macro(evaluations=128)
    assert again.tuned == quick.tuned
    assert again.history == quick.history


def test_on_the_bench_the_engine_and_the_run_agree() -> None:
    """The engine's bench and the recorded run are one: the same costs, bit for bit."""
    found = tuning.macro(evaluations=40, on="bench", saturate=True)
    assert found.engine_costs == pytest.approx(found.bench_costs, rel=1e-9)


def test_saturation_allowed_is_faster(quick: tuning.Tuning) -> None:
    free = tuning.macro(evaluations=128, saturate=True)
    first, last = (shown.metrics for shown in free.bench)
    assert last["settling_time"] < first["settling_time"]
    assert last["settling_time"] < quick.bench[1].metrics["settling_time"]
    assert last["overshoot"] == 0.0


def test_the_thesis_route() -> None:
    """Ends at the rule of `macro_design`, Figures 4.22 and 4.23 on its way."""
    found = tuning.macro(route="thesis")
    assert found.tuned.controller.pd_tuned == pytest.approx(macro_design.chosen().taps)
    assert found.evaluations == len(found.trials)
    swept = [t["value"] for t in found.trials if t["swept"] == "damping ratio"]
    assert swept == list(macro_design.RATIOS)
    assert found.bench[1].metrics["saturated"] == 0.0


def test_another_law_starts_from_its_own_gains() -> None:
    found = tuning.macro(law="pid", evaluations=30)
    assert found.plan.engine == "macro-bench"
    assert found.plan.start.controller == Control(macro_law="pid")
    assert found.engine_costs[1] <= found.engine_costs[0]
    assert found.margins is not None


def test_micro() -> None:
    """The engine's bench is the one of the recorded runs, and what won keeps still."""
    found = tuning.micro(evaluations=60)
    assert found.margins is None
    assert found.ripple_margins is not None
    assert found.ripple_margins[1] >= loops.LEAST
    assert found.engine_costs[1] < found.engine_costs[0]
    assert found.engine_costs == pytest.approx(found.bench_costs, rel=1e-9)
    assert "not defined" in " ".join(tables.remarks(found))


def test_robust() -> None:
    """Judged by the worst of the benches, on the model and then on full benches."""
    found = tuning.macro(evaluations=40, robust=True, benches=3, seed=2)
    assert found.robust_costs is not None
    assert found.plan.ensemble is not None
    assert found.plan.ensemble.draws.shape == (3, 5)
    # The bench as it is belongs to the ensemble.
    assert found.robust_costs[0] >= found.bench_costs[0] - 1e-9
    assert found.robust_costs[1] >= found.bench_costs[1] - 1e-9


def test_it_says_when_nothing_was_won() -> None:
    """A design that the bench does not like is not called better."""
    plan = check(Request("macro", evaluations=5))
    searched = search(plan)
    bad = judge(searched._replace(gains=np.array([0.05, -0.0])))
    assert not bad.better
    assert "NOT better" in " ".join(tables.remarks(bad))
    present = laws.gains_of(plan.start.controller, plan.law)
    same = judge(searched._replace(gains=present))
    assert not same.better
    assert "no better" in " ".join(tables.remarks(same))


def test_the_best_that_is_known_is_kept() -> None:
    """One evaluation is the start's own: nothing changes."""
    found = tuning.macro(evaluations=1)
    assert found.tuned == found.plan.start
    assert found.evaluations == 1


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"stage": "nano"}, "stage"),
        ({"stage": "macro", "evaluations": 0}, "--evaluations"),
        ({"stage": "macro", "objective": "x"}, "--objective"),
        ({"stage": "macro", "law": "pi"}, "--law"),
        ({"stage": "macro", "law": "pid", "on": "model"}, "--on"),
        ({"stage": "micro", "on": "model"}, "--on"),
        ({"stage": "macro", "on": "moon"}, "--on"),
        ({"stage": "macro", "route": "x"}, "--route"),
        ({"stage": "micro", "route": "thesis"}, "--route"),
        ({"stage": "macro", "route": "thesis", "robust": True}, "--robust"),
        ({"stage": "macro", "seed": -1}, "--seed"),
        ({"stage": "macro", "robust": True, "benches": 0}, "--benches"),
    ],
)
def test_bad_requests(options: dict[str, object], named: str) -> None:
    with pytest.raises(InputError, match=named):
        check(Request(**options))  # type: ignore[arg-type]


def test_settings_are_the_start() -> None:
    slow = Settings(controller=Control(dead_zone=2.8))
    plan = check(Request("macro", settings=slow, law="pd-initial"))
    assert plan.start.controller == slow.controller._replace(macro_law="pd-initial")
