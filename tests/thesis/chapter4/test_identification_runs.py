"""Open-loop identification of the twin by the laboratory procedure (Section 4.2.5)."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.identify import drive
from macromicro.lab.drive import open_loop
from macromicro.plant import bench
from macromicro.plant.bench import Bench, Plant, Sensors
from macromicro.thesis.chapter4 import identification
from macromicro.thesis.chapter4.identification import MacroModel


@pytest.fixture(scope="module")
def plant() -> Plant:
    return bench.prepare(Bench(), Sensors())


@pytest.fixture(scope="module")
def found(plant: Plant) -> MacroModel:
    """Of other noise than that of the claims."""
    return identification.measure(plant, seed=1)


def test_steady_speeds(found: MacroModel) -> None:
    """M2, M3, M3b: 1700 counts/s at 0.1 V, 3977 at 1 V, and 2 V as (4.5) predicts."""
    assert found.speeds[0.1] == pytest.approx(1700.0, rel=0.04)
    assert found.speeds[1.0] == pytest.approx(3977.0, rel=0.04)
    assert found.speeds[2.0] == pytest.approx(6507.0, rel=0.06)
    assert found.zone.speed(2.0) == pytest.approx(found.speeds[2.0], rel=0.06)


def test_linear_model(found: MacroModel) -> None:
    """M4: a -0.95833, b 165.72 counts/s/V, b / (1 + a) 3977; M5: (4.4) from the same."""
    assert found.linear.a[0] == pytest.approx(-0.95833, abs=0.004)
    assert found.linear.b[0] == pytest.approx(165.72, rel=0.08)
    assert found.linear.gain == pytest.approx(3977.0, rel=0.03)
    a, b = found.linear.with_integrator()
    assert a == pytest.approx([-1.95833, 0.95833], abs=0.004)
    assert b == pytest.approx([0.16572], rel=0.08)


def test_discontinuous_dead_zone(found: MacroModel) -> None:
    """M6: a0 0.364 V, delta 0.636; both directions alike, as the thesis assumes."""
    assert found.zone.both.a0 == pytest.approx(0.364, abs=0.03)
    assert found.zone.both.delta == pytest.approx(0.636, abs=0.03)
    assert found.zone.positive.a0 == pytest.approx(found.zone.negative.a0, abs=0.02)


def test_same_seed_same_recordings(plant: Plant) -> None:
    once, again = (identification.step_runs(plant, seed=3, runs=2) for _ in range(2))
    other = identification.step_runs(plant, seed=4, runs=2)
    for volts in once:
        for a, b in zip(once[volts], again[volts], strict=True):
            np.testing.assert_array_equal(a["macro_position"], b["macro_position"])
    starts = [r[1.0][0]["macro_position"][0] for r in (once, other)]
    assert starts[0] != starts[1]


@pytest.mark.slow
def test_physical_parameters_from_counts_alone(plant: Plant) -> None:
    """`drive` on square waves of several heights: viscous slope 2537 counts/s/V and kinetic
    level 2.427 V, what Section 4.2.5's speeds imply, and a pole near 53 rad/s."""
    t, u, x = [], [], []
    for size in (3.2, 3.6, 4.0, 4.4, 4.8, 5.0):
        n = round(1200.0 / (2537.0 * (size - 2.4)) * 1000)
        volts = np.tile(np.repeat([size, -size], n), 3)
        run = open_loop(plant, volts, 400.5)
        assert run["macro_position"].min() > 0.0 and run["macro_position"].max() < 2800.0
        t.append(run["t"])
        u.append(run["motor"])
        x.append(run["macro_position"])
    fit = drive(t, u, x, delay=1, limit=5.0)
    p = fit.axis
    assert 1.0 / p.viscous == pytest.approx(2537.0, rel=0.05)
    assert p.coulomb == pytest.approx(2.427, rel=0.05)
    assert p.viscous / p.mass == pytest.approx(53.0, rel=0.15)
    # Over whole records; the search compares them in pieces, as the ripple's effects pile up.
    assert fit.fit > 97.0
