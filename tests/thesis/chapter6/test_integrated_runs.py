"""The integrated test and its claims (Chapter 6)."""

from __future__ import annotations

import numpy as np
import pytest
from tests.thesis.ended import collected, ended

from macromicro.recording import Recording
from macromicro.thesis.chapter6 import integrated_runs
from macromicro.thesis.chapter6.integrated_runs import IntegratedRuns
from macromicro.thesis.claims import DIFFERS, REPRODUCED, Claim


@pytest.fixture(scope="module")
def runs() -> IntegratedRuns:
    made: IntegratedRuns = collected("integrated")
    return made


@pytest.fixture(scope="module")
def claims() -> dict[str, Claim]:
    return {c.id: c for c in ended("integrated").claims}


@pytest.mark.parametrize("name", ["I1", "I2", "I3", "I4", "I6"])
@pytest.mark.slow
def test_claim_is_reproduced(claims: dict[str, Claim], name: str) -> None:
    assert claims[name].verdict == REPRODUCED
    assert claims[name].measured is not None


@pytest.mark.slow
def test_sequence(runs: IntegratedRuns) -> None:
    """Claim I1, Figure 6.1: eight times macro, two seconds, reset, micro."""
    found = integrated_runs.turns(runs.warm, runs.single)
    assert len(found) == 8
    for turn in found:
        assert turn.waited == pytest.approx(2.0, abs=1e-9)
        assert turn.reset == 0.0
        assert turn.quiet
        assert 0.3 < turn.moved < 2.0


@pytest.mark.slow
def test_no_reset_is_noticed(runs: IntegratedRuns) -> None:
    """A recording without the laser's reset fails I1."""
    silent = _changed(runs.warm, "laser_reset", 0.0)
    found = {c.id: c for c in integrated_runs.claims(runs._replace(warm=silent))}
    assert found["I1"].verdict == DIFFERS


@pytest.mark.slow
def test_every_vibration_is_within(runs: IntegratedRuns) -> None:
    """Claim I2: 14-26 um, down to 2 um in 1.5-2.5 s, after each of the eight moves."""
    found = integrated_runs.shaken(runs)
    assert len(found) == 8
    assert all(14.0 <= v.amplitude_um <= 26.0 for v in found)
    assert all(v.decay_s is not None and 1.5 <= v.decay_s <= 2.5 for v in found)


@pytest.mark.slow
def test_bias_is_the_laser_zero(runs: IntegratedRuns) -> None:
    """Claim I3: what is left at the reset is what the laser is off by; the stage is right."""
    last = integrated_runs.cycle_bias(runs, runs.warm).cycles[-1]
    assert last.bias_um is not None and last.left_um is not None
    assert last.true_bias_um is not None
    assert last.bias_um > 5.0
    assert abs(last.true_bias_um) < 1.0
    assert last.bias_um - last.true_bias_um == pytest.approx(last.left_um, abs=1.0)


@pytest.mark.slow
def test_fan_and_no_fan_exchanged_turn_the_verdicts(runs: IntegratedRuns) -> None:
    swapped = runs._replace(warm=runs.cooled, cooled=runs.warm)
    found = {c.id: c for c in integrated_runs.claims(swapped)}
    assert found["I3"].verdict == DIFFERS
    assert found["I4"].verdict == DIFFERS


@pytest.mark.slow
def test_a_rig_without_truth_has_its_bias_all_the_same(runs: IntegratedRuns) -> None:
    shown = [c for c in runs.warm.columns if not c.name.startswith("true_")]
    arrays = [runs.warm[c.name] for c in shown]
    bare = Recording.from_arrays(shown, arrays, runs.warm.dt, {})
    found = {c.id: c for c in integrated_runs.claims(runs._replace(warm=bare))}
    assert found["I3"].verdict == REPRODUCED
    assert "not recorded" in found["I3"].reason


@pytest.mark.slow
def test_cycle_time_is_both_ways(runs: IntegratedRuns, claims: dict[str, Claim]) -> None:
    """Claim I6: 0.3 to 3.8 mm and back, with the fan."""
    time = integrated_runs.cycle_time(runs)
    assert claims["I6"].measured == pytest.approx(time.contraction + time.extension)
    assert runs.square["fan"].min() == 1
    assert time.extension > time.contraction > 0.5


def _changed(r: Recording, name: str, value: float) -> Recording:
    arrays = [np.full(len(r), value) if c.name == name else r[c.name] for c in r.columns]
    return Recording.from_arrays(r.columns, arrays, r.dt, {})
