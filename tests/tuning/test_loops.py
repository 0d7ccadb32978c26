"""Loops of the laws, and what the micro-stage bears."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.control.errors import by_error

from macromicro.control import macro as control
from macromicro.control import settings as control_settings
from macromicro.control.macro import NAMES
from macromicro.control.settings import Control
from macromicro.models.macro import LINEAR, MacroModel, MacroModelState, step
from macromicro.settings import Settings
from macromicro.tuning import gains, loops


@pytest.mark.parametrize("name", NAMES)
def test_the_polynomials_are_the_loop_that_runs(name: str) -> None:
    """Law and linear model in a chain, opened: the answer to a sine, after the transients of
    a law without integral action, is num/den at that frequency."""
    chosen = Control(macro_law=name, pid=Control().pid._replace(ki=0.0))
    law = control_settings.prepare(chosen).macro._replace(limit=math.inf, dead_zone=0.0)
    model = MacroModel(kind=LINEAR, width=0.0)
    num, den = loops.macro_loop(chosen)
    w, dt = 2.0 * math.pi / 0.2, model.linear.dt
    count = 4000
    memory, state, seen = control.rest(0.0), MacroModelState(0.0, 0.0), np.empty(count)
    for k in range(count):
        seen[k] = state.x
        memory, volts = by_error(law, memory, math.sin(w * k * dt), dt)
        state = step(model, state, volts)
    late = np.arange(count - 400, count)
    # The integrator of (4.4) keeps an offset, which whole periods tell from the sine.
    found = 2.0 / 400.0 * np.sum(seen[late] * np.exp(-1j * w * late * dt)) * 1j
    z = np.exp(1j * w * dt)
    expected = np.polyval(num, z) / np.polyval(den, z)
    assert abs(found / expected - 1.0) < 1e-6


def test_integral_action_is_in_the_loop() -> None:
    """Another pole at z = 1, with the residue of ki."""
    num, den = loops.macro_loop(Control(macro_law="pid"))
    plain, under = loops.macro_loop(Control(macro_law="pid", pid=Control().pid._replace(ki=0.0)))
    np.testing.assert_allclose(den, under)
    z = np.exp(0.02j)
    gap = (np.polyval(num, z) - np.polyval(plain, z)) / np.polyval(den, z)
    linear = MacroModel().linear
    model = linear.b * linear.dt / ((z - 1.0) * (z + linear.a))
    assert gap == pytest.approx(Control().pid.ki * linear.dt * z / (z - 1.0) * model, rel=1e-9)


def test_ripple_margin() -> None:
    """PI control begins to swing at some factor; the margin is the last one that did not."""
    control = Control(micro_law="pi")
    settings = Settings(controller=control)
    law = gains.find("micro", "pi", control)
    factor = loops.ripple_margin(settings, law)
    assert 1.0 < factor < loops.MOST
    for times, quiet in ((factor, True), (2.0**0.25 * factor, False)):
        louder = settings._replace(controller=law.scaled(control, times))
        assert (loops.ripple(louder) <= 10.0) is quiet


def test_a_law_that_swings_has_none() -> None:
    """Anti-windup far above the integral gain: it settles sooner, then wanders."""
    wild = Control(pi_antiwindup=Control().pi_antiwindup._replace(kp=2586.0, ki=44290.0, kaw=76.35))
    law = gains.find("micro", None, wild)
    assert math.isnan(loops.ripple_margin(Settings(controller=wild), law))
    assert not loops.holds(Settings(controller=wild), law)
    assert loops.holds(Settings(), law)


def test_a_stage_at_its_stop_is_not_quiet() -> None:
    """It does not move there, but it does not hold either."""
    wild = Control(pi_antiwindup=Control().pi_antiwindup._replace(kp=2586.0, ki=44290.0, kaw=76.35))
    law = gains.find("micro", None, wild)
    assert loops.ripple(Settings(controller=law.scaled(wild, 64.0))) == math.inf
