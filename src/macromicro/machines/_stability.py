"""Gains with which the linear loop is unstable, or that are invalid."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import Any

import numpy as np

from macromicro import place as places
from macromicro.arrays import Array
from macromicro.control.integral import Integral
from macromicro.control.stability import find_unstable_gain, words
from macromicro.machines import loops, piezo_loop, sheets, wire_sheets
from macromicro.machines.loops import Complex
from macromicro.machines.tree import Checked, is_own
from macromicro.schema.par import entries, value_at

_SLOWEST = 1e-9  # of the sampling rate: far below all poles but those at 0
_TIMES = 10.0  # the feed-forward that follows from the data sheets
_APART = 50  # points between which the slope of a loop at low frequencies is seen

Law = Callable[[Any, Array, float], Complex]
Plant = Callable[[Any, Array], Complex]


def stable(loop: Complex, frequency: Array) -> bool:
    """Whether a closed loop is stable (Nyquist), with any number of poles at 0."""
    size = np.abs(loop)
    if not np.isfinite(size).all():
        return False
    if size.max() < 1.0:
        return True
    slope = math.log(size[0] / size[_APART]) / math.log(frequency[_APART] / frequency[0])
    return loops.modulus(loop, round(slope)) > 0.0


def axis(tree: Any) -> Iterator[Checked]:
    p = tree.controller
    for name in ("ahead_friction", "loosen", "ahead_gravity", "ahead_unbalance"):
        value = getattr(p, name)
        accepted = "at most {controller.limit} either way, the greatest effort"
        yield abs(value) > p.limit, f"controller.{name}", value, accepted
    yield from _ahead(tree, p.limit, "{controller.limit}, the greatest effort,")
    yield (
        p.rest > tree.arrival.tolerance,
        "controller.rest",
        p.rest,
        "at most {arrival.tolerance}, or it rests before it has arrived",
    )
    names = ("position", "velocity", "integral", "observer")
    yield from _unstable(tree, names, sheets.plant, loops.law)


def piezo(tree: Any) -> Iterator[Checked]:
    least, most = (end / tree.amplifier.gain for end in (tree.amplifier.low, tree.amplifier.high))
    yield from _range(tree, least, most, "what the amplifier can give")
    yield from _ahead(tree, tree.travel.high - tree.travel.low, "the whole travel")

    def law(gains: Integral, frequency: Array, dt: float) -> Complex:
        scale = float(tree.amplifier.gain) / gains.gain
        return scale * piezo_loop.law(gains, frequency, dt)

    names = ("integral", "drift", "proportional", "gain")
    yield from _unstable(tree, names, piezo_loop.plant, law)


def wire(tree: Any) -> Iterator[Checked]:
    yield from _range(tree, 0.0, tree.driver.full_scale, "what the driver can give")
    yield from _ahead(tree, tree.driver.full_scale, "the driver's full scale", ("velocity",))
    yield from _unstable(tree, ("kp", "ki"), _contraction_per_effort, loops.pi)


def _contraction_per_effort(tree: Any, frequency: Array) -> Complex:
    """Contraction per effort while the wire transforms, without heat loss, m/V."""
    s = np.asarray(2j * math.pi * np.asarray(frequency), np.complex128)
    per_volt = wire_sheets.per_joule(tree) * wire_sheets.power(tree) / tree.driver.full_scale
    found: Complex = (
        per_volt / s / (1.0 + s * tree.driver.lag) * loops.hold_and_delay(s, tree.timing)
    )
    return found


def _range(tree: Any, least: float, most: float, what: str) -> Iterator[Checked]:
    p, room = tree.controller, 1e-9 * (most - least)
    for name, low, high in (("low", least, min(p.high, most)), ("high", max(p.low, least), most)):
        value = getattr(p, name)
        accepted = f"{least:.4g} to {most:.4g} V, {what}, and low below high"
        wrong = not low - room <= value <= high + room or p.low >= p.high
        yield wrong, f"controller.{name}", value, accepted


def _ahead(
    tree: Any, whole: float, what: str, names: tuple[str, ...] = ("velocity", "acceleration")
) -> Iterator[Checked]:
    """Feed-forward gains within all valid values, at least some times those of the data sheets."""
    usual = _usual(tree, tuple(f"ahead_{name}" for name in names))
    for name in names:
        value, least = getattr(tree.controller, f"ahead_{name}"), _TIMES * usual[f"ahead_{name}"]
        most = whole / max(getattr(tree.motion, name), 1e-300)
        why = f"{what} at {{motion.{name}}}"
        if least > most:
            most, why = least, f"{_TIMES:g} times what follows from the data sheets"
        accepted = f"at most {_with_unit(tree, f'ahead_{name}', most)}: {why}"
        yield value > most * (1.0 + 1e-9), f"controller.ahead_{name}", value, accepted


def _usual(tree: Any, names: tuple[str, ...]) -> dict[str, float]:
    """Gains that follow from the data sheets, else those of the law."""
    plain = type(tree.controller)()
    known = {e.path for e in entries(plain)}
    usual = {name: float(value_at(plain, name)) for name in names if name in known}
    for path, rule in tree.derived():
        if (name := path.removeprefix("controller.")) in usual:
            usual[name] = float(rule(tree))
    return usual


def _unstable(tree: Any, names: tuple[str, ...], plant: Plant, law: Law) -> Iterator[Checked]:
    """The gain that makes the linear loop unstable, if it is."""
    dt, gains = float(tree.timing.period), tree.controller
    frequency = loops.grid(dt, _SLOWEST / dt)
    body = _body(plant, tree._replace(controller=None, guard=None, motion=None, arrival=None))

    def holds(some: Any) -> bool:
        with np.errstate(all="ignore"):
            return stable(body * law(some, frequency, dt), frequency)

    if holds(gains):
        return
    notch = tuple(f"notch.{name}" for name in ("frequency", "depth", "width"))
    usual = _usual(tree, (*names, *notch))
    found = find_unstable_gain(gains, usual, holds)
    name, bound = found or (names[0], usual[names[0]])
    value, spoken = value_at(gains, name), _with_unit(tree, name, bound)
    accepted = words(value, bound, spoken)
    if found is None:
        accepted = f"gains with which the linear loop is stable; the data sheets give {spoken}"
    yield True, f"controller.{name}", value, accepted


@lru_cache(maxsize=64)
def _body(plant: Plant, tree: Any) -> Complex:
    """Frequency response of the plant."""
    dt = float(tree.timing.period)
    with np.errstate(all="ignore"):
        return plant(tree, loops.grid(dt, _SLOWEST / dt))


def _with_unit(tree: Any, name: str, value: float) -> str:
    par = next(e.par for e in entries(tree.controller) if e.path == name)
    unit = "" if par.read_in == "1" else places.of(tree).named(par.read_in)
    return f"{par.given(value):.4g} {unit}".rstrip()


def problems(tree: Any, rules: Callable[[Any], Iterator[Checked]]) -> list[tuple[str, Any, str]]:
    """Invalid gains of this package's laws."""
    every = () if is_own(tree) else rules(tree)
    return [(path, value, accepted) for wrong, path, value, accepted in every if wrong]
