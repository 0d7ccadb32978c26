"""Claims of the electro-thermal and the full actuator model (Sections 5.2.2 and 5.2.3)."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.identify.heating import AMBIENT, cooling
from macromicro.models import heating
from macromicro.recording import Recording
from macromicro.thesis.chapter5 import actuator_models, electrothermal
from macromicro.thesis.chapter5.actuator_models import Models
from macromicro.thesis.claims import DIFFERS, REPRODUCED, Claim


def claimed(models: Models) -> dict[str, Claim]:
    return {c.id: c for c in electrothermal.claims(models)}


@pytest.mark.parametrize("name", ["S5a", "S5b", "S7", "S8", "S9", "S10"])
@pytest.mark.slow
def test_claim_is_reproduced(models: Models, name: str) -> None:
    claim = claimed(models)[name]
    assert claim.verdict == REPRODUCED
    assert np.isfinite(np.ravel(claim.measured)).all()


def test_printed_dynamics_equal_themselves() -> None:
    """(5.6): DC gain 1.0098; its own step response differs from it by nothing."""
    printed = heating.from_transfer(*heating.PRINTED)
    assert electrothermal.against_5_6(printed) < 1e-9
    assert sum(printed[3:]) == pytest.approx(1.0098, abs=1e-4)
    slower = printed._replace(rate1=0.5 * printed.rate1)
    assert electrothermal.against_5_6(slower) > 2.0


@pytest.mark.slow
def test_a_model_as_good_at_large_inputs_as_at_small_ones_is_not_the_thesis(
    models: Models,
) -> None:
    """Claim S10: at 1.8 V at least three times the dynamic error at 1.575 V."""
    even = models._replace(steps=models.steps | {1.8: models.steps[1.575]})
    assert claimed(even)["S10"].verdict == DIFFERS


@pytest.mark.slow
def test_slow_cooling_is_told(models: Models) -> None:
    """Claim S8: 0.8-1.3 s."""
    warm = tuple(slower(r) for r in models.data.warm)
    slow = models._replace(data=models.data._replace(warm=warm))
    assert claimed(slow)["S8"].verdict == DIFFERS


def slower(run: Recording) -> Recording:
    """The same positions, twice as slowly."""
    arrays = [(2.0 if c.name == "t" else 1.0) * run[c.name] for c in run.columns]
    return Recording.from_arrays(run.columns, arrays, 2.0 * run.dt, run.attributes)


@pytest.mark.slow
def test_traces_are_what_the_steps_were_judged_by(models: Models) -> None:
    """Figure 5.17 draws the same free runs that claim S10 judges."""
    for volts in (1.5, 1.8):
        trials = models.data.steps[volts]
        again = actuator_models.against(models.thesis.model, trials)
        assert models.steps[volts] == pytest.approx(again, abs=1e-12)
        trace = models.traces[volts]
        mean = np.mean([r["laser"] for r in trials], axis=0) * 1e-3
        np.testing.assert_allclose(trace.record.position, mean)
        assert len(trace.thesis) == len(trace.better) == len(mean)


@pytest.mark.slow
def test_warm_and_cold_cooling_and_both_identifications_are_told(models: Models) -> None:
    """Section 5.2.2 identifies (5.6) by MLS and takes (5.9) after a few cycles."""
    found = {c.id: c for c in electrothermal.claims(models)}
    assert "by MLS of order three" in found["S7"].reason
    assert "after 4 cycles" in found["S8"].reason
    warm = cooling(models.table, models.data.warm, AMBIENT).time
    cold = cooling(models.table, models.data.cooled[1.575], AMBIENT).time
    assert found["S8"].measured == warm
    assert f"{cold:.2f} s from cold" in found["S8"].reason
    assert warm > cold, "warm plates cool more slowly"
    assert 0.8 <= warm <= 1.3
    assert all(len(r) == 30_000 and r["t"][0] == 0.0 for r in models.data.warm)
