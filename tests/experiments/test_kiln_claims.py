"""Claims of kiln and electro-thermal model (Section 5.2)."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.experiments import kiln_claims
from macromicro.experiments.actuator_models import Models
from macromicro.experiments.claim import DIFFERS, REPRODUCED, Claim
from macromicro.experiments.kiln import KilnData
from macromicro.experiments.kiln_claims import KilnRuns
from macromicro.models import heating
from macromicro.recording import Recording


@pytest.fixture(scope="module")
def runs(heated: KilnData, models: Models) -> KilnRuns:
    return KilnRuns(heated.tests[0], models)


@pytest.fixture(scope="module")
def claims(runs: KilnRuns) -> dict[str, Claim]:
    return {c.id: c for c in kiln_claims.claims(runs)}


@pytest.mark.parametrize("name", ["S1", "S2", "S5a", "S5b", "S6", "S7", "S8", "S10"])
def test_claim_is_reproduced(claims: dict[str, Claim], name: str) -> None:
    claim = claims[name]
    assert claim.verdict == REPRODUCED
    assert np.isfinite(np.ravel(claim.measured)).all()


def test_printed_dynamics_equal_themselves() -> None:
    """(5.6): DC gain 1.0098; its own step response differs from it by nothing."""
    printed = heating.from_transfer(*heating.PRINTED)
    assert kiln_claims.against_5_6(printed) < 1e-9
    assert sum(printed[3:]) == pytest.approx(1.0098, abs=1e-4)
    slower = printed._replace(rate1=0.5 * printed.rate1)
    assert kiln_claims.against_5_6(slower) > 2.0


def test_a_kiln_without_spikes_does_not_show_s1(runs: KilnRuns) -> None:
    """Claim S1 asks for raw spikes above 5 K."""
    r = runs.profile
    arrays = [r["true_thermocouple"] if c.name == "thermocouple" else r[c.name] for c in r.columns]
    clean = Recording.from_arrays(r.columns, arrays, r.dt, {})
    found = {c.id: c for c in kiln_claims.claims(runs._replace(profile=clean))}
    assert found["S1"].verdict == DIFFERS


def test_profile_is_the_first_of_the_new_ones(heated: KilnData) -> None:
    """`collect` draws the profile that `experiments.kiln.collect` draws first."""
    from macromicro.experiments import kiln
    from macromicro.plant import kiln as fixture
    from macromicro.plant.kiln import KilnBench

    again = kiln.run(fixture.prepare(KilnBench()), kiln.profiles()[0], kiln_claims.PROFILE_SEED)
    np.testing.assert_array_equal(again["thermocouple"], heated.tests[0]["thermocouple"])
