"""Claims of the kiln (Section 5.2.1)."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from macromicro.recording import Recording
from macromicro.thesis.chapter5 import kiln
from macromicro.thesis.chapter5.kiln import KilnRuns
from macromicro.thesis.claims import DIFFERS, NOT_MEASURED, REPRODUCED, Claim


def with_curves(runs: KilnRuns, curves: Recording) -> dict[str, Claim]:
    heated = runs.heated._replace(curves=curves)
    return {c.id: c for c in kiln.claims(runs._replace(heated=heated))}


@pytest.mark.parametrize("name", ["S1", "S2"])
def test_claim_is_reproduced(kiln_runs: KilnRuns, name: str) -> None:
    claim = with_curves(kiln_runs, kiln_runs.heated.curves)[name]
    assert claim.verdict == REPRODUCED
    assert np.isfinite(np.ravel(claim.measured)).all()


def test_a_kiln_without_spikes_does_not_show_s1(kiln_runs: KilnRuns) -> None:
    """Claim S1 asks for raw spikes above 5 K."""
    r = kiln_runs.heated.curves
    arrays = [r["true_thermocouple"] if c.name == "thermocouple" else r[c.name] for c in r.columns]
    clean = Recording.from_arrays(r.columns, arrays, r.dt, {})
    assert with_curves(kiln_runs, clean)["S1"].verdict == DIFFERS


def test_a_kiln_that_knows_no_truth_cannot_tell_s1(kiln_runs: KilnRuns) -> None:
    """A real kiln has no second thermometer: not measured, with the reason, and the rest as
    it was."""
    r = kiln_runs.heated.curves
    columns = [c for c in r.columns if not c.name.startswith("true_")]
    real = Recording.from_arrays(columns, [r[c.name] for c in columns], r.dt, {})
    found = with_curves(kiln_runs, real)
    assert found["S1"].verdict == NOT_MEASURED
    assert found["S1"].measured is None
    assert "only a virtual kiln knows" in found["S1"].reason
    assert found["S2"].verdict == REPRODUCED
    assert found["S6"].verdict == DIFFERS


def test_full_contraction_is_where_the_table_ends(kiln_runs: KilnRuns) -> None:
    """Claim S6: to a count of the encoder. A bar that is easier to reach does not move it."""
    claim = next(c for c in kiln.claims(kiln_runs) if c.id == "S6")
    grid, rising, _ = kiln_runs.table.major_loop
    there = grid[np.flatnonzero(rising >= rising[-1] - 0.014)[0]]
    assert claim.measured == pytest.approx(there, abs=0.5)
    assert claim.verdict == DIFFERS
    cooler = dataclasses.replace(kiln_runs.table, lo=kiln_runs.table.lo - 2.0)
    assert kiln.claims(kiln_runs._replace(table=cooler))[2].verdict == REPRODUCED


def test_profiles_that_miss_are_told(kiln_runs: KilnRuns) -> None:
    """Claim S2: 3 % of the stroke, by the worst profile."""
    first, *others = kiln_runs.predictions
    spoiled = kiln_runs._replace(predictions=[first._replace(share=0.031), *others])
    claim = next(c for c in kiln.claims(spoiled) if c.id == "S2")
    assert claim.verdict == DIFFERS
    assert claim.measured == pytest.approx(3.1)
