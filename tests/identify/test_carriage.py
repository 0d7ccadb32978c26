"""`identify.carriage`: from whole counts and a laser to the model of the law `terminal`."""

import math

import numpy as np
import pytest
from scipy.stats import t

from macromicro.control.terminal import model
from macromicro.control.terminal.model import Motion, Terminal
from macromicro.errors import InputError
from macromicro.identify import carriage
from macromicro.thesis import strokes

DT = 1e-3
PITCH = Terminal().pitch
TRUE = Terminal(
    push=8.0, drag=40.0, coulomb=2.0, breakaway=0.4, fade=0.05, delay=1.3e-3,
    frequency=18.0, decay=1.5, share=0.03,
)  # fmt: skip


def record(p, u, seed=0, laser=True):
    """The law's own model, seen by counts and by a laser with 1 um of noise."""
    noise = np.random.default_rng(seed).standard_normal(len(u)) * 1e-6
    m = Motion(0.5 * PITCH, 0.0, 0.0, 0.0)
    counts, seen = np.empty(len(u)), np.empty(len(u))
    late = int(p.delay / DT)
    part = p.delay - late * DT
    for k in range(len(u)):
        counts[k] = math.floor(m.x / PITCH)
        seen[k] = m.x + p.share * m.q + noise[k]
        m = model.moved(p, m, 0.0, u[k - late - 1] if k > late else 0.0, part)
        m = model.moved(p, m, 0.0, u[k - late] if k >= late else 0.0, DT - part)
    t = np.arange(len(u)) * DT
    return (t, u, counts, seen) if laser else (t, u, counts)


@pytest.fixture(scope="module")
def fit():
    return carriage.carriage([record(TRUE, strokes.efforts(5.0)[:9000])], PITCH)


@pytest.mark.slow
def test_a_machine_that_is_the_model_is_found(fit):
    found = fit.model
    assert found.push == pytest.approx(TRUE.push, rel=0.02)
    assert found.drag == pytest.approx(TRUE.drag, rel=0.05)
    assert found.coulomb == pytest.approx(TRUE.coulomb, rel=0.05)
    rest = TRUE.coulomb + TRUE.breakaway
    assert found.coulomb + found.breakaway == pytest.approx(rest, rel=0.1)
    assert found.delay == pytest.approx(TRUE.delay, abs=0.15e-3)
    assert found.pitch == PITCH


@pytest.mark.slow
def test_the_swing_is_found_within_its_standard_errors(fit):
    assert abs(fit.model.frequency - TRUE.frequency) < max(4.0 * fit.std["frequency"], 2e-3)
    assert abs(fit.model.decay - TRUE.decay) < 4.0 * fit.std["decay"]
    assert fit.model.share == pytest.approx(TRUE.share, rel=0.05)
    assert fit.swing_rms < 4e-6
    assert not fit.apart  # one record


def test_the_swings_intervals_cover_the_truth():
    """40 draws of noise: of 95 % intervals 34 hold or more, in all but one case of 1000."""
    u = strokes.efforts(5.0)[:6000]
    clean = record(TRUE, u)
    still = clean[3] - np.random.default_rng(0).standard_normal(len(u)) * 1e-6
    held = np.zeros(2)
    for seed in range(40):
        noise = np.random.default_rng(100 + seed).standard_normal(len(u)) * 1e-6
        values, parts = carriage._ringing([carriage.cut_strokes(*clean[:3], still + noise)], DT)
        errors = {n: e * t.ppf(0.975, free) for n, ((e, free),) in parts.items()}
        off = np.array([values["frequency"] - TRUE.frequency, values["decay"] - TRUE.decay])
        held += np.abs(off) < np.array([errors["frequency"], errors["decay"]])
    assert (held >= 34).all()


def test_strokes_are_cut_at_efforts_after_rest_and_end_where_the_laser_sees_the_swing_alone():
    u = np.zeros(2000)
    u[100:140], u[700:740], u[1500:1503] = 5.0, -5.0, 0.1
    r = carriage.cut_strokes(*record(TRUE, u))
    assert [(a, b) for a, b, _ in r.strokes] == [(100, 700), (700, 1500)]
    for a, b, still in r.strokes:
        assert a + 40 + 30 < still < b
        assert not np.diff(r.counts[still - 30 : b]).any()
    assert all(
        still == b for _, b, still in carriage.cut_strokes(*record(TRUE, u, laser=False)).strokes
    )


@pytest.mark.slow
def test_the_likelihood_is_greatest_near_the_truth():
    r = carriage.cut_strokes(*record(TRUE, strokes.efforts(5.0)[:8000]))
    at = float(carriage._surprises(TRUE, [r], DT).sum())
    for name in ("push", "drag", "coulomb"):
        for factor in (0.9, 1.1):
            other = TRUE._replace(**{name: factor * getattr(TRUE, name)})
            assert float(carriage._surprises(other, [r], DT).sum()) > at


def test_too_few_strokes_and_one_direction_are_refused():
    u = np.zeros(1500)
    u[100:140] = 5.0
    with pytest.raises(InputError, match="1 of 4 strokes"):
        carriage.carriage([record(TRUE, u)], PITCH)
    u = np.zeros(3000)
    for k in range(5):
        u[100 + 500 * k : 140 + 500 * k] = 5.0
    with pytest.raises(InputError, match="both directions"):
        carriage.carriage([record(TRUE, u)], PITCH)
