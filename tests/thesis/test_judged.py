"""Claims judged one by one."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.recording import Recording
from macromicro.runs.programmed import on_twin
from macromicro.runs.sequence import LEVELS, TIMES, micro_steps
from macromicro.schema.par import replaced
from macromicro.settings import Settings
from macromicro.thesis import cycle_bench, kiln_bench
from macromicro.thesis.chapter5 import electrothermal, micro_control
from macromicro.thesis.chapter5.actuator_models import Unfitted
from macromicro.thesis.chapter6 import integrated_runs
from macromicro.thesis.claims import (
    DIFFERS,
    NOT_MEASURED,
    REPRODUCED,
    Claim,
    NotMeasured,
    judge,
    judge_time,
    state,
    whole,
)
from macromicro.thesis.contents import find
from macromicro.thesis.procedure import Lab
from macromicro.thesis.reproduce import failure

from .ended import collected


def _good(name: str) -> Claim:
    return state(name, 1.0, REPRODUCED)


def _raises(error: Exception) -> Claim:
    raise error


def test_a_rule_that_breaks_loses_its_own_claims_alone() -> None:
    found = judge(
        [
            ("M2", lambda: _good("M2")),
            (("M3", "M3b"), lambda: _raises(IndexError("no row 3"))),
            ("M4a", lambda: _raises(NotMeasured("nobody looked"))),
            ("M4b", lambda: _raises(InputError("table", "flat", "one that rises"))),
            (("D2", "D3"), lambda: [_good("D2"), _good("D3")]),
        ]
    )
    assert [c.id for c in found] == ["M2", "M3", "M3b", "M4a", "M4b", "D2", "D3"]
    lost = [c for c in found if c.verdict == NOT_MEASURED]
    assert [c.id for c in lost] == ["M3", "M3b", "M4a", "M4b"]
    assert "no row 3" in lost[1].reason
    assert lost[2].reason == "nobody looked"
    assert "one that rises" in lost[3].reason


def test_what_never_came_differs_and_what_is_unknown_does_not() -> None:
    assert judge_time("M14", float("nan")) == DIFFERS
    assert judge_time("M14", 0.7) == REPRODUCED


def _cut(recording: Recording, rows: int) -> Recording:
    arrays = [recording[c.name][:rows] for c in recording.columns]
    attributes = {**recording.attributes, "finished": 0, "fault": "it stuck"}
    return Recording.from_arrays(recording.columns, arrays, recording.dt, attributes)


def test_whole_tells_what_was_cut_and_why() -> None:
    run = on_twin(micro_steps([1e-3]), Settings())
    whole("a step", run)
    with pytest.raises(NotMeasured, match=r"a step ended after 0\.5 s: it stuck"):
        whole("a step", run, _cut(run, 500))


def test_the_twin_says_why_the_guard_stopped() -> None:
    """A driver that gives next to no heat."""
    cold = replaced(Settings(), "bench.driver.supply", 0.5)
    run = on_twin(micro_steps(LEVELS, 2.0, TIMES), cold)
    assert not run.attributes["finished"]
    assert "heated and does not contract" in str(run.attributes["fault"])


@pytest.mark.parametrize("rows", [10, 500, 4000])
def test_a_cut_sequence_loses_no_other_claim(rows: int) -> None:
    """S12, S13a and S13b are not measured, with the reason; S3, S4, S11 and S13c are."""
    runs = collected("micro-control")
    cut = _cut(runs.antiwindup, rows)
    found = {c.id: c for c in micro_control.claims(runs._replace(antiwindup=cut))}
    assert [n for n, c in found.items() if c.verdict == NOT_MEASURED] == ["S12", "S13a", "S13b"]
    assert "ended after" in found["S12"].reason


def test_cut_cycles_lose_no_other_claim() -> None:
    runs = collected("integrated")
    square = _cut(runs.square, 100)
    found = {c.id: c for c in integrated_runs.claims(runs._replace(square=square))}
    assert [n for n, c in found.items() if c.verdict == NOT_MEASURED] == ["I6"]
    warm = _cut(runs.warm, 20_000)
    found = {c.id: c for c in integrated_runs.claims(runs._replace(warm=warm))}
    assert found["I3"].verdict == NOT_MEASURED
    assert found["I4"].verdict == found["I6"].verdict == REPRODUCED


def test_arithmetic_survives_its_procedure() -> None:
    """S9, M11 and M11b need no bench."""
    for procedure, names in (
        (find("electrothermal"), {"S9"}),
        (find("macro-control"), {"M11", "M11b"}),
    ):
        claims = failure(procedure, "no power").claims
        assert [c.id for c in claims] == list(procedure.ids)
        assert {c.id for c in claims if c.verdict == REPRODUCED} == names


def test_steps_that_fit_no_model_still_cool() -> None:
    """S8 takes the table and one record; what is lost says why."""
    models = collected("electrothermal")
    found = electrothermal.claims(Unfitted(models.table, models.data, "too hot"))
    assert [c.id for c in found] == list(find("electrothermal").ids)
    good = {c.id for c in found if c.verdict != NOT_MEASURED}
    assert good == {"S8", "S9"}
    assert all("too hot" in c.reason for c in found if c.id not in good)


def test_kiln_and_cycle_bench_hold_the_bench_s_actuator() -> None:
    """Another alloy, stroke, driver or spring in the settings is there, too; what is a
    fixture's own stays."""
    settings = Settings()
    for path, value in (
        ("bench.phase.heat_end", 112.0),
        ("bench.wire.stroke", 4.2e-3),
        ("bench.thermal.wire_capacity", 0.005),
        ("bench.driver.lag", 5e-3),
        ("bench.bias.rate", 30.0),
        ("bench.thermal.ambient", 20.0),
        ("bench.driver.supply", 4.2),
    ):
        settings = replaced(settings, path, value)
    oven, bed = kiln_bench.with_bench(settings.bench), cycle_bench.with_bench(settings.bench)
    assert oven.phase == bed.phase == settings.bench.phase
    assert oven.wire == bed.wire == settings.bench.wire
    assert oven.oven.ambient == 20.0
    assert (bed.thermal.wire_capacity, bed.driver.lag, bed.bias.rate) == (0.005, 5e-3, 30.0)
    assert (bed.thermal.ambient, bed.driver.supply, bed.encoder.pitch) == (23.0, 5.0, 17e-6)
    lab = Lab(settings)
    there = lab.kiln()
    assert there.wire.stroke == lab.cycle().micro.wire.stroke == 4.2e-3  # type: ignore[union-attr]
    assert not np.array_equal(there.table.values, Lab().kiln().table.values)  # type: ignore[union-attr]
    default = Settings().bench
    assert kiln_bench.with_bench(default) == kiln_bench.KilnBench()
    assert cycle_bench.with_bench(default) == cycle_bench.CycleBench()
