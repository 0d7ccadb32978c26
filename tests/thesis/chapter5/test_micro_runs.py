"""The micro-stage's procedures and claims (Sections 5.2.2, 5.3)."""

from __future__ import annotations

import numpy as np
import pytest
from tests.thesis.ended import collected, ended

from macromicro.control.supervisor import MICRO
from macromicro.errors import InputError
from macromicro.recording import Recording
from macromicro.runs import sequence
from macromicro.runs.programmed import on_twin
from macromicro.runs.sequence import micro_steps
from macromicro.settings import Settings
from macromicro.thesis.chapter5 import micro_control, micro_runs
from macromicro.thesis.chapter5.micro_runs import MicroRuns
from macromicro.thesis.claims import DIFFERS, REPRODUCED, Claim


@pytest.fixture(scope="module")
def runs() -> MicroRuns:
    made: MicroRuns = collected("micro-control")
    return made


@pytest.fixture(scope="module")
def claims() -> dict[str, Claim]:
    return {c.id: c for c in ended("micro-control").claims}


def test_claims_are_the_seven_rows(claims: dict[str, Claim]) -> None:
    assert list(claims) == ["S3", "S4", "S11", "S12", "S13a", "S13b", "S13c"]


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("S3", 3.96, 4.0),
        ("S4", 1.3, 1.5),
        ("S13a", 0.3, 0.7),
        ("S13b", 0.7, 1.3),
        ("S13c", 0.0, 5.0),
    ],
)
def test_claim_is_reproduced(claims: dict[str, Claim], name: str, low: float, high: float) -> None:
    claim = claims[name]
    assert claim.verdict == REPRODUCED
    assert isinstance(claim.measured, float)
    assert low <= claim.measured <= high


def test_stop_is_not_reached_below(runs: MicroRuns) -> None:
    """Claim S3: not at 1.6 V and below, though held for 200 s."""
    assert max(micro_runs.highest(runs.steps[v]) for v in micro_runs.BELOW_STOP) < 3.5


def test_proportional_control(runs: MicroRuns, claims: dict[str, Claim]) -> None:
    """Claim S11: an error at any Kp; overshoot and ripple grow with it."""
    assert claims["S11"].verdict == REPRODUCED
    swings = {k: micro_runs.swing(r) for k, r in runs.proportional.items()}
    assert all(s.error > 100.0 for s in swings.values())
    assert swings[10.0].overshoot > 3.0 * swings[3.0].overshoot > 10.0
    assert np.all(np.diff([s.ripple for s in swings.values()]) > 0.0)


def test_windup(runs: MicroRuns, claims: dict[str, Claim]) -> None:
    """Claim S12: wind-up is there, but less of it is left after a second than asked for."""
    assert claims["S12"].verdict == DIFFERS
    fall = sequence.TIMES[2]
    plain = abs(micro_runs.error_after(runs.pi, fall))
    assert 30.0 < plain < 50.0
    assert abs(micro_runs.error_after(runs.antiwindup, fall)) < 3.0
    assert micro_runs.undershoot(runs.pi, fall) > 0.1
    saturated = runs.pi["ctrl"][5010:5100]
    np.testing.assert_array_equal(saturated, 0.0)


def test_more_windup_is_seen_on_a_longer_fall(runs: MicroRuns) -> None:
    """The same controller leaves over 50 um when the stage falls by 1.5 mm."""
    controller = runs.settings.controller._replace(micro_law="pi")
    settings = runs.settings._replace(controller=controller)
    r = on_twin(micro_steps((2e-3, 3e-3, 1.5e-3, 0.0), 2.0, sequence.TIMES), settings)
    assert abs(micro_runs.error_after(r, sequence.TIMES[2])) > 80.0


def test_controllers_exchanged_turn_the_verdicts(runs: MicroRuns) -> None:
    """The verdicts come from the recordings: PI in place of anti-windup fails S13."""
    swapped = runs._replace(antiwindup=runs.pi, held=runs.held[:1])
    found = {c.id: c for c in micro_control.claims(swapped)}
    assert found["S13a"].verdict != REPRODUCED
    assert found["S12"].verdict == DIFFERS


def test_worst_hold_reads_the_laser(runs: MicroRuns) -> None:
    """Claim S13c: the Hall reading alone proves nothing, so a shifted laser must show."""
    first = runs.held[0]
    arrays = [first[c.name] + (7.0 if c.name == "laser" else 0) for c in first.columns]
    moved = Recording.from_arrays(first.columns, arrays, first.dt, {})
    assert micro_runs.worst_hold(runs._replace(held=[moved])) > 5.0


def test_a_run_cut_short_is_not_measured() -> None:
    """A gain so low that the guard stops the run gives no figure."""
    controller = Settings().controller
    low = controller._replace(micro_law="p", p=controller.p._replace(kp=250.0))
    r = on_twin(micro_steps([3.8e-3], 6.0), Settings()._replace(controller=low))
    assert r.attributes["finished"] == 0
    assert all(np.isnan(v) for v in micro_runs.swing(r))


def test_growth_allows_for_noise() -> None:
    assert micro_control.grows([1.0, 0.5, 9.0], 1.0)
    assert not micro_control.grows([1.0, 9.0, 5.0], 1.0)
    assert not micro_control.grows([1.0, 1.5], 1.0)
    assert not micro_control.grows([1.0, float("nan"), 9.0], 1.0)


def test_steps_by_the_clock() -> None:
    programme = micro_steps((2e-3, 0.0), 2.0, (1.0, 3.0))
    assert programme.scheduled
    assert programme.end == 5.0
    assert list(programme.stage) == [1, 1]
    r = on_twin(programme, Settings())
    assert int(np.argmax(r["phase"] == MICRO)) == 1000


@pytest.mark.parametrize(
    ("levels", "hold", "times"),
    [
        ([], 2.0, None),
        ([float("nan")], 2.0, None),
        ([1.0], 0.0, None),
        ([1.0, 2.0], 2.0, [1.0]),
        ([1.0, 2.0], 2.0, [3.0, 1.0]),
        ([1.0], 2.0, [-1.0]),
    ],
)
def test_steps_that_are_none_are_refused(
    levels: list[float], hold: float, times: list[float] | None
) -> None:
    with pytest.raises(InputError, match="micro steps"):
        micro_steps(levels, hold, times)
