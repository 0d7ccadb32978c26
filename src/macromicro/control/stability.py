"""Stability limits of the macro-stage's laws on a linear plant, with friction cancelled."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.control.law import Law
from macromicro.control.pd import PdInitial, PdTuned
from macromicro.control.pid import Pid
from macromicro.models.macro import Linear, position_transfer
from macromicro.schema.par import entries, replaced, value_at

_ROUNDING = 1e-6  # of a double pole at 1
_HALVINGS, _QUARTERS, _FINE = 30, 60, 2e-3


def find_unstable_gain(
    gains: Any, usual: Mapping[str, float], stable: Callable[[Any], bool]
) -> tuple[str, float] | None:
    """The gain that makes a loop unstable."""
    for name in sorted(usual, key=lambda each: -_away(value_at(gains, each), usual[each])):
        value, good = float(value_at(gains, name)), float(usual[name])

        def of(one: float, name: str = name) -> bool:
            return stable(replaced(gains, name, one))

        if value != good and of(good):
            return name, _nearest(of, good, value)
    return None


def _away(value: float, usual: float) -> float:
    """Distance of a gain from its usual value, on a logarithmic scale."""
    if value == usual:
        return 0.0
    return abs(math.log(value / usual)) if value * usual > 0.0 else math.inf


def _nearest(stable: Callable[[float], bool], good: float, bad: float) -> float:
    """The stable value nearest to a bad one."""
    if good == 0.0:
        for _ in range(_QUARTERS):
            if stable(0.25 * bad):
                good = 0.25 * bad
                break
            bad *= 0.25
    for _ in range(_HALVINGS):
        if abs(bad - good) <= _FINE * max(abs(good), abs(bad)):
            break
        middle = 0.5 * (good + bad)
        if good * bad > 0.0:
            middle = math.copysign(math.sqrt(good) * math.sqrt(bad), good) if good > 0.0 else middle
        good, bad = (middle, bad) if stable(middle) else (good, middle)
    rounded = float(f"{good:.3g}")
    return rounded if stable(rounded) else good


def words(value: float, bound: float, spoken: str) -> str:
    """The accepted range of a gain."""
    side = "at most" if bound < value else "at least"
    return f"{side} {spoken}, where the linear loop is stable with the other gains as they are"


def macro_loop(gains: Any, linear: Linear = Linear()) -> tuple[Array, Array]:  # noqa: B008
    """The open loop of a macro law with the linear model (4.4)."""
    num, den = position_transfer(linear)
    if not isinstance(gains, Pid):
        return np.convolve(np.array(gains, np.float64), num), np.convolve([1.0, 0.0], den)
    kp, ki, kd = gains
    dt = linear.dt
    # kp + ki dt z / (z - 1) + kd (z - 1) / (z dt), over z (z - 1)
    over = np.array([kp + ki * dt + kd / dt, -kp - 2.0 * kd / dt, kd / dt])
    return np.convolve(over, num), np.convolve([1.0, -1.0, 0.0], den)


def problem(law: Law, gains: Any) -> tuple[str, float, str] | None:
    if not isinstance(gains, Pid | PdInitial | PdTuned) or _stable(gains):
        return None
    return refusal(law.field, gains, law.gains()._asdict(), _stable)


def refusal(
    path: str, gains: Any, usual: Mapping[str, float], stable: Callable[[Any], bool]
) -> tuple[str, float, str]:
    """The setting, value and accepted range of the gain that makes a loop unstable."""
    found = find_unstable_gain(gains, usual, stable)
    if found is None:
        name = max(usual, key=lambda each: _away(getattr(gains, each), usual[each]))
        value = getattr(gains, name)
        return f"{path}.{name}", value, f"gains of a stable loop, such as {usual[name]:g}"
    name, bound = found
    value = getattr(gains, name)
    return f"{path}.{name}", value, words(value, bound, _describe_gain(gains, name, bound))


def _describe_gain(gains: Any, name: str, bound: float) -> str:
    par = next(e.par for e in entries(gains) if e.path == name)
    return str(par.spoken(bound))


@lru_cache(maxsize=1024)
def _stable(gains: Any) -> bool:
    num, den = macro_loop(gains)
    return bool(np.all(np.abs(np.roots(np.polyadd(num, den))) <= 1.0 + _ROUNDING))
