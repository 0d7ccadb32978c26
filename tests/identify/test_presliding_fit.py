"""Output error for an axis with elastic friction that depends on the place."""

from __future__ import annotations

import numpy as np
import pytest
from tests.identify.elastic import DT, STAGE

from macromicro.errors import InputError
from macromicro.identify import drive as identified
from macromicro.identify.notices import DataWarning
from macromicro.identify.presliding import Presliding, begin, simulate, step
from macromicro.identify.presliding_fit import presliding_drive
from macromicro.kernel import compiled

TRUE = STAGE._replace(low=-0.3, high=0.3)


def drive(n: int, seed: int = 0) -> np.ndarray:
    """A force that goes both ways at several speeds, with small wiggles at rest between."""
    t = np.arange(n) * DT
    big = 11.0 * np.sin(2 * np.pi * 0.7 * t) * (np.sin(2 * np.pi * 0.11 * t + seed) > -0.3)
    small = 3.5 * np.sin(2 * np.pi * 3.1 * t) * (big == 0.0)
    return big + small


def seen(p: Presliding, n: int = 8000, seed: int = 0, force: float = 0.0, sensor: float = 1e-7):
    random = np.random.default_rng(seed)
    u = drive(n, seed)
    x = simulate(p, u + force * random.standard_normal(n), DT, x=-0.2)
    return np.arange(n) * DT, u, x + sensor * random.standard_normal(n)


def of(fit, name: str) -> tuple[float, float]:
    k = fit.names.index(name)
    return float(fit.values[k]), float(fit.std[k])


@pytest.mark.slow
def test_stiffness_and_level_are_found_where_the_record_shows_them() -> None:
    fit = presliding_drive(*seen(TRUE, force=0.05), along=1)
    for name, true in (
        ("mass", 2.0),
        ("viscous", 15.0),
        ("stiffness", 5e4),
        ("settling", 4e-3),
        ("level 1", 5.0),
        ("offset", 0.3),
    ):
        value, error = of(fit, name)
        half = error * fit.factors[1, fit.names.index(name)]
        assert (
            abs(value - true) < 2.0 * half
        )  # a damping of 0.8 ms +- 0.7 was found: no normal error
        assert error < (0.5 if name == "settling" else 0.2) * true
    assert (fit.factors[1] > 1.96).all()  # Student's
    assert fit.judged[fit.taken] < 0.5 * fit.judged["rigid"]
    assert fit.rms == pytest.approx(np.sqrt(np.mean(np.concatenate(fit.residuals) ** 2)))


@pytest.mark.slow
def test_friction_along_the_travel_is_found_with_as_many_nodes_as_it_needs() -> None:
    p = TRUE._replace(levels=np.array([4.0, 6.5, 4.5]), low=-0.2, high=0.6)
    t, u, x = seen(p, 12000, force=0.05)
    fit = presliding_drive(t, u, x)
    assert len(fit.model.levels) > 1
    at = np.linspace(fit.model.low, fit.model.high, len(fit.model.levels))
    true = np.interp(at, np.linspace(p.low, p.high, 3), p.levels)
    assert fit.model.levels == pytest.approx(true, abs=0.4)
    assert fit.reasons["lugre, one level"].endswith("is better")


@pytest.mark.slow
def test_a_record_of_rigid_friction_is_said_to_ask_for_no_other() -> None:
    from macromicro.identify import Axis
    from macromicro.identify import simulate as rigid

    u = drive(8000) * 1.3
    random = np.random.default_rng(4)
    pushed = u + 0.3 * random.standard_normal(8000)
    x = rigid(Axis(mass=2.0, viscous=15.0, coulomb=5.0, offset=0.3), pushed, DT)
    x = np.round(x / 1e-5) * 1e-5
    with pytest.warns(DataWarning, match="does not need it"):
        fit = presliding_drive(np.arange(8000) * DT, u, x, along=1)
    assert np.isnan(of(fit, "stiffness")[1])
    assert np.isnan(of(fit, "settling")[1])
    assert of(fit, "mass")[0] == pytest.approx(2.0, abs=4.0 * of(fit, "mass")[1])
    assert "elastic friction" in fit.reasons


def test_what_is_asked_is_checked_first() -> None:
    t, u, x = seen(TRUE, 400)
    for along in (0, 18):
        with pytest.raises(InputError, match=r"along.*1 to 17"):
            presliding_drive(t, u, x, along=along)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_noise_of_the_position_at_the_starts_of_pieces_does_not_spoil_the_rest(seed: int) -> None:
    """Speeds at the starts of pieces, as measured, moved the viscous slope by 0.3 %."""
    fit = presliding_drive(*seen(TRUE, seed=seed, sensor=2e-7), along=1)
    for name, true in (("mass", 2.0), ("viscous", 15.0), ("level 1", 5.0), ("offset", 0.3)):
        value, error = of(fit, name)
        assert abs(value - true) < 4.0 * error
        assert error < 2e-3 * max(true, 1.0)


@pytest.mark.slow
def test_where_rigid_friction_shows_no_level_one_is_fitted_all_the_same() -> None:
    """Strokes that begin so that friction's give hides its level: a mass of 3.8 kg was found."""
    t = np.arange(8000) * DT
    on = np.sin(2.0 * np.pi * 0.11 * t + 0.5254) > -0.3
    u = np.where(on, 11.0 * np.sin(1.4 * np.pi * t), 3.5 * np.sin(6.2 * np.pi * t))
    x = simulate(TRUE._replace(low=-1.0, high=1.0), u, DT)
    x = x + 1e-7 * np.random.default_rng(0).standard_normal(8000)
    assert "coulomb" not in identified(t, u, x).refined.names
    fit = presliding_drive(t, u, x, along=1)
    for name, true in (("mass", 2.0), ("viscous", 15.0), ("stiffness", 5e4), ("level 1", 5.0)):
        assert of(fit, name)[0] == pytest.approx(true, rel=1e-3)


@pytest.mark.slow
def test_cogging_is_found_and_errors_are_those_of_a_harmonic() -> None:
    """25 mN every 60 mm: taken for noise, errors were told twice too wide."""
    t, u, axis = np.arange(8000) * DT, drive(8000), TRUE._replace(low=-1.0, high=1.0)
    x, place, v = np.empty(8000), -0.2, 0.0
    move = compiled(step)
    bristle = compiled(begin)(axis, place, v, float(u[0]) - axis.offset)
    for k in range(8000):
        x[k] = place
        pull = float(u[k]) + 0.025 * np.sin(2.0 * np.pi / 0.06 * place) - axis.offset
        v, gone, bristle = move(axis, bristle, place, v, pull, DT)
        place += gone
    fit = presliding_drive(t, u, x, along=1)
    assert fit.repeats is not None
    assert 2.0 * np.pi / fit.repeats.turn == pytest.approx(0.06, rel=0.02)
    assert fit.repeats.size == pytest.approx(0.025, rel=0.05)
    for name, true in (("mass", 2.0), ("viscous", 15.0), ("level 1", 5.0), ("offset", 0.3)):
        value, error = of(fit, name)
        assert abs(value - true) < 1.5 * fit.factors[1, fit.names.index(name)] * error
        assert error < 0.02 * max(true, 0.5)
