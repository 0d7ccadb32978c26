"""Whole searches, small ones."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from macromicro.control.settings import Control
from macromicro.errors import InputError
from macromicro.settings import Settings
from macromicro.tuning import loops, words
from macromicro.tuning.request import Request, ready
from macromicro.tuning.search import Tuning, Version
from macromicro.uncertainty.table import of_stage

STRICT = {"saturated": 0.01}


def tuned(stage: str | None = "macro", evaluations: int = 40, **options: object) -> Tuning:
    return ready(Request(stage=stage, evaluations=evaluations, **options)).search()  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def strict() -> Tuning:
    return tuned(evaluations=128, penalties=STRICT)


def said(found: Tuning) -> str:
    return " ".join(words.remarks(found))


def test_macro(strict: Tuning) -> None:
    """By the thesis' own standard, no overshoot and no saturation, it costs less than (4.10)."""
    before, after = strict.first.runs[0], strict.best.runs[0]
    assert before["saturated"] > 0.0 == after["saturated"] == after["overshoot"]
    assert strict.best.cost == pytest.approx(after["settling_time"])
    assert strict.best.cost < strict.first.cost
    assert strict.better and strict.verdict == (strict.first.cost, strict.best.cost)
    assert "are better: objective 2." in said(strict)
    assert "but the limit is" not in said(strict)
    assert "Worse than before: time from which the error stays within 2 %" in said(strict)


def test_a_seed_repeats_it(strict: Tuning) -> None:
    again = tuned(evaluations=128, penalties=STRICT)
    assert again.best.settings == strict.best.settings and again.history == strict.history


def test_saturation_allowed_is_faster(strict: Tuning) -> None:
    free = tuned(evaluations=128)
    first, last = free.first.runs[0], free.best.runs[0]
    assert last["settling_time"] < first["settling_time"]
    assert last["settling_time"] < strict.best.runs[0]["settling_time"]
    assert last["overshoot"] == 0.0
    asked = last["peak_effort"]
    assert asked > 5.0 and f"up to {asked:.5g} V, but the limit is 5 V" in said(free)


@pytest.mark.parametrize("law", ["pd-tuned", "pid"])
def test_what_is_written_is_what_was_judged(law: str) -> None:
    found = tuned(law=law)
    assert found.first.settings.controller == Control(macro_law=law)
    again = ready(Request(stage="macro", settings=found.best.settings, evaluations=1)).search()
    assert again.first.runs[0] == found.best.runs[0]
    assert again.first.cost == found.best.cost


def test_micro() -> None:
    """What won keeps still."""
    found = tuned("micro", 60)
    assert found.best.cost < found.first.cost
    (margin,) = found.subject.margins(found.best.settings)
    assert margin.value >= loops.LEAST
    assert "not defined" in said(found)


def test_robust() -> None:
    """Searched on several machines; the verdict is that of fresh ones."""
    found = tuned(robust=True, machines=3, fresh=20, seed=2)
    assert len(found.first.runs) == 3 and found.amounts.shape == (2, len(of_stage("macro")))
    # The machine as it is belongs to those of the search.
    alone = tuned(evaluations=1, seed=2)
    assert found.first.runs[0] == alone.first.runs[0]
    assert found.first.cost >= alone.first.cost
    fresh = found.fresh
    assert fresh is not None and fresh.amounts.shape == (20, len(of_stage("macro")))
    assert not np.isin(fresh.amounts, found.amounts).any()
    assert found.verdict == fresh.costs
    assert found.better is (fresh.costs[1] < fresh.costs[0])
    assert f"cost less on {fresh.cheaper} of 20 fresh machines" in said(found)


def test_a_win_on_the_searched_machines_alone_is_no_win(strict: Tuning) -> None:
    fresh = tuned(evaluations=1, robust=True, machines=2, fresh=2).fresh
    assert fresh is not None
    worse = strict._replace(fresh=fresh._replace(costs=(2.0, 3.0), cheaper=0))
    assert not worse.better
    assert "not better on fresh machines: objective 2 to 3 s" in said(worse)


def test_the_best_that_is_known_is_kept() -> None:
    """One evaluation is the start's own: nothing changes."""
    found = tuned(evaluations=1)
    assert found.best is found.first and found.evaluations == 1 and not found.better
    assert "No design was better than the start" in said(found)


def test_what_is_not_reached_any_more_is_worse(strict: Tuning) -> None:
    """A carriage that settled and now never does: NaN is above no number."""
    before, after = strict.first, strict.best

    def stuck(version: Version) -> Version:
        return version._replace(runs=[{**version.runs[0], "settling_time": math.nan}])

    told = said(strict._replace(versions=(before, stuck(after))))
    assert "within 2 % of the step 0.628 to no value" in told
    told = said(strict._replace(versions=(stuck(before), after)))
    assert "within 2 % of the step" not in told


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"stage": "nano"}, "stage"),
        ({"stage": None}, "Give macro or micro"),
        ({"evaluations": 0}, "--evaluations"),
        ({"objective": "x"}, "--objective"),
        ({"law": "pi"}, "--law"),
        ({"seed": -1}, "--seed"),
        ({"robust": True, "machines": 0}, "--benches"),
        ({"robust": True, "fresh": 1}, "--held-out"),
        ({"machines": 16}, "--benches: only with --robust"),
        ({"stage": "micro", "fresh": 100}, "--held-out: only with --robust"),
        ({"stage": "micro", "penalties": {"saturated": 1.0}}, "--penalty saturated: unknown"),
        ({"penalties": {"overshoot": -1.0}}, "--penalty overshoot: -1"),
        ({"config": Path("none.toml")}, "none.toml"),
    ],
)
def test_bad_requests(options: dict[str, object], named: str) -> None:
    with pytest.raises(InputError, match=named):
        ready(Request(**{"stage": "macro", **options}))  # type: ignore[arg-type]


def test_settings_are_the_start() -> None:
    slow = Settings(controller=Control(dead_zone=2.8))
    found = ready(Request(stage="macro", settings=slow, law="pd-initial")).subject
    assert found.start.controller == slow.controller._replace(macro_law="pd-initial")
