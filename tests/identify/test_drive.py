"""drive: parameters of an axis by inverse dynamics and output error.

The measured record is EMPS (A. Janot, M. Gautier, M. Brunot, 2019), reduced as
examples/data/emps/README.md says. Published: M 95.1089 kg, Fv 203.5034 N s/m, Fc 20.3935 N,
offset -3.1648 N.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.identify import Axis, DataWarning, DriveFit, Filtering, drive, simulate
from macromicro.identify.notices import ResampledWarning, SaturationWarning

DATA = Path(__file__).parents[2] / "examples/data/emps/emps.npz"


@pytest.fixture(scope="module")
def emps() -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """t [s], drive voltage [V], position [m], gain [N/V]."""
    with np.load(DATA, allow_pickle=False) as file:
        x = 50e-9 * np.cumsum(file["position"].astype(np.int64))
        u = 2e-4 * file["volts"]
        return np.arange(len(x)) * 1e-3, u, x, float(file["gain"])


@pytest.fixture(scope="module")
def four(emps: Any) -> DriveFit:
    t, u, x, gain = emps
    return drive(t, u, x, gain=gain, structure="coulomb")


def test_inverse_dynamics_gives_the_published_parameters(four: DriveFit) -> None:
    p = four.inverse.axis
    assert p.mass == pytest.approx(95.1089, rel=0.01)
    assert p.viscous == pytest.approx(203.5034, abs=four.inverse.std[1] + 1.0)
    assert p.coulomb == pytest.approx(20.3935, rel=0.02)
    assert p.offset == pytest.approx(-3.1648, rel=0.02)
    assert four.inverse.percent < 4.2  # 4.1 % elsewhere


@pytest.mark.slow
def test_published_viscous_friction_takes_the_voltage_for_that_of_its_instant(emps: Any) -> None:
    """Those who published it paired a sample's voltage with the speed at the same time. Positions
    of half a sample earlier undo the hold, and give their figure."""
    t, u, x, gain = emps
    before = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1])])
    p = drive(t, u, before, gain=gain, structure="coulomb").inverse.axis
    assert p.viscous == pytest.approx(203.5034, rel=0.002)
    assert p.mass == pytest.approx(95.1089, rel=0.002)


@pytest.fixture(scope="module")
def chosen(emps: Any) -> DriveFit:
    """The fit whose structure is chosen by what is held out."""
    t, u, x, gain = emps
    return drive(t, u, x, gain=gain)


def test_free_run_over_the_whole_record(emps: Any, chosen: DriveFit) -> None:
    """Drive voltage to position; output error of four parameters misses by 3.42 mm elsewhere."""
    (t, u, x, gain), fit = emps, chosen
    assert fit.rms < 3.42e-3
    assert fit.fit > 95.0
    run = fit.simulate(u, 1e-3, *fit.starts[0])
    assert np.sqrt(np.mean((x - run) ** 2)) == pytest.approx(fit.rms, rel=1e-6)
    np.testing.assert_allclose(run, simulate(fit.axis, gain * u, 1e-3, *fit.starts[0]))
    assert len(t) == len(run)
    # Forces disturb this axis; inverse dynamics is surer of its parameters than free runs are.
    assert fit.surest is fit.inverse and fit.axis == fit.inverse.axis
    assert (fit.inverse.std < fit.refined.std).all()


def test_holdout_finds_the_asymmetry_of_emps_and_nothing_richer(
    four: DriveFit, chosen: DriveFit
) -> None:
    """Viscous friction differs by direction; Stribeck terms come out negative or useless."""
    fit = chosen
    assert fit.structure == "asymmetric"
    assert fit.holdout["asymmetric"] < 0.8 * fit.holdout["coulomb"] < 0.3 * fit.holdout["viscous"]
    assert fit.holdout_rms < four.holdout_rms


def excitation(seed: int, n: int = 8000) -> np.ndarray:
    """Forces of both signs, changing every 0.1 to 0.5 s."""
    rng = np.random.default_rng(seed)
    parts: list[np.ndarray] = []
    while sum(map(len, parts)) < n:
        parts.append(np.full(rng.integers(100, 500), rng.uniform(-60.0, 60.0)))
    return np.concatenate(parts)[:n]


TRUE = Axis(mass=4.0, viscous=25.0, coulomb=12.0, offset=2.0)
T = np.arange(8000) * 1e-3


def test_known_axis_is_recovered_from_rounded_positions() -> None:
    """Positions in steps of 0.1 mm, as an encoder gives them."""
    u = excitation(0)
    x = np.floor(simulate(TRUE, u, 1e-3) / 1e-4) * 1e-4
    fit = drive(T, u, x)
    assert fit.structure == "coulomb"
    np.testing.assert_allclose(fit.refined.values, [4.0, 25.0, 12.0, 2.0], rtol=2e-3)
    np.testing.assert_allclose(fit.inverse.values, [4.0, 25.0, 12.0, 2.0], rtol=0.1)
    assert fit.rms < 1e-4


@pytest.mark.slow  # repeated trials
def test_noise_in_the_force_does_not_buy_a_richer_structure() -> None:
    """The split chooses: over ten noisy records of a Coulomb axis, richer ones rarely win."""
    chosen = []
    for seed in range(10):
        rng = np.random.default_rng(100 + seed)
        u = excitation(seed)
        x = simulate(TRUE, u + 4.0 * rng.standard_normal(8000), 1e-3)
        chosen.append(drive(T, u, x).structure)
    assert chosen.count("coulomb") >= 9


@pytest.mark.slow
def test_stribeck_friction_is_found_where_there_is_some() -> None:
    """Slow motion around the Stribeck speed; breakaway 15 N over 12 N sliding."""
    true = TRUE._replace(stribeck=6.0, stribeck_speed=0.2)
    u = np.where(np.abs(excitation(3)) > 20.0, 0.7 * excitation(3), 30.0)
    x = simulate(true, u, 1e-3)
    fit = drive(T, u, x)
    assert fit.structure in ("stribeck", "full")
    assert fit.axis.stribeck == pytest.approx(6.0, rel=0.1)
    assert fit.axis.stribeck_speed == pytest.approx(0.2, rel=0.1)
    assert fit.axis.coulomb == pytest.approx(12.0, rel=0.05)


@pytest.mark.slow
def test_asymmetric_viscous_friction_is_found() -> None:
    true = TRUE._replace(asymmetry=-6.0)
    u = excitation(4, 5000)
    fit = drive(T[:5000], u, simulate(true, u, 1e-3))
    assert fit.structure == "asymmetric"
    assert fit.axis.asymmetry == pytest.approx(-6.0, rel=0.02)


@pytest.mark.slow  # repeated trials
def test_standard_errors_are_those_of_repeated_trials() -> None:
    """White noise on the force: reported errors of output error within a factor of two."""
    values, reported = [], []
    for seed in range(15):
        rng = np.random.default_rng(seed)
        u = excitation(7)
        x = simulate(TRUE, u + 6.0 * rng.standard_normal(8000), 1e-3)
        fit = drive(T, u, x, structure="coulomb")
        values.append(fit.refined.values)
        reported.append(fit.refined.std)
    ratio = np.median(reported, axis=0) / np.std(values, axis=0)
    assert np.all((ratio > 0.5) & (ratio < 2.5)), ratio


def test_several_records_delay_and_gain() -> None:
    """Two records from their own starts, the drive two samples late, 5 N/V."""
    n, data = 2000, []
    for seed in range(2):
        volts = excitation(20 + seed, n) / 5.0
        late = np.concatenate([np.full(2, volts[0]), volts])[:n]
        data.append((T[:n], volts, simulate(TRUE, 5.0 * late, 1e-3, 0.1 * seed)))
    t, u, x = (list(column) for column in zip(*data, strict=True))
    fit = drive(t, u, x, gain=5.0, delay=2, structure="coulomb")
    np.testing.assert_allclose(fit.refined.values, [4.0, 25.0, 12.0, 2.0], rtol=1e-3)
    assert [len(r) for r in fit.residuals] == [n] * 2
    np.testing.assert_allclose(fit.simulate(u[1], 1e-3, 0.1), x[1], atol=1e-4)


def test_saturated_input_is_clipped_and_said() -> None:
    """The recorder shows 60 N asked for; the machine gives 40 N at most."""
    u = excitation(5, 4000)
    x = simulate(TRUE, np.clip(u, -40.0, 40.0), 1e-3)
    with pytest.warns(SaturationWarning, match="beyond the limit of 40"):
        fit = drive(T[:4000], u, x, limit=40.0, structure="coulomb")
    np.testing.assert_allclose(fit.refined.values, [4.0, 25.0, 12.0, 2.0], rtol=1e-3)
    assert fit.limit == 40.0
    np.testing.assert_allclose(fit.simulate(u, 1e-3), x, atol=1e-3)  # the limit goes on to hold


def test_uneven_time_is_interpolated_and_said() -> None:
    t = T.copy()
    t[5::10] += 0.3e-3
    u = excitation(6)
    x = np.interp(t, T, simulate(TRUE, u, 1e-3))
    with pytest.warns(ResampledWarning):
        fit = drive(t, u, x, structure="coulomb")
    np.testing.assert_allclose(fit.refined.values, [4.0, 25.0, 12.0, 2.0], rtol=0.02)


@pytest.mark.slow
def test_implausible_friction_is_said(emps: Any) -> None:
    """Asked for Stribeck friction that EMPS does not have: the warning names the values."""
    t, u, x, gain = emps
    with pytest.warns(DataWarning, match="negative mass or friction"):
        drive(t, u, x, gain=gain, structure="stribeck")


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"t": None}, "t: the array is missing"),
        ({"u": np.ones(8000)}, "an input that changes"),
        ({"x": np.ones(8000)}, "the position is constant"),
        ({"x": np.where(T > 3.0, np.nan, T)}, "row 3001"),
        ({"u": np.ones(100)}, "have 8000, 100 and 8000 rows"),
        ({"t": T[:100], "u": T[:100], "x": T[:100]}, "200 samples"),
        ({"t": np.where(T > 3.0, T + 9.0, T)}, "a gap"),
        ({"x": -1.0}, "x"),
        ({"structure": "rusty"}, "auto, viscous, coulomb"),
        ({"gain": 0.0}, "gain"),
        ({"delay": -1}, "delay"),
        ({"filtering": Filtering(cutoff=900.0)}, "500 Hz"),
        ({"filtering": Filtering(decimate=5000)}, "decimate"),
        ({"gain": -1.0}, "Check the signs"),
    ],
)
def test_unusable_data_are_refused(change: dict[str, Any], match: str) -> None:
    u = excitation(0)
    good = {"t": T, "u": u, "x": simulate(TRUE, u, 1e-3)}
    with pytest.raises(InputError, match=match):
        drive(**{**good, **change})


def test_motion_in_one_direction_is_refused() -> None:
    """Coulomb friction and offset are one constant there."""
    u = 40.0 + 10.0 * np.sin(3.0 * T)
    x = simulate(TRUE, u, 1e-3, v=1.0)
    with pytest.raises(InputError, match="both directions"):
        drive(T, u, x, structure="coulomb")
