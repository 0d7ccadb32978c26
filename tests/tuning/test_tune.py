"""Whole tunings, small ones."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro import tuning
from macromicro.control.pd import PdTuned
from macromicro.control.settings import Control
from macromicro.design.margins import PdTaps
from macromicro.errors import InputError
from macromicro.settings import Settings
from macromicro.tuning import _laws, loops, tables, thesis
from macromicro.tuning.tune import Request, check, judge, search
from macromicro.uncertainty.table import of_stage

STRICT = (("saturated", 0.01),)


@pytest.fixture(scope="module")
def quick() -> tuning.Tuning:
    return tuning.macro(evaluations=128, penalties=STRICT)


def test_macro(quick: tuning.Tuning) -> None:
    """By the thesis' own standard, no overshoot and no saturation, it costs less than (4.10): the
    objective with its penalties is one number, and it says what has become worse for it."""
    before, after = (shown.metrics for shown in quick.bench)
    assert quick.plan.engine == "macro-bench"
    assert quick.engine_costs[1] < quick.engine_costs[0]
    assert before["saturated"] > 0.0
    assert after["saturated"] == after["overshoot"] == 0.0
    assert quick.bench_costs[1] == pytest.approx(after["settling_time"])
    assert quick.bench_costs[1] < quick.bench_costs[0] and quick.better
    said = " ".join(tables.remarks(quick))
    assert "is better on the bench: objective 2." in said
    assert "but the limit is" not in said
    assert "saturated: 0.01 s x (sample saturated after the first)" in said
    assert "Worse on the bench than before: settling into 2 %" in said


def test_a_seed_repeats_it(quick: tuning.Tuning) -> None:
    again = tuning.macro(evaluations=128, penalties=STRICT)
    assert again.tuned == quick.tuned
    assert again.history == quick.history


def test_the_engine_and_the_run_agree() -> None:
    """The engine's bench and the recorded run are one: the same costs, bit for bit."""
    found = tuning.macro(evaluations=40)
    assert found.engine_costs == found.bench_costs


def test_saturation_allowed_is_faster(quick: tuning.Tuning) -> None:
    free = tuning.macro(evaluations=128)
    first, last = (shown.metrics for shown in free.bench)
    assert last["settling_time"] < first["settling_time"]
    assert last["settling_time"] < quick.bench[1].metrics["settling_time"]
    assert last["overshoot"] == 0.0
    assert free.better
    said = " ".join(tables.remarks(free))
    assert "is better on the bench: objective 0.628 to 0.4" in said
    asked = last["peak_effort"]
    assert asked > 5.0
    assert f"requests up to {asked:.5g} V, but the limit is 5 V" in said
    assert "no penalty for: saturated" in said


@pytest.mark.parametrize("objective", ["settling", "iae", "effort"])
def test_without_penalties_what_is_named_is_what_is_minimised(objective: str) -> None:
    off = (("overshoot", 0.0), *((("slower", 0.0),) if objective == "effort" else ()))
    found = tuning.macro(objective=objective, evaluations=10, penalties=off)
    assert found.bench_costs == found.bench_values


def test_the_thesis_route() -> None:
    """Ends at the rule of `macro_design`, Figures 4.22 and 4.23 on its way."""
    found = tuning.macro(route="thesis")
    assert found.tuned.controller.pd_tuned == pytest.approx(thesis.chosen().taps)
    assert found.evaluations == len(found.trials)
    swept = [t["value"] for t in found.trials if t["swept"] == "damping ratio"]
    assert swept == list(thesis.RATIOS)
    assert found.bench[1].metrics["saturated"] == 0.0


def test_the_thesis_route_takes_the_laws_own_dead_zone() -> None:
    """An inverse that lifts too much leaves less below the limit: the rule ends later, and
    what it ends at keeps to the rule on the bench, which the taps for 3 V do not."""
    lifted = Settings(controller=Control(dead_zone=4.0))
    found = tuning.macro(route="thesis", settings=lifted)
    metrics = found.bench[1].metrics
    assert metrics["saturated"] == metrics["overshoot"] == 0.0
    last = found.trials[-1]
    assert last["saturated"] == 0.0
    assert last["crossover"] < thesis.chosen().crossover.frequency  # type: ignore[operator]
    plain = np.array(thesis.chosen().taps)
    other = judge(search(check(Request("macro", settings=lifted)))._replace(gains=plain))
    assert other.bench[1].metrics["saturated"] > 100.0
    assert other.bench[1].metrics["overshoot"] > 0.0


def test_the_thesis_route_takes_the_laws_own_derivative_time() -> None:
    """Where the law leads; (4.9) does not, so it gets the one of (4.10)."""
    longer = Control(pd_tuned=PdTuned(0.0224593, -0.0212178))
    found = tuning.macro(route="thesis", settings=Settings(controller=longer))
    taps = PdTaps(*found.tuned.controller.pd_tuned)
    assert taps.derivative_time(1e-3) == pytest.approx(
        PdTaps(*longer.pd_tuned).derivative_time(1e-3)
    )
    first = tuning.macro(route="thesis", law="pd-initial").tuned.controller.pd_initial
    assert first == pytest.approx(thesis.chosen().taps)


def test_the_thesis_route_says_when_the_rule_has_no_end() -> None:
    full = Settings(controller=Control(dead_zone=4.999))
    with pytest.raises(InputError, match=r"dead-zone inverse of 4\.999 V"):
        tuning.macro(route="thesis", settings=full)


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
    """Searched on an ensemble; the verdict is that of fresh benches."""
    found = tuning.macro(evaluations=40, robust=True, benches=3, held_out=20, seed=2)
    assert found.robust_costs is not None
    assert found.plan.ensemble is not None
    assert found.plan.ensemble.draws.shape == (3, len(of_stage("macro")))
    # The bench as it is belongs to the ensemble.
    assert found.robust_costs[0] >= found.bench_costs[0] - 1e-9
    assert found.robust_costs[1] >= found.bench_costs[1] - 1e-9
    assert found.held_out is not None
    assert found.plan.held_out is not None
    draws = found.plan.held_out.draws
    assert draws.shape == (20, len(of_stage("macro")))
    assert not np.isin(draws, found.plan.ensemble.draws).any()
    assert found.verdict == found.held_out.costs
    assert found.better is (found.held_out.costs[1] < found.held_out.costs[0])
    assert f"lower on {found.held_out.cheaper} of 20 fresh benches" in " ".join(
        tables.remarks(found)
    )


def test_a_win_on_the_searched_benches_alone_is_no_win() -> None:
    """Sixteen benches are soon fitted: with seed 0 and saturation penalised the search on the
    bench halves their worst cost, and fresh benches say that it is worse than (4.10)."""
    plan = check(Request("macro", robust=True, penalties=STRICT))
    fitted = np.array([0.49779322249736835, -0.4853987794453372])
    found = judge(search(plan._replace(evaluations=1))._replace(gains=fitted))
    assert found.robust_costs is not None
    assert found.robust_costs[1] < 0.5 * found.robust_costs[0]
    assert found.held_out is not None
    assert found.held_out.costs[1] > found.held_out.costs[0]
    assert "not better on fresh benches: objective 15." in " ".join(tables.remarks(found))


def test_it_says_when_nothing_was_won() -> None:
    """A design that the bench does not like is not called better."""
    plan = check(Request("macro", evaluations=5))
    searched = search(plan)
    bad = judge(searched._replace(gains=np.array([0.0002, -0.0])))
    assert not bad.better
    assert "not better" in " ".join(tables.remarks(bad))
    present = _laws.gains_of(plan.start.controller, plan.law)
    same = judge(searched._replace(gains=present))
    assert not same.better
    assert "not better" in " ".join(tables.remarks(same))


def test_what_is_not_reached_any_more_is_worse(quick: tuning.Tuning) -> None:
    """A carriage that settled and now never does: NaN is above no number."""
    before, after = quick.bench
    stuck = after._replace(metrics={**after.metrics, "settling_time": math.nan})
    said = " ".join(tables.remarks(quick._replace(bench=(before, stuck))))
    assert "settling into 2 % 0.628 to no value" in said
    freed = " ".join(tables.remarks(quick._replace(bench=(stuck, before))))
    assert "settling into 2 %" not in freed


@pytest.mark.parametrize("law", ["pd-tuned", "pid"])
def test_gains_are_judged_as_they_are_written(law: str) -> None:
    """To eight digits in the units of the table: what is read back is what was judged."""
    found = tuning.macro(law=law, evaluations=40)
    for line in tables.gains(found):
        assert line.after == pytest.approx(float(f"{line.after:.8g}"), rel=1e-14, abs=0.0)
    gains = _laws.gains_of(found.tuned.controller, found.plan.law)
    assert judge(search(found.plan)).bench_costs == found.bench_costs
    assert (found.plan.law.rounded(gains[None, :])[0] == gains).all()


def test_the_objective_is_told_once_with_its_terms(quick: tuning.Tuning) -> None:
    lines = list(tables.text(quick))
    (total,) = [line for line in lines if line.strip().startswith("objective")]
    rows = {line.name: line for line in tables.measured(quick)}
    parts = rows["settling"], rows["and its penalties"]
    whole = rows["objective, the sum of both"]
    for side in ("before", "after"):
        assert sum(getattr(p, side) for p in parts) == pytest.approx(getattr(whole, side))
    assert not [line for line in lines if "cost" in line], total


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
        ({"stage": "macro", "route": "x"}, "--route"),
        ({"stage": "micro", "route": "thesis"}, "--route"),
        ({"stage": "macro", "route": "thesis", "robust": True}, "--robust"),
        ({"stage": "macro", "seed": -1}, "--seed"),
        ({"stage": "macro", "robust": True, "benches": 0}, "--benches"),
        ({"stage": "macro", "robust": True, "held_out": 1}, "--held-out"),
        ({"stage": "macro", "benches": 16}, "--benches: only with --robust"),
        ({"stage": "macro", "aggregate": "worst"}, "--aggregate: only with --robust"),
        ({"stage": "micro", "held_out": 100}, "--held-out: only with --robust"),
        ({"stage": "micro", "penalties": (("saturated", 1.0),)}, "--penalty saturated: unknown"),
        ({"stage": "macro", "penalties": (("slower", 1.0),)}, "--penalty slower: unknown"),
        ({"stage": "macro", "penalties": (("overshoot", -1.0),)}, "--penalty overshoot: -1"),
        (
            {"stage": "macro", "route": "thesis", "penalties": STRICT},
            "--penalty: not allowed with --route",
        ),
        (
            {"stage": "macro", "route": "thesis", "evaluations": 300},
            "--evaluations: not allowed with --route",
        ),
        ({"stage": "macro", "route": "thesis", "seed": 0}, "--seed: not allowed with --route"),
    ],
)
def test_bad_requests(options: dict[str, object], named: str) -> None:
    with pytest.raises(InputError, match=named):
        check(Request(**options))  # type: ignore[arg-type]


def test_settings_are_the_start() -> None:
    slow = Settings(controller=Control(dead_zone=2.8))
    plan = check(Request("macro", settings=slow, law="pd-initial"))
    assert plan.start.controller == slow.controller._replace(macro_law="pd-initial")
