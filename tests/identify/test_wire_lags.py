"""Lags of a driver and a sensor from heatings, and the whole model of the law `inverse`."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.columns import Column
from macromicro.control.inverse.model import Inverse, prepare
from macromicro.errors import InputError
from macromicro.identify import kiln as kiln_fit
from macromicro.identify import wire_table
from macromicro.models import stressed
from macromicro.plant import bench
from macromicro.plant.bench import Bench, Sensors
from macromicro.recording import Recording
from macromicro.thesis import kiln_bench
from macromicro.thesis.chapter5 import electrothermal_runs, kiln_runs
from macromicro.thesis.kiln_bench import KilnBench

DT = 1e-3
COLUMNS = (
    Column("t", "s", ""),
    Column("ctrl", "V", ""),
    Column("laser", "um", ""),
    Column("hall_voltage", "V", ""),
)


def record(lag: float, sensor: float, noise: float = 0.0) -> Recording:
    """Bursts of full heat on the shipped model with a lag; the D/A is a period late."""
    sent = np.concatenate([np.full(round(s / DT), v) for v, s in electrothermal_runs.BURSTS])
    model = prepare(Inverse()).model._replace(lag=lag)
    places = stressed.simulate(model, np.r_[0.0, sent[:-1]], DT)[0]
    seen, left = np.empty_like(places), places[0]
    keep = math.exp(-DT / sensor) if sensor > 0.0 else 0.0
    for k in range(len(places)):
        mean = 0.5 * (places[max(k - 1, 0)] + places[k])
        left = mean + (left - mean) * keep if sensor > 0.0 else places[k]
        seen[k] = left
    random = np.random.default_rng(4)
    volts = 2.5 + 0.9 * np.tanh(0.8 * (seen - 2.0)) + 1e-3 * random.standard_normal(len(seen))
    shown = 1e3 * places + noise * random.standard_normal(len(places))
    t = np.arange(len(sent)) * DT
    return Recording.from_arrays(COLUMNS, [t, sent, shown, volts], DT, {})


@pytest.mark.parametrize("lag", [5e-4, 2e-3, 8e-3, 24e-3])
def test_the_drivers_lag_shows_where_ctrl_changes(lag: float) -> None:
    model = prepare(Inverse()).model._replace(lag=1.0)  # whatever was there before
    found = wire_table.driver_lag(model, [record(lag, 3e-3, 0.3)])
    assert found == pytest.approx(lag, abs=2e-4)


def test_a_model_that_is_wrong_elsewhere_shifts_it_by_less_than_a_period() -> None:
    model = prepare(Inverse()).model
    wrong = model._replace(heat=1.03 * model.heat, shift=model.shift + 1.0)
    assert wire_table.driver_lag(wrong, [record(2e-3, 3e-3)]) == pytest.approx(2e-3, abs=1e-3)


@pytest.mark.parametrize("lag", [0.0, 1e-3, 3e-3, 10e-3, 80e-3])
def test_the_sensors_lag_is_that_of_its_voltage_behind_the_laser(lag: float) -> None:
    assert wire_table.sensor_lag([record(2e-3, lag)]) == pytest.approx(lag, abs=1.5e-4)


def test_the_shortest_hold_is_that_between_two_changes() -> None:
    r = record(2e-3, 3e-3)
    assert wire_table.shortest([r]) == pytest.approx(min(s for _, s in electrothermal_runs.BURSTS))
    one = np.where(r["t"] > 1.0, 2.0, 0.0)
    step = Recording.from_arrays(COLUMNS, [r["t"], one, r["laser"], r["hall_voltage"]], DT, {})
    assert wire_table.shortest([step]) == math.inf
    assert wire_table.shortest([step, r]) == wire_table.shortest([r])


def test_without_a_change_of_ctrl_there_is_no_lag_to_see() -> None:
    r = record(2e-3, 3e-3)
    still = Recording.from_arrays(
        COLUMNS, [r["t"], np.full(len(r["t"]), 1.5), r["laser"], r["hall_voltage"]], DT, {}
    )
    with pytest.raises(InputError, match="CTRL never changes"):
        wire_table.driver_lag(prepare(Inverse()).model, [still])


def test_slow_records_alone_are_refused() -> None:
    r = record(2e-3, 3e-3)
    slow = Recording.from_arrays(COLUMNS, [r[c.name][::10] for c in COLUMNS], 0.01, {})
    table = kiln_fit.fod_table  # not called: the records are looked at first
    with pytest.raises(
        InputError, match=r"period is 0\.01 s.*at 0\.005 s or less, a tenth of the shortest hold"
    ):
        wire_table.for_law(table, [slow])  # type: ignore[arg-type]
    with pytest.raises(InputError, match="period is nan s"):
        wire_table.for_law(table, [])  # type: ignore[arg-type]


@pytest.mark.slow
def test_the_shipped_benchs_actuator_is_found_from_its_sensors() -> None:
    oven = kiln_bench.prepare(KilnBench())
    table = kiln_fit.fod_table([kiln_runs.run(oven, kiln_runs.cycles())])
    found = wire_table.for_law(
        table, electrothermal_runs.for_actuator(bench.prepare(Bench(), Sensors()))
    )
    truth = Bench()
    assert found.gains.lag == pytest.approx(truth.driver.lag, abs=3e-4)
    assert found.sensor == pytest.approx(Sensors().hall.lag, abs=2e-4)
    thermal = truth.thermal
    assert found.gains.c1 == pytest.approx(thermal.wire_capacity * 150.0, rel=0.05)
    assert found.fit.rms < 0.02  # mm
    shipped = Inverse()
    assert found.gains.heat == pytest.approx(shipped.heat, rel=1e-4, abs=1e-3)
    assert found.gains.relays == pytest.approx(shipped.relays, abs=1e-4)
