"""Identification on records that are made from seeds, and on the measured ones."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter, max_len_seq

from macromicro import identify
from macromicro.identify import Axis, Filtering, dead_zone, discontinuous_dead_zone, drive
from macromicro.identify import records as room
from macromicro.identify.hall import fit_table
from macromicro.identify.heating import static_gain as nonlinear
from macromicro.identify.kiln import window_means, without_spikes
from macromicro.identify.linear import whiteness
from macromicro.models.weighted_gain import Exponential, exponential
from macromicro.thesis.chapter5.actuator_models import asymptote, linearise, upper

from .record import frozen

DATA = Path(__file__).parents[2] / "examples/data"
METHODS = ("least_squares", "mls", "gls", "sriv", "output_error")


def linear_records(seed: int) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Two records of a second-order plant with coloured noise, of different lengths."""
    random = np.random.default_rng(seed)
    u = 1.5 * max_len_seq(10)[0] - 0.6
    inputs, outputs = [], []
    for n in (900, 600):
        y = lfilter([0.0, 0.8, 0.3], [1.0, -1.5, 0.62], u[:n])
        y = y + lfilter([0.1], [1.0, -0.8], random.standard_normal(n))
        inputs.append(u[:n].copy())
        outputs.append(y)
    return inputs, outputs


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("order", [(1, 1), (2, 2), (2, 1)])
def test_linear_methods(name: str, order: tuple[int, int]) -> None:
    u, y = linear_records(4)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        fit = getattr(identify, name)(u, y, *order, 1e-3)
        weighted: Any = None
        if name in ("least_squares", "mls", "gls"):
            weights = [np.linspace(0.2, 1.0, len(each)) for each in u]
            weighted = getattr(identify, name)(u, y, *order, 1e-3, weights=weights)
    names = sorted({type(w.message).__name__ for w in told})
    # How many steps rounding lets a search take at its end is the processor's.
    fit = replace(fit, iterations=-1, shares=None)
    weighted = replace(weighted, iterations=-1, shares=None) if weighted else None
    found = {"fit": fit, "weighted": weighted, "told": names}
    frozen(f"linear-{name}-{order[0]}{order[1]}", found, rel=1e-5)


def test_records_are_prepared() -> None:
    random = np.random.default_rng(2)
    made = []
    travel = np.cumsum(random.uniform(0.0, 3.0, 400))
    for k in range(4):
        sign = 1.0 if k % 2 == 0 else -1.0
        made.append((sign * np.full(400, 1.2), np.floor(sign * travel + random.uniform())))
    averaged = identify.average_runs(made)
    u, v = identify.differentiated(*averaged, 1e-3)
    frozen(
        "records",
        {
            "averaged": averaged,
            "differentiated": (u, v),
            "integrated": identify.integrated(u, v, 1e-3),
            "lowpassed": identify.lowpassed(u, v, 1e-3, 40.0),
            "railed": room.flag_saturation(np.clip(v, -1500.0, 2500.0), "v").sum(),
        },
    )


def test_residuals_are_judged() -> None:
    random = np.random.default_rng(7)
    white = random.standard_normal(500)
    coloured = lfilter([1.0], [1.0, -0.7], white)
    frozen(
        "residuals",
        {
            "white": whiteness((white,), 3),
            "coloured": whiteness((coloured, white[:200]), 3, lags=12),
            "percent": room.fit_percent([white, white + coloured], (coloured, white)),
        },
    )


@pytest.fixture(scope="module")
def emps() -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    with np.load(DATA / "emps" / "emps.npz", allow_pickle=False) as file:
        x = 50e-9 * np.cumsum(file["position"].astype(np.int64))
        u = 2e-4 * file["volts"]
        return np.arange(len(x)) * 1e-3, u, x, float(file["gain"])


@pytest.mark.parametrize(
    "structure",
    [
        "auto", "asymmetric", "stribeck",
        pytest.param("viscous", marks=pytest.mark.slow),
        pytest.param("coulomb", marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_drive_on_measured_data(emps: Any, structure: str) -> None:
    t, u, x, gain = emps
    part = slice(0, 14_000)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        fit = drive(t[part], u[part], x[part], gain=gain, structure=structure)
    frozen(
        f"drive-{structure}",
        {"fit": fit, "told": sorted({type(w.message).__name__ for w in told})},
        rel=1e-4,
        absolute=1e-7,
    )


def test_drive_with_other_filters(emps: Any) -> None:
    t, u, x, gain = emps
    part = slice(0, 14_000)
    fit = drive(
        t[part], u[part], x[part], gain=gain, structure="coulomb",
        filtering=Filtering(cutoff=30.0, decimate=8),
    )  # fmt: skip
    frozen("drive-filtered", fit.inverse, rel=1e-4, absolute=1e-7)


def test_a_free_run_of_an_axis() -> None:
    axis = Axis(95.0, 200.0, 20.0, -3.0)
    force = 60.0 * np.sin(np.arange(3000) / 150.0)
    frozen("axis-run", identify.simulate(axis, force, 1e-3, x=0.01, v=0.1))


def constant_runs(seed: int) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """A carriage that sticks here and there below about 3 V, at constant voltages both ways."""
    random = np.random.default_rng(seed)
    dt, made = 1e-3, []
    for volts in (2.6, 2.8, 2.9, 3.0, 3.1, 3.4, 4.0):
        for sign in (1.0, -1.0):
            place, speed, x = (0.0 if sign > 0 else 2800.0), 0.0, []
            for _ in range(1500):
                sticks = 2.45 + 0.4 * np.sin(place / 90.0) ** 2
                aim = max(volts - sticks, 0.0) * (1500.0 + 40.0 * sign)
                speed += (sign * aim - speed) * 0.05
                place = min(max(place + speed * dt, 0.0), 2800.0)
                x.append(np.floor(place + 0.05 * random.standard_normal()))
            t = np.arange(len(x)) * dt
            made.append((t, np.full(len(x), sign * volts), np.array(x)))
    return made


def test_dead_zones() -> None:
    data = constant_runs(1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        zone = dead_zone(data, travel=(50.0, 2000.0))
        jump = discontinuous_dead_zone([r for r in data if abs(r[1][0]) >= 3.1], 2500.0, 3.0)
    frozen("deadzone", {"zone": zone, "jump": jump})


def test_static_gain() -> None:
    volts = (1.5, 1.525, 1.55, 1.575, 1.6)
    random = np.random.default_rng(3)
    rise = [exponential(Exponential(), v) + 0.2 * random.standard_normal() for v in volts]
    low = nonlinear(volts, rise).model
    steady = dict(zip(volts, rise, strict=True))
    goals = {1.65: 98.0, 1.7: 119.0, 1.8: 151.0, 1.9: 203.0}
    frozen(
        "gain",
        {
            "asymptote": asymptote(rise),
            "linearised": linearise(volts, rise),
            "linearised at": linearise(volts, rise, 84.0),
            "nonlinear": nonlinear(volts, rise),
            "upper": upper(low, steady, goals),
        },
        rel=1e-5,
    )


def test_hall_calibration() -> None:
    random = np.random.default_rng(1)
    place = np.linspace(0.0, 4.0, 20_000)
    made = []
    for _ in range(3):
        for x, way in ((place, 1.0), (place[::-1], -1.0)):
            volts = 0.3 + 1.1 * (x - way * 0.002) + 0.05 * np.sin(2.0 * x)
            made.append((volts, x + 0.002 * random.standard_normal()))
    frozen("hall", fit_table(made))


def test_smoothing() -> None:
    random = np.random.default_rng(5)
    t = np.arange(0.0, 20.0, 0.01)
    values = 30.0 * np.sin(0.2 * t) + 0.002 * random.standard_normal(t.size)
    values[40::197] += 9.0
    values[41::197] += 9.0
    frozen(
        "smoothing",
        {
            "spikes": without_spikes(t, values, 60.0, 0.3, 2.0),
            "means": window_means(t, values, 20, 0.15),
        },
    )
