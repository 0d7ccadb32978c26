"""Parameters of an identified drive with their units, in words."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from macromicro.identify.result import Line, rounded
from macromicro.place import ANGLE, LENGTH, PLACES

if TYPE_CHECKING:
    from macromicro.identify._ripple import Ripple
    from macromicro.identify.axis_fit import DriveFit
    from macromicro.identify.axis_inverse import Estimate

MEANINGS = {
    "mass": "inertia",
    "viscous": "viscous friction",
    "coulomb": "Coulomb friction",
    "offset": "constant force",
    "asymmetry": "viscous, excess of forwards over backwards",
    "stribeck": "breakaway above Coulomb",
    "stribeck_speed": "speed over which that fades",
    "unbalance": "gravity's greatest torque",
    "hangs": "angle at which the load hangs",
}
METHODS = ("inverse dynamics", "output error")
# Parameters that are there, or are not: of these the error must not exceed the value.
ABOVE_ZERO = ("mass", "viscous", "coulomb", "stribeck", "stribeck_speed", "spring", "dead_zone")


def lines(fit: DriveFit, units: dict[str, str], dt: float) -> list[Line]:
    found = []
    both = told(fit.inverse), told(fit.refined)
    best, other = both if fit.surest is fit.inverse else both[::-1]
    by = METHODS[fit.surest is fit.inverse]
    if "lag" in both[1]:
        lag, error, factor = both[1].pop("lag")
        late = fit.delay * dt + lag
        found.append(Line("delay", late, error, "s", "of the force", factor))
    for name in both[1]:
        value, error, factor = best[name]
        second, spread = rounded(*other[name][:2])
        note = f"{MEANINGS[name]}; {by} {second}" + (spread and f" +- {spread}")
        found.append(Line(name, value, error, units[name], note, factor))
    return found


def told(found: Estimate) -> dict[str, tuple[float, float, float]]:
    """Parameters of an estimate; an eccentric load as unbalance and angle."""
    from macromicro.identify import eccentric
    from macromicro.identify.axis_inverse import ECCENTRIC

    each = (found.values, found.std, found.factors[1])
    every = zip(*(column.tolist() for column in each), strict=True)
    own = dict(zip(found.names, every, strict=True))
    made = {name: row for name, row in own.items() if name not in ECCENTRIC}
    factors = found.spread.factors(eccentric.slopes(found))[1]
    load = zip(*(column.tolist() for column in (*eccentric.told(found), factors)), strict=True)
    return made | dict(zip(eccentric.NAMES, load, strict=False))


def slow(name: str) -> tuple[str, str]:
    """What errors by parts of a record leave out."""
    text = f"the error of {name} leaves out forces that last longer than a part of a record"
    return "slow forces", text


def repeated(found: Ripple | None, force: str, x: str) -> list[tuple[str, str]]:
    if found is None:
        return []
    every = 2.0 * math.pi / found.turn
    told = f"a force of {found.size:.3g} {force} repeats every {every:.3g} {x}"
    return [("repeats", f"{told}; not modelled, but included in the errors")]


def late(delay: int | str) -> list[tuple[str, str]]:
    if not delay or isinstance(delay, str):
        return []
    return [("delay", f"u acts {delay} sample{'s' * (delay != 1)} late")]


def newton(x: str) -> str:
    """The unit of force where positions are in `x`: of torque for an angle."""
    return (ANGLE if x == ANGLE.base else LENGTH).named("N")


def units_of(force: str, x: str) -> dict[str, str]:
    """Units of the parameters, SI where force and position are."""
    whole = {(p.named("N"), p.base): p.named("kg") for p in PLACES}
    slope = f"{force}*s/{x}"
    return {
        "mass": whole.get((force, x), f"{force}*s^2/{x}"),
        "viscous": slope,
        "coulomb": force,
        "offset": force,
        "asymmetry": slope,
        "stribeck": force,
        "stribeck_speed": f"{x}/s",
        "unbalance": force,
        "hangs": x,
    }


def structure(fit: DriveFit) -> str:
    if not fit.holdout:
        return f"{fit.structure}, as given"
    tried = [f"{fit.structure} {fit.holdout[fit.structure]:.4g}, taken"]
    for name, why in fit.reasons.items():
        error = f" {fit.holdout[name]:.4g}" if name in fit.holdout else ""
        tried.append(f"{name}{error}: {why}")
    return "force error on held-out data: " + "; ".join(tried)
