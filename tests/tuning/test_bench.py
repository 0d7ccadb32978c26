"""Objectives and runs of the two-stage machine's stages."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro import batch
from macromicro.control.settings import Control
from macromicro.errors import InputError
from macromicro.settings import Settings
from macromicro.tuning import gains
from macromicro.tuning.bench import MACRO_OBJECTIVES, MICRO_OBJECTIVES, Macro, Micro
from macromicro.tuning.subject import FAILED, Objective

NAN = float("nan")
MACRO = {
    "settling_time": 0.6, "overshoot": 0.0, "iae": 700.0, "final_error": 0.0,
    "peak_effort": 4.0, "saturated": 0.0,
}  # fmt: skip
MICRO = {
    "contraction": 0.5, "extension": 1.0, "overshoot": 3.0, "worst_error": 2.0, "iae": 1.5,
    "saturated": 0.25,
}  # fmt: skip


def named(known: tuple[Objective, ...], name: str) -> Objective:
    return next(each for each in known if each.name == name)


@pytest.mark.parametrize(
    ("name", "changed", "cost"),
    [
        ("settling", {}, 0.6),
        ("settling", {"overshoot": 0.4}, 0.6),
        ("settling", {"overshoot": 3.0}, 0.6 + 2.5),
        ("settling", {"saturated": 50.0}, 0.6),
        ("settling", {"settling_time": NAN, "final_error": -280.0}, 11.0),
        ("iae", {"overshoot": 1.0}, 0.25 + 0.5),
        ("effort", {"settling_time": 0.4}, 4.0),
        ("effort", {}, 4.0 + 10.0 * 0.2),
        ("iae", {"iae": NAN}, FAILED),
    ],
)
def test_macro_costs_by_hand(name: str, changed: dict[str, float], cost: float) -> None:
    first = {**MACRO, "settling_time": 0.5}
    found = named(MACRO_OBJECTIVES, name).cost({**MACRO, **changed}, first, {})
    assert found == pytest.approx(cost)


@pytest.mark.parametrize(
    ("name", "changed", "cost"),
    [
        ("settling", {}, 1.5),
        ("settling", {"extension": NAN}, 2.5),
        ("settling", {"overshoot": 30.0}, 1.5 + 1.0),
        ("settling", {"worst_error": 9.0}, 1.5 + 0.2),
        ("iae", {}, 1.5),
        ("effort", {}, 0.25 + 10.0 * 2.0),
        ("settling", {"fault": 3.0}, FAILED),
    ],
)
def test_micro_costs_by_hand(name: str, changed: dict[str, float], cost: float) -> None:
    first = {**MICRO, "contraction": 0.2, "extension": 0.3}
    found = named(MICRO_OBJECTIVES, name).cost({**MICRO, **changed}, first, {})
    assert found == pytest.approx(cost)


def test_penalties_have_the_weights_that_are_asked_for() -> None:
    settling = named(MACRO_OBJECTIVES, "settling")
    late = {**MACRO, "saturated": 50.0, "overshoot": 300.0}
    free = {"overshoot": 0.0}
    assert settling.cost(late, MACRO, free) == pytest.approx(0.6)
    assert settling.cost(late, MACRO, {**free, "saturated": 0.01}) == pytest.approx(0.6 + 0.5)
    assert "no penalty for: saturated" in settling.described({})
    assert "saturated: 0.01 s x (sample saturated after the first)" in settling.described(
        {"saturated": 0.01}
    )


def subject(kind: type[Macro] | type[Micro], settings: Settings) -> Macro | Micro:
    stage = kind.__name__.lower()
    return kind(settings, gains.find(stage, None, settings.controller))


@pytest.mark.parametrize(("kind", "name"), [(Macro, "macro-bench"), (Micro, "micro-bench")])
def test_a_run_has_the_figures_of_the_batch_job(kind: type[Macro], name: str) -> None:
    """Bit for bit."""
    job = batch.job(name)
    ((_, rows),) = batch.run(job, batch.Variants(("bench.friction.coulomb",), np.array([[10.5]])))
    settings = Settings().with_("bench.friction.coulomb", "10.5 N")
    found = subject(kind, settings).run(settings, 0)
    assert list(found.values()) == pytest.approx(rows[0], nan_ok=True, rel=0.0, abs=0.0)


def test_macro_figures_by_hand() -> None:
    settings = Settings()
    macro = subject(Macro, settings)
    assert isinstance(macro, Macro)
    found, recording = macro.run(settings, 0), macro.recorded(settings)
    error = 2800.0 - recording["macro_position"]
    assert found["iae"] == pytest.approx(np.abs(error).sum() * 1e-3)
    assert found["final_error"] == error[-1]
    row = round(found["settling_time"] * 1e3)
    assert np.all(np.abs(error[row:]) <= 56.0) and abs(error[row - 1]) > 56.0
    taps = Control().pd_tuned
    asked = taps.now * error[1:] + taps.before * error[:-1]
    asked = np.abs(asked) + 3.0 * (asked != 0.0)
    assert found["peak_effort"] == pytest.approx(asked.max())
    assert found["saturated"] == np.count_nonzero(asked > 5.0)


def test_a_run_that_the_guard_stops_has_no_figures() -> None:
    settings = Settings()
    hot = settings._replace(guard=settings.guard._replace(hottest=60.0))
    found = subject(Micro, hot).run(hot, 0)
    assert found["fault"] > 0.0 and math.isnan(found["contraction"])


def test_what_asks_for_more_than_the_limit_is_told() -> None:
    settings = Settings()
    (text,) = subject(Macro, settings).doubts(settings, {"saturated": 12.0, "peak_effort": 37.25})
    assert "up to 37.25 V, but the limit is 5 V" in text and "in 12 samples" in text
    assert not subject(Macro, settings).doubts(settings, {"saturated": 0.0, "peak_effort": 4.0})


def test_weights_that_no_objective_has() -> None:
    macro = subject(Macro, Settings())
    with pytest.raises(InputError, match=r"--penalty error.*overshoot, saturated, slower"):
        macro.weights({"error": 1.0})
    with pytest.raises(InputError, match="--penalty overshoot"):
        macro.weights({"overshoot": -1.0})
    with pytest.raises(InputError, match=r"--objective.*settling, iae, effort"):
        macro.objective("speed")


def test_margins_of_the_thesis() -> None:
    margins = {m.name: m.value for m in subject(Macro, Settings()).margins(Settings())}
    assert margins["phase"] == pytest.approx(85.7, abs=0.05)
    assert margins["crossover"] == pytest.approx(4.91, abs=0.005)
    (bode,) = subject(Macro, Settings()).bodes(Settings())
    assert abs(bode.loop[0]) > 1.0 > abs(bode.loop[-1])
    pid = Settings(controller=Control(macro_law="pid"))
    assert subject(Macro, pid).margins(pid)
