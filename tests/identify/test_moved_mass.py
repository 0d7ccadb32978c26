"""Output error for a mass: what of a record its errors follow from."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.identify import _moved_mass
from macromicro.identify._moved_mass import Model
from macromicro.identify.runs import Run
from macromicro.identify.sprung_fit import sprung_drive
from macromicro.models.mass import Axis, simulate

DT, NOISE = 1e-3, 1e-4
NAMES = ("mass", "viscous", "coulomb", "offset", "sine", "cosine")


def turned(seed: int) -> tuple[Run, Axis]:
    """An eccentric load that turns, seen by a sensor with white noise."""
    random = np.random.default_rng(seed)
    u = np.repeat(random.uniform(-1.0, 1.0, 27), 300)[:8000]
    sine, cosine = random.uniform(-0.2, 0.2, 2)
    axis = Axis(0.01, 0.08, 0.05, 0.01, sine=sine, cosine=cosine)
    x = simulate(axis, u, DT, random.uniform(-3.0, 3.0)) + NOISE * random.standard_normal(8000)
    return Run(np.arange(8000) * DT, u, x), axis


@pytest.mark.parametrize("seed", [0, 1, 147])
def test_where_noise_is_all_the_whole_record_is_fitted(seed: int) -> None:
    """Its search begins from the state that the first piece has found, not from a measured one."""
    run, axis = turned(seed)
    model = Model(NAMES)
    parts = _moved_mass.fit_starts([run], model, [axis._replace(mass=0.0105, viscous=0.075)])[0]
    found = _moved_mass.surest([run], model, parts)
    assert len(found.fit.pieces.many) == 1
    assert found.fit.rms == pytest.approx(NOISE, rel=0.05)


@pytest.mark.parametrize("seed", [0, 2, 3])
def test_a_decay_in_counts_has_at_least_the_errors_of_rounding(seed: int) -> None:
    """Which repeat from swing to swing, so that the scatter of its parts tells too little."""
    axis = Axis(1.0, 1.2, coulomb=0.05, spring=(2.0 * np.pi * 18.0) ** 2)
    count, zero = 2e-6, np.random.default_rng(seed).uniform()
    x = simulate(axis, np.zeros(3000), DT, 1e-3)
    y = (np.round(x / count + zero) - zero) * count
    run = Run(np.arange(3000) * DT, np.zeros(3000), y)
    fit = sprung_drive([run], driven=False, spring=True, friction="coulomb")
    # docs/validation/coverage.json: over 40 such decays frequencies scatter by 23 uHz.
    assert 1.9e-5 < fit.derived("frequency")[1] < 2.9e-5
