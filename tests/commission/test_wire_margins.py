"""Margins of a wire: where heat moves it most, and on wires that it may be as well."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.commission import _wire_fit
from macromicro.commission import wire as kind
from macromicro.commission._wire_fit import Heat, Wire
from macromicro.commission.stand import Record
from macromicro.control import stage_pi
from macromicro.control.stage_law import Sample, Target
from macromicro.control.stage_pi import StagePi
from macromicro.identify.clusters import Spread
from macromicro.machines import loops
from macromicro.machines.wire import DEFAULT

BENT = Heat(1.0, 0.1, 10.0, 2.0, 4.0, 5.0, 3.0, 2.0, 4e-3, 0.8, -0.5)
STRAIGHT = BENT._replace(share=1e-9, warming=0.0, cooling=0.0)


def tree(quick: float = 3.0, ki: float = 1.0, **timing: Any) -> Any:
    """A wire's settings, its loop as quick as that along the branch of `STRAIGHT`, rad/s."""
    up = wire(STRAIGHT).up
    gains = DEFAULT.controller._replace(kp=quick / up, ki=ki * quick / up)
    driver = DEFAULT.driver._replace(lag=timing.pop("lag", 0.0))
    return DEFAULT._replace(
        controller=gains, driver=driver, timing=DEFAULT.timing._replace(delay=0.0, **timing)
    )


def wire(p: Heat = BENT, **off: float) -> Wire:
    """What may have been found, with standard deviations as parts of the values."""
    wide = np.array([off.get(name, 0.0) * value for name, value in p._asdict().items()])
    return Wire(p, Spread(np.diag(wide**2), np.zeros((1, 11, 11))), 0.0)


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_nowhere_is_a_branch_steeper(warming: float, cooling: float) -> None:
    p = BENT._replace(warming=warming, cooling=cooling, last=1.8)
    q = np.linspace(0.0, 1.0, 2001)
    most = 0.0
    for way, bend in ((p.end - p.start, warming), (p.first - p.last, cooling)):
        z = np.array([_wire_fit.branch(one, bend) for one in q.tolist()])
        most = max(most, float(np.diff(z).max()) * 2000.0 / way)
    assert _wire_fit.steepest(p) == pytest.approx(most, rel=2e-3)


def test_the_plant_is_that_of_the_model_along_its_branch() -> None:
    """A step of the effort on a straight branch: how the model contracts, and the plant's answer
    to the same by its frequency response."""
    p, dt, n = STRAIGHT._replace(share=0.2), 0.01, 2**15
    made = tree(period=dt)
    t = np.arange(n) * dt
    # Slowly to the middle of the branch, then a small step.
    slow = np.concatenate([np.linspace(0.0, 4.4, 12000), np.full(40000, 4.4)])
    u = np.concatenate([slow, np.full(300, 4.45)])
    record = Record(np.arange(len(u)) * dt, u, np.zeros_like(u))
    x = _wire_fit.simulate(p, record)[len(slow) - 1 :]
    f = np.fft.rfftfreq(n, dt)
    answer = np.zeros(len(f), np.complex128)
    answer[1:] = kind.plant(p, made, f[1:])
    answer[0] = kind.plant(p, made, np.array([1e-9]))[0]
    pulse = np.fft.irfft(answer, n)  # of one period's effort
    expected = 0.05 * np.cumsum(pulse)[: len(x)]
    assert 0.05 * 0.2 * p.way < x[-1] - x[0] < p.way
    moved = x - x[0]
    assert np.abs(moved[20:] - expected[19:-1]).max() < 0.03 * moved[-1]
    assert len(t) == n


def test_the_law_is_its_steps() -> None:
    p, dt, f = StagePi(kp=3.0, ki=20.0, low=-1e9, high=1e9), 0.01, 4.0
    n, made, kept = 1000, [], stage_pi.Memory(0.0)
    e = np.sin(2.0 * math.pi * f * np.arange(n) * dt)
    for one in e.tolist():
        target, sample = Target(one, 0.0, 0.0), Sample(0.0, 0.0)
        kept, effort = stage_pi.step(p, kept, target, sample, dt)
        made.append(effort)
    turn = np.exp(-2j * math.pi * f * np.arange(n) * dt)
    found = np.mean(np.array(made) * turn) / np.mean(e * turn)
    assert found == pytest.approx(complex(loops.pi(p, np.array([f]), dt)[0]), rel=1e-6)


def test_the_crossover_is_the_gain_along_the_branch() -> None:
    made = tree(quick=3.0, ki=1e-3)
    found = kind.robust_loop(made, wire(STRAIGHT)).found
    assert found.crossover == pytest.approx(3.0 / (2.0 * math.pi), rel=0.02)
    bent = kind.robust_loop(made, wire(STRAIGHT._replace(warming=0.8))).found
    assert bent.crossover > 1.05 * found.crossover  # where it is steepest


def test_what_is_less_sure_leaves_less() -> None:
    made = tree(quick=10.0, lag=0.05)
    known, some, little = (
        kind.robust_loop(made, wire(tau=off, latent=off)) for off in (0.0, 0.05, 0.2)
    )
    assert known.found == some.found
    assert little.least.gain < some.least.gain < known.least.gain < known.found.gain
    assert little.least.modulus < known.least.modulus
    # Where no parameter is uncertain what the model leaves out is: 2.5 % of the speed.
    assert 0.025 * 2.0 < known.found.gain / known.least.gain - 1.0 < 0.025 * 4.5


def test_draws_stay_wires() -> None:
    found = wire(share=3.0, tau=2.0, start=0.5, end=0.5, first=0.5, last=0.5)
    for p, more in kind.drawn_models(found, 200):
        assert p.tau > 0.0 and 0.0 < p.share < 1.0 and p.end > p.start and p.first > p.last
        assert more > 0.8
        assert p.warming == BENT.warming and p.cooling == BENT.cooling


def test_gains_that_may_not_hold_are_doubtful() -> None:
    made = tree(quick=10.0, lag=0.05)
    gain = kind.robust_loop(made, wire()).found.gain
    assert kind.robustness(made, wire()).doubts == ()
    p = made.controller
    wild = made._replace(controller=p._replace(kp=0.97 * gain * p.kp, ki=0.97 * gain * p.ki))
    (said,) = kind.robustness(wild, wire(tau=0.1)).doubts
    assert "of 200 models" in said and "Reduce the gains" in said
