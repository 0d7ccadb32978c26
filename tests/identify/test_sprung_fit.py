"""A sprung drive from its records: the truth within its errors, and what is refused or doubted."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify import DataWarning
from macromicro.identify.notices import SaturationWarning
from macromicro.identify.runs import Run
from macromicro.identify.sprung_fit import (
    Load,
    SprungFit,
    initial_state,
    moving,
    same,
    sprung_drive,
)
from macromicro.kernel import compiled
from macromicro.models.mass import Axis, motion, step

DT = 1e-3
DRIVE = Axis(
    mass=2.0, viscous=5.0, coulomb=3.0, offset=1.0, asymmetry=0.5, spring=400.0, dead_zone=4.0
)
TONE = 18.0
DECAY = Axis(mass=1.0, viscous=1.2, coulomb=0.05, offset=0.3, spring=(2 * math.pi * TONE) ** 2)


def steps(random: np.random.Generator, n: int = 4000) -> Array:
    return np.repeat(random.uniform(-30.0, 30.0, n // 100), 100)


def record(
    p: Axis,
    u: Array,
    seed: int,
    noise: float,
    at: tuple[float, float] = (0.01, 0.1),
    out: int = 0,
) -> Run:
    random = np.random.default_rng(seed)
    y = motion(p, u, DT, *at)[out]
    return Run(np.arange(len(u)) * DT, u, y + noise * random.standard_normal(len(u)))


def near(fit: SprungFit, truth: Axis, most: float = 4.0) -> None:
    """All free parameters within so many told errors, which are below 2 % of what there is."""
    for name, value, error in zip(fit.names, fit.values, fit.std, strict=True):
        true = getattr(truth, name)
        assert abs(value - true) < most * error, name
        assert error < 0.02 * abs(true), name


@pytest.mark.parametrize("speed", [False, True])
def test_everything_at_once_from_positions_or_speeds(speed: bool) -> None:
    u = steps(np.random.default_rng(1))
    noise = 1e-3 if speed else 1e-5
    run = record(DRIVE, u, 2, noise, out=int(speed))
    fit = sprung_drive([run], speed=speed, spring=True, dead_zone=True)
    assert fit.friction == "asymmetric"
    assert ("offset" in fit.names) is not speed  # where the spring rests does not show in speeds
    near(fit, DRIVE)
    assert fit.rms == pytest.approx(noise, rel=0.05)
    assert fit.starts[0] == pytest.approx((0.01 if not speed else 0.0125, 0.1), abs=2e-3)
    assert same(fit.ends) == len(fit.ends)


def test_without_a_spring_a_speed_is_enough() -> None:
    p = DRIVE._replace(spring=0.0, asymmetry=0.0)
    run = record(p, steps(np.random.default_rng(3)), 4, 1e-3, out=1)
    fit = sprung_drive([run], speed=True, dead_zone=True)
    assert fit.friction == "coulomb"
    near(fit, p)


def test_a_decay_tells_its_frequency_to_a_fifth_of_a_per_cent() -> None:
    """Two records from different places; friction is told from damping."""
    runs = [record(DECAY, np.zeros(2000), k, 1e-6, at=(k * 1e-3, 0.0)) for k in (1, 2)]
    fit = sprung_drive(runs, driven=False, spring=True)
    assert fit.friction == "coulomb" and fit.axis.mass == 1.0
    near(fit, DECAY)
    tone, error, _ = fit.derived("frequency")
    assert abs(tone - TONE) < min(4.0 * error, 2e-3 * TONE)
    ratio, spread, _ = fit.derived("damping")
    assert abs(ratio - DECAY.damping) < 4.0 * spread < 0.01 * ratio
    assert fit.holdout["viscous"] > 10.0 * fit.holdout["coulomb"]
    for (x, v), run in zip(fit.starts, runs, strict=True):
        assert abs(x - run.x[0]) < 5e-6 and abs(v) < 1e-4


def test_a_decay_of_coarse_samples() -> None:
    """Twelve samples in a period, a third of it noise, hundreds of periods."""
    random = np.random.default_rng(5)
    t = np.arange(2500) / (12.0 * TONE)
    p = DECAY._replace(coulomb=0.0, viscous=0.2)
    y = motion(p, np.zeros(len(t)), t[1], 1e-3)[0] + 3e-4 * random.standard_normal(len(t))
    fit = sprung_drive([Run(t, 0 * t, y)], driven=False, spring=True, friction="viscous")
    tone, error, _ = fit.derived("frequency")
    assert abs(tone - TONE) < min(4.0 * error, 2e-3 * TONE)
    assert error < 1e-3 * TONE


def test_gain_and_lag_of_the_input() -> None:
    u = steps(np.random.default_rng(6))
    p = DRIVE._replace(asymmetry=0.0)
    x = motion(p._replace(lag=2e-3), 3.0 * u, DT)[0]
    run = Run(
        np.arange(len(u)) * DT, u, x + 1e-5 * np.random.default_rng(7).standard_normal(len(u))
    )
    fit = sprung_drive([run], spring=True, dead_zone=True, friction="coulomb", gain=3.0, lag=2e-3)
    near(fit, p)
    np.testing.assert_allclose(fit.simulate(u, DT, *fit.starts[0]), fit.free_run[0], atol=1e-9)


def test_the_start_of_a_record_that_was_not_fitted() -> None:
    run = record(DECAY, np.zeros(2000), 1, 1e-6, at=(1e-3, 0.0))
    fit = sprung_drive([run], driven=False, spring=True, friction="coulomb")
    other = record(DECAY, np.zeros(2000), 8, 1e-6, at=(-5e-4, 0.07))
    x, v = initial_state(fit, other)
    assert (x, v) == pytest.approx((-5e-4, 0.07), rel=0.01)
    missed = fit.simulate(other.u, DT, x, v) - other.x
    assert np.sqrt(np.mean(missed**2)) < 2e-6


def test_what_cannot_be_told_apart_is_said() -> None:
    """Motion one way only: Coulomb friction and a constant force are one number."""
    p = Axis(mass=2.0, viscous=5.0, coulomb=3.0, offset=1.0)
    u = 20.0 + np.abs(steps(np.random.default_rng(9)))
    with pytest.warns(DataWarning, match="coulomb and offset cannot be separated"):
        fit = sprung_drive([record(p, u, 10, 1e-5, at=(0.0, 2.0))], friction="coulomb")
    error = dict(zip(fit.names, fit.std, strict=True))
    assert math.isnan(error["coulomb"]) and math.isnan(error["offset"])
    assert abs(fit.axis.mass - 2.0) < 4.0 * error["mass"]


def test_what_ends_at_zero_has_no_error() -> None:
    p = DRIVE._replace(coulomb=0.0, asymmetry=0.0, dead_zone=0.0)
    run = record(p, steps(np.random.default_rng(11)), 12, 1e-5)
    with pytest.warns(DataWarning, match=r"coulomb|dead_zone"):
        fit = sprung_drive([run], spring=True, dead_zone=True, friction="coulomb")
    at = dict(zip(fit.names, fit.std, strict=True))
    gone = [n for n in ("coulomb", "dead_zone") if getattr(fit.axis, n) == 0.0]
    assert gone and all(math.isnan(at[n]) for n in gone)


def test_too_few_samples_in_a_period_are_doubted() -> None:
    t = np.arange(600) / (5.0 * TONE)
    y = motion(DECAY, np.zeros(len(t)), t[1], 1e-3)[0]
    with pytest.warns(DataWarning, match="samples in a period"):
        sprung_drive([Run(t, 0 * t, y)], driven=False, spring=True, friction="viscous")


def test_refused() -> None:
    t = np.arange(500) * DT
    wave = Run(t, 0 * t, np.sin(50.0 * t))
    with pytest.raises(InputError, match="turns back"):
        sprung_drive([wave], driven=False)
    with pytest.raises(InputError, match="dead zone"):
        sprung_drive([wave], driven=False, spring=True, dead_zone=True)
    with pytest.raises(InputError, match="viscous, coulomb, asymmetric, stribeck, full"):
        sprung_drive([wave], friction="rusty")
    with pytest.raises(InputError, match="constant at 0"):
        sprung_drive([Run(t, t, 0 * t)])
    with pytest.raises(InputError, match="u"):
        sprung_drive([wave], spring=True)


RUBBED = DECAY._replace(offset=0.0, coulomb=0.05)


def disturbed(p: Axis, seed: int, white: float, n: int = 3000, step: float = 0.0) -> Run:
    """A decay from 1 mm under a white force, its place in counts."""
    random = np.random.default_rng(seed)
    x = motion(p, white * random.standard_normal(n), DT, 1e-3, 0.0)[0]
    if step:
        at = random.uniform()
        x = (np.round(x / step + at) - at) * step
    return Run(np.arange(n) * DT, np.zeros(n), x)


def test_a_decay_is_fitted_until_it_is_over() -> None:
    whole = disturbed(RUBBED, 1, 0.0)
    model = Load(driven=False, spring=True).model("coulomb")
    moved = np.flatnonzero(motion(RUBBED, whole.u, DT, 1e-3, 0.0)[1])[-1]
    kept = moving([whole], model)[0][0]
    assert moved - 1.1 / (TONE * DT) < len(kept.x) < moved - 0.8 / (TONE * DT)
    assert (kept.x == whole.x[: len(kept.x)]).all()
    # Wherever friction holds it afterwards, what is found is the same.
    far = whole._replace(x=np.where(np.arange(len(whole.x)) > moved, 3.5e-6, whole.x))
    one, other = (
        sprung_drive([r], driven=False, spring=True, friction="coulomb") for r in (whole, far)
    )
    assert other.values == pytest.approx(one.values, rel=1e-4, abs=1e-4)
    assert len(one.free_run[0]) == len(whole.x)  # the model is told over the whole record
    assert one.rms < 1e-8


def test_a_coasting_mass_is_fitted_until_it_rests() -> None:
    p = Axis(mass=1.0, viscous=0.8, coulomb=0.4)
    n = 2000
    v = motion(p, np.zeros(n), DT, 0.0, 0.5)[1]
    model = Load(driven=False, speed=True).model("coulomb")
    last = np.flatnonzero(v)[-1]
    kept = moving([Run(np.arange(n) * DT, np.zeros(n), v)], model)[0][0]
    assert len(kept.x) == pytest.approx(0.95 * last, abs=0.02 * last)


def test_a_decay_that_goes_on_is_kept_whole() -> None:
    run = disturbed(DECAY._replace(coulomb=0.0, offset=0.0), 1, 0.0)
    model = Load(driven=False, spring=True).model("coulomb")
    assert len(moving([run], model)[0][0].x) == len(run.x)


@pytest.mark.slow  # repeated trials
@pytest.mark.parametrize(("white", "step"), [(0.05, 0.0), (0.0, 2e-6)])
def test_errors_of_a_decay_cover_the_truth(white: float, step: float) -> None:
    # benchmarks/intervals.py has more records, and other disturbances.
    within, wide, many = 0, [], 8
    for seed in range(many):
        run = disturbed(RUBBED, seed, white, 2400, step)
        fit = sprung_drive([run], driven=False, spring=True, friction="coulomb")
        off = np.abs(fit.values - [getattr(RUBBED, n) for n in fit.names]) / fit.std
        within += int((off < fit.factors[1]).sum())
        wide.append(off)
    assert within >= 0.85 * many * len(wide[0])
    # Nor are they told twice too wide: then nearly all would lie within half an error.
    assert np.mean(np.array(wide) < 0.5) < 0.62


@pytest.mark.slow  # repeated trials
def test_errors_of_a_decay_hold_a_force_that_repeats_along_the_way() -> None:
    """All pieces share its phase, so their scatter alone would tell a third of what it does."""
    p, n = DECAY, 2000
    move = compiled(step)
    held = []
    for seed in range(8):
        phase = np.random.default_rng(seed).uniform(0.0, 2.0 * math.pi)
        x, place, v = np.empty(n), 1e-3, 0.0
        for k in range(n):
            x[k] = place
            place, v = move(p, place, v, 0.0125 * math.sin(9000.0 * place + phase), DT)
        run = Run(np.arange(n) * DT, np.zeros(n), x)
        fit = sprung_drive([run], driven=False, spring=True, friction="coulomb")
        assert fit.repeats is not None
        assert fit.repeats.turn == pytest.approx(9000.0, rel=0.02)
        off = np.abs(fit.values - [getattr(p, name) for name in fit.names])
        held.append(off <= fit.factors[1] * fit.std)
    assert np.mean(held) >= 0.85


def test_everything_together() -> None:
    """Gravity on a load that turns, Stribeck friction, a spring, a limit and a delay at once."""
    p = Axis(
        mass=0.01, viscous=0.08, coulomb=0.05, offset=0.01, spring=0.5, stribeck=0.04,
        stribeck_speed=0.5, sine=0.1, cosine=-0.05, limit=0.8, back=0.0, lag=3.4e-3,
    )  # fmt: skip
    u = steps(np.random.default_rng(12)) / 25.0
    run = record(p, u, 13, 1e-6)
    with pytest.warns(SaturationWarning, match="beyond the limit"):
        fit = sprung_drive(
            [run], spring=True, eccentric=True, friction="stribeck", limit=0.8, lag="fit"
        )
    assert set(fit.names) >= {"sine", "cosine", "stribeck", "spring", "lag"}
    for name, value in zip(fit.names, fit.values, strict=True):
        assert value == pytest.approx(getattr(p, name), rel=0.01), name
    np.testing.assert_allclose(fit.simulate(u, DT, *fit.starts[0]), fit.free_run[0], atol=1e-9)
