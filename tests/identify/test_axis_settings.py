"""An identified axis as a machine: the same motion, and moves that arrive."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from macromicro import identify
from macromicro.identify import Axis, simulate
from macromicro.identify.axis_settings import Around, as_toml, values
from macromicro.machines import machine as machines
from macromicro.machines import planning, results, runs
from macromicro.machines.stage import Bounds, drive

AXIS = Axis(2.0, 30.0, 8.0, 1.0, stribeck=1.0, stribeck_speed=0.01, lag=1.5e-3)
AROUND = Around(gain=10.0, effort=4.0, pitch=1e-6, period=1e-3, travel=0.4, speed=0.8)


def settled(tmp_path: Path, axis: Axis = AXIS, around: Around = AROUND):  # type: ignore[no-untyped-def]
    place = tmp_path / "model.toml"
    place.write_text(as_toml(values(axis, around), "An axis."))
    return machines.load(place)


@pytest.mark.parametrize(("limit", "back"), [(float("inf"), 1.0), (22.0, 1.0), (22.0, 0.3)])
def test_the_machine_moves_as_the_model_does(tmp_path: Path, limit: float, back: float) -> None:
    """The same efforts, the same way: gain, mass, slope, friction, weight, lag and limit."""
    axis = AXIS._replace(limit=limit, back=back)
    machine, tree = settled(tmp_path, axis)
    t = np.arange(400) * 1e-3
    efforts = np.where(t < 0.25, 3.0 + np.sin(50.0 * t), -1.0)
    efforts[:5] = 0.0
    seen = drive(machine.kind, machine.kind.prepare(tree), efforts, Bounds(-1.0, 1.0, 9.0), 1e-3)
    free = simulate(axis, 10.0 * efforts, 1e-3)
    assert seen.ended == ""
    assert np.abs(seen.position - free).max() < 0.01 * np.ptp(free)
    other = simulate(axis._replace(mass=2.3), 10.0 * efforts, 1e-3)
    assert np.abs(seen.position - other).max() > 0.015 * np.ptp(free)


def test_its_travel_and_limits_are_those_of_the_records(tmp_path: Path) -> None:
    tree = settled(tmp_path, around=AROUND._replace(ripple=0.5))[1]
    assert (tree.travel.low, tree.travel.high) == (0.0, 0.4)
    assert tree.load.stop_low == pytest.approx(-0.008)
    assert tree.load.stop_high == pytest.approx(0.408)
    assert tree.controller.limit == tree.guard.effort == 4.0
    assert tree.encoder.rate == pytest.approx(8e6)
    assert tree.friction.ripple == 0.5
    assert tree.arrival.tolerance == pytest.approx(4e-6)
    # A lag of more than a period: the rest is the rise of the current.
    assert tree.timing.delay == pytest.approx(1e-3)
    assert tree.motor.inductance / tree.motor.resistance == pytest.approx(0.5e-3)


def test_from_a_recording_to_moves_that_arrive(tmp_path: Path) -> None:
    t = np.arange(4000) * 1e-3
    random = np.random.default_rng(1)
    level = random.uniform(0.5, 1.0, 20).repeat(200)
    u = 4.0 * np.sign(np.sin(7.0 * t)) * level
    truth = Axis(2.0, 30.0, 8.0)
    x = np.round(simulate(truth, 10.0 * u, 1e-3) / 1e-6) * 1e-6
    own = tmp_path / "own.csv"
    rows = np.stack([t, u, x], axis=1)
    np.savetxt(own, rows, delimiter=",", header="t_s,u_V,x_m", comments="", fmt="%.9g")
    found = identify.from_files("drive", own, gain=10.0, structure="coulomb")
    found.save(tmp_path / "found")
    machine, tree = machines.load(tmp_path / "found" / "model.toml")
    assert tree.load.mass == pytest.approx(2.0, rel=0.02)
    assert tree.encoder.pitch == pytest.approx(1e-6, rel=1e-3)
    assert tree.controller.limit == pytest.approx(np.abs(u).max())
    plan = planning.plan(planning.usual(tree), tree)
    done = runs.record(machine, tree, plan)
    assert done.outcome.finished
    every = results.moves(done.recording, plan, tree.arrival)
    assert all(m.arrived_s is not None for m in every)


def test_a_delay_is_found_with_its_fraction() -> None:
    """The mass is right only if the force's lag is."""
    t = np.arange(3000) * 1e-3
    u = 4.0 * np.sign(np.sin(9.0 * t)) * np.random.default_rng(2).uniform(0.5, 1.0, 30).repeat(100)
    truth = Axis(2.0, 30.0, 8.0, lag=2.4e-3)
    x = simulate(truth, 10.0 * u, 1e-3)
    found = identify.drive(t, u, x, gain=10.0, structure="coulomb", delay="fit")
    assert found.delay + found.axis.lag / 1e-3 == pytest.approx(2.4, abs=0.05)
    assert found.axis.mass == pytest.approx(2.0, rel=0.003)
    assert found.refined.names[-1] == "lag" and found.refined.std[-1] > 0.0
    late = identify.drive(t, u, x, gain=10.0, structure="coulomb", delay=0)
    assert abs(late.axis.mass - 2.0) > 0.01
    assert dataclasses.is_dataclass(found)
