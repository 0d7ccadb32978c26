"""An eccentric load: two ways to tell its torque, their errors, and that the truth lies in them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro import identify
from macromicro.errors import InputError
from macromicro.identify import drive, eccentric, simulate
from macromicro.identify.axis_inverse import Estimate
from macromicro.machines import machine as machines
from macromicro.machines import planning, results, rotary, runs, sheets
from macromicro.models.mass import Axis
from macromicro.programme import Programme

DT = 1e-3
DEG = math.pi / 180.0
HUNG = Axis(mass=0.01, viscous=0.08, coulomb=0.05, offset=0.01, sine=0.12, cosine=-0.16)
NAMES = ("mass", "viscous", "coulomb", "offset", "sine", "cosine")
sizes = st.floats(-5.0, 5.0)


def swung(seed: int, n: int = 8000) -> np.ndarray:
    """Torques of both signs, each for 0.1 to 0.5 s, which turn the axis on by several turns."""
    random = np.random.default_rng(seed)
    parts: list[np.ndarray] = []
    while sum(map(len, parts)) < n:
        parts.append(np.full(int(random.integers(100, 500)), random.uniform(-1.0, 1.0)))
    return np.concatenate(parts)[:n]


@settings(deadline=None)
@given(sine=sizes, cosine=sizes, x=st.floats(-10.0, 10.0))
def test_both_tell_one_torque(sine: float, cosine: float, x: float) -> None:
    found = eccentric.of(Axis(1.0, 1.0, sine=sine, cosine=cosine))
    torque = found.unbalance * math.sin(x - found.hangs)
    assert torque == pytest.approx(sine * math.sin(x) + cosine * math.cos(x), abs=1e-12)
    assert found.unbalance >= 0.0 and abs(found.hangs) <= math.pi


def test_errors_are_those_of_drawn_sines_and_cosines() -> None:
    spread = np.diag([1.0, 4e-6, 1e-6])
    spread[1, 2] = spread[2, 1] = 1.5e-6
    found = Estimate(HUNG, ("mass", "sine", "cosine"), spread, 0.0, 0.0)
    values, std = eccentric.gravity_terms(found)
    assert values == pytest.approx([0.2, math.atan2(0.16, 0.12)])
    random = np.random.default_rng(5)
    drawn = random.multivariate_normal([0.12, -0.16], spread[1:, 1:], 20_000)
    every = [eccentric.of(HUNG._replace(sine=a, cosine=b)) for a, b in drawn]
    assert std == pytest.approx(np.std(every, axis=0), rel=0.03)


def test_what_is_not_found_is_not_told() -> None:
    """Nor is the angle of a load that is balanced."""
    none = Estimate(HUNG, ("mass",), np.eye(1), 0.0, 0.0)
    assert [len(each) for each in eccentric.gravity_terms(none)] == [0, 0]
    still = Estimate(HUNG._replace(sine=0.0, cosine=0.0), ("sine", "cosine"), np.eye(2), 0.0, 0.0)
    values, std = eccentric.gravity_terms(still)
    assert values.tolist() == [0.0, 0.0] and np.isnan(std).all()


def test_it_is_recovered_from_rounded_positions_over_turns() -> None:
    u, t = swung(2), np.arange(8000) * DT
    x = np.floor(simulate(HUNG, u, DT, 0.5) / 1e-4) * 1e-4
    assert np.ptp(x) > 2.0 * math.pi
    found = drive(t, u, x, structure="coulomb", eccentric=True)
    assert found.refined.names == NAMES
    wanted = [getattr(HUNG, n) for n in NAMES]
    np.testing.assert_allclose(found.refined.values, wanted, rtol=5e-3, atol=1e-3)
    np.testing.assert_allclose(found.inverse.values, wanted, rtol=0.1, atol=5e-3)
    assert (found.refined.std < 0.01).all()
    assert drive(t, u, x, structure="coulomb").rms > 50.0 * found.rms


def test_turning_by_little_it_is_not_told_from_a_constant_torque() -> None:
    u, t = swung(2), np.arange(8000) * DT
    x = 1e-5 * simulate(HUNG, u, DT, 0.5)
    with pytest.raises(InputError, match=r"cannot be separated: .*(sine|cosine)"):
        drive(t, 1e-5 * u, x, structure="coulomb", eccentric=True)


@pytest.mark.slow
def test_its_errors_are_those_of_repeated_trials() -> None:
    """Twenty loads that hang anywhere, under noise of torque and position: what is missed is, in
    the mean square, from half to twice what is told."""
    missed = []
    for seed in range(20):
        random = np.random.default_rng(seed)
        size, hangs = random.uniform(0.05, 0.3), random.uniform(-math.pi, math.pi)
        axis = HUNG._replace(sine=size * math.cos(hangs), cosine=-size * math.sin(hangs))
        u = swung(seed)
        x = simulate(axis, u + 0.1 * random.standard_normal(len(u)), DT, random.uniform(-3.0, 3.0))
        x += 1e-4 * random.standard_normal(len(u))
        found = drive(np.arange(len(u)) * DT, u, x, structure="coulomb", eccentric=True)
        values, std = eccentric.gravity_terms(found.refined)
        off = values - [size, hangs]
        off[1] = math.remainder(off[1], 2.0 * math.pi)
        missed.append(off / std)
    size = np.sqrt(np.mean(np.square(missed), axis=0))
    assert (size > 0.5).all() and (size < 2.0).all()


@pytest.mark.slow
def test_from_a_recording_to_a_machine_that_holds_it(tmp_path: Path) -> None:
    """Angles in degrees, from 100 on, of an axis with a gear: the same torque at every place."""
    tree = rotary.DEFAULT.with_({"load.unbalance": "0.3 N*m", "load.hangs": "-60 deg"})
    shares = np.random.default_rng(1).uniform(0.0, 1.0, 12)
    target = np.floor(shares * tree.travel.high / tree.encoder.pitch)
    n = len(target)
    waits = np.full(n, 0.05)
    way = Programme("", np.full(n, math.nan), np.zeros(n, int), target, waits, math.nan, "here")
    seen = runs.record(machines.MACHINES[3], tree, way).recording
    own = tmp_path / "own.csv"
    t = np.arange(len(seen["effort"])) * tree.timing.period
    rows = np.stack([t, seen["effort"], seen["position"] + 100.0], axis=1)
    np.savetxt(own, rows, delimiter=",", header="t_s,u_V,x_deg", comments="", fmt="%.9g")
    gain = 1.0 / sheets.per_newton(tree)
    found = identify.from_files("drive", own, gain=gain, structure="coulomb", eccentric=True)
    found.save(tmp_path / "found")
    machine, made = machines.load(tmp_path / "found" / "model.toml")
    lowest = seen["position"].min() * DEG
    for place in np.linspace(0.0, tree.travel.high, 7):
        there = sheets.gravity_at(made, place - lowest)
        assert there == pytest.approx(sheets.gravity_at(tree, place), abs=0.01)
    plan = planning.plan(planning.usual(made), made)
    done = runs.record(machine, made, plan)
    assert all(m.arrived_s is not None for m in results.moves(done.recording, plan, made.arrival))
