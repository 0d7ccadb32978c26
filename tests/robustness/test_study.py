"""What a study says of a machine whose answers are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.batch.programme_metrics import NAMES
from macromicro.robustness import _findings, study, words
from macromicro.robustness._findings import influences, overall, worst, yields
from macromicro.robustness.study import Request, Study
from macromicro.robustness.subject import Subject
from macromicro.schema.par import replaced
from macromicro.uncertainty.table import UNCERTAIN

ORDER = [u.name for u in UNCERTAIN]


def amounts(done: Study, name: str) -> np.ndarray:
    return done.sample.amounts[:, ORDER.index(name)]


def column(done: Study, name: str) -> np.ndarray:
    return done.column(name)


def test_yields_count_what_the_machine_does(done: Study) -> None:
    found = {y.requirement.metric.name: y for y in yields(done)}
    coulomb, ambient = amounts(done, "coulomb"), amounts(done, "ambient")
    running = coulomb <= 1.25
    assert found["fault"].all.passed == running.sum()
    assert found["macro_settling"].all.passed == (coulomb <= 1.15).sum()
    good = running & (ambient <= 31.0)
    assert found["micro_error"].all[:2] == (good.sum(), 40)
    assert found["micro_error"].known[:2] == (good.sum(), running.sum())
    assert found["micro_error"].nominal == 2.0
    assert overall(done).passed == ((coulomb <= 1.15) & (ambient <= 31.0)).sum()


def test_each_run_of_the_sample_has_its_own_noise_and_the_tornado_one(done: Study) -> None:
    vibration = column(done, "vibration")
    known = ~np.isnan(vibration)
    assert (vibration[known] == 7.0 + np.arange(40)[known]).all()
    single = done.single[:, :, NAMES.index("vibration")]
    assert (single[~np.isnan(single)] == 7.0).all()


def test_influences_are_sorted_by_effect(done: Study) -> None:
    found = influences(done, "micro_error")
    assert [i.parameter.name for i in found[:2]] == ["coulomb", "ambient"]
    assert (found[0].low, found[0].effect) == (2.0, math.inf)
    assert math.isnan(found[0].high)
    assert (found[1].low, found[1].high, found[1].effect) == (2.0, 9.0, 7.0)
    assert found[1].correlation.value > 0.5 and found[1].correlation.significant(20)
    assert all(i.effect == 0.0 for i in found[2:])


def test_infinite_settling_is_the_largest_effect(done: Study, machine: Subject) -> None:
    narrow = [u if u.name != "coulomb" else u._replace(high=1.2) for u in UNCERTAIN]
    again = study.run(done.request, machine._replace(uncertain=tuple(narrow)))
    first = influences(again, "macro_settling")[0]
    assert (first.parameter.name, first.high, first.effect) == ("coulomb", math.inf, math.inf)


def test_worst_is_the_largest_and_of_equals_the_nearest(done: Study) -> None:
    found = {w.requirement.metric.name: w for w in worst(done)}
    error = column(done, "micro_error")
    assert found["micro_error"].value == np.nanmax(error)
    assert error[found["micro_error"].sample] == np.nanmax(error)
    fault = found["fault"]
    assert (fault.value, fault.fault) == (1.0, 2)
    spans = np.array([u.high - u.low for u in UNCERTAIN])
    middle = np.array(
        [25.0 if u.name == "ambient" else float(u.kind == "factor") for u in UNCERTAIN]
    )
    away = np.abs((done.sample.amounts - middle) / spans).sum(axis=1)
    stopped = column(done, "fault") == 1.0
    assert away[fault.sample] == away[stopped].min()


def test_a_worst_case_that_never_settles_says_how_many_do_not(done: Study) -> None:
    found = {w.requirement.metric.name: words.worst_value(done, w) for w in worst(done)}
    settling = column(done, "macro_settling")
    never, known = np.isinf(settling).sum(), (~np.isnan(settling)).sum()
    assert 0 < never < known < 40
    assert found["macro_settling"] == f"never; {never} of {known} never settled"
    assert found["micro_error"].endswith(" um")


def test_strongest_takes_the_hardest_requirement(done: Study) -> None:
    name, ranked = _findings.strongest(done)
    shares = {y.requirement.metric.name: y.all.share for y in yields(done)}
    assert shares[name] == min(shares.values())
    assert abs(ranked[0].correlation.value) >= abs(ranked[1].correlation.value)


def test_workers_change_nothing(request_: Request, machine: Subject) -> None:
    one, three = (study.run(request_, machine._replace(workers=n)) for n in (1, 3))
    np.testing.assert_array_equal(one.rows, three.rows)
    np.testing.assert_array_equal(one.single, three.single)


def test_interrupted_keeps_the_first_rows(request_: Request, done: Study, machine: Subject) -> None:
    found = study.run(request_, machine, lambda k, _: k >= 9)
    assert found.interrupted
    assert 8 <= len(found.rows) < 40
    np.testing.assert_array_equal(found.rows, done.rows[: len(found.rows)])
    assert np.isnan(found.single).all()
    assert overall(found).total == len(found.rows)
    assert not done.interrupted


def test_interrupted_in_the_tornado_keeps_the_sample(
    request_: Request, done: Study, machine: Subject
) -> None:
    found = study.run(request_, machine, lambda k, _: k >= 50)
    assert found.interrupted
    np.testing.assert_array_equal(found.rows, done.rows)
    assert not np.isnan(found.single[0, 0, 0])
    assert np.isnan(found.single[-1, 1, 0])


def test_an_end_that_is_no_machine_is_reported(request_: Request, machine: Subject) -> None:
    """A belt's share of 0.7 cannot be doubled: it is at most 1."""
    base = replaced(request_.settings, "bench.belt.participation", 0.7)
    found = study.run(request_._replace(settings=base), machine)
    assert list(found.impossible) == ["belt_share high"]
    assert np.isnan(found.single[ORDER.index("belt_share"), 1]).all()
    assert not math.isnan(influences(found, "micro_error")[0].effect)


def test_a_failing_job_is_not_hidden(request_: Request, machine: Subject) -> None:
    def run(tree: object, seed: int) -> list[float]:
        raise ZeroDivisionError(f"seed {seed}")

    with pytest.raises(ZeroDivisionError, match="seed 7"):
        study.run(request_, machine._replace(run=run))


def test_the_limit_itself_is_met_and_what_is_unknown_is_not(done: Study) -> None:
    requirement = next(r for r in done.request.requirements if r.metric.name == "micro_error")
    rows = np.zeros((5, len(NAMES)))
    rows[:, NAMES.index("micro_error")] = [5.0, 5.0 + 1e-9, math.inf, math.nan, 0.0]
    found = done._replace(rows=rows)
    assert found.met(requirement).tolist() == [True, False, False, False, True]
    assert found.met().all()


def test_without_a_tornado_only_the_sample_runs(request_: Request, machine: Subject) -> None:
    found = study.run(request_._replace(single=False), machine)
    assert len(found.rows) == 40 and not found.interrupted
    assert np.isnan(found.single).all() and not found.impossible


def test_machines_that_arrive_are_counted(done: Study) -> None:
    coulomb = amounts(done, "coulomb")
    assert done.arrived().passed == (coulomb <= 1.15).sum()
