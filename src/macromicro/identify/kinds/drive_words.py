"""What a drive that was identified tells: its parameters with their units, in words."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from macromicro.identify.result import Line, rounded
from macromicro.place import PLACES

if TYPE_CHECKING:
    from macromicro.identify.axis_fit import DriveFit
    from macromicro.identify.axis_inverse import Estimate
    from macromicro.identify.ripple import Ripple

MEANINGS = {
    "mass": "inertia",
    "viscous": "viscous friction",
    "coulomb": "Coulomb friction",
    "offset": "constant force",
    "asymmetry": "viscous, forwards more than backwards by",
    "stribeck": "breakaway above Coulomb",
    "stribeck_speed": "speed over which that fades",
    "unbalance": "gravity's greatest torque",
    "hangs": "angle at which the load hangs",
}


def lines(fit: DriveFit, units: dict[str, str], dt: float) -> list[Line]:
    """The parameters by output error, beside those by inverse dynamics.

    Parameters
    ----------
    fit : DriveFit
        What was found.
    units : dict[str, str]
        By name of the parameter.
    dt : float
        Sample time, s.

    Returns
    -------
    list[Line]
        One for each.
    """
    found = []
    inverse, refined = told(fit.inverse), told(fit.refined)
    if "lag" in refined:
        lag, error, factor = refined.pop("lag")
        late = fit.delay * dt + lag
        found.append(Line("delay", late, error, "s", "by which the force acts late", factor))
    for name, (value, error, factor) in refined.items():
        other, spread = rounded(*inverse[name][:2])
        note = f"{MEANINGS[name]}; inverse dynamics {other}" + (spread and f" +- {spread}")
        found.append(Line(name, value, error, units[name], note, factor))
    return found


def told(found: Estimate) -> dict[str, tuple[float, float, float]]:
    """What an estimate tells of an axis; an eccentric load as people know it.

    Parameters
    ----------
    found : Estimate
        By any method.

    Returns
    -------
    dict[str, tuple[float, float, float]]
        Value, standard error and coverage factor of 95 % by name.
    """
    from macromicro.identify import coverage, eccentric
    from macromicro.identify.axis_inverse import ECCENTRIC

    each = (found.values, found.std, found.factors[1])
    every = zip(*(column.tolist() for column in each), strict=True)
    own = dict(zip(found.names, every, strict=True))
    made = {name: row for name, row in own.items() if name not in ECCENTRIC}
    factors = coverage.factors(found.draws, eccentric.slopes(found))[1]
    load = zip(*(column.tolist() for column in (*eccentric.told(found), factors)), strict=True)
    return made | dict(zip(eccentric.NAMES, load, strict=False))


def repeated(found: Ripple | None, force: str, x: str) -> list[tuple[str, str]]:
    """What to say of a force that repeats along the way.

    Parameters
    ----------
    found : Ripple or None
        The force; None where there is none.
    force : str
        Unit of the force.
    x : str
        Unit of the position.

    Returns
    -------
    list[tuple[str, str]]
        A remark, or none.
    """
    if found is None:
        return []
    every = 2.0 * math.pi / found.turn
    told = f"a force of {found.size:.3g} {force} repeats every {every:.3g} {x}"
    return [("repeats", f"{told}; not in the model, errors allow for it")]


def late(delay: int | str) -> list[tuple[str, str]]:
    """What to say of a delay that was given.

    Parameters
    ----------
    delay : int | str
        Samples, or "fit": it is one of the parameters.

    Returns
    -------
    list[tuple[str, str]]
        A remark; none of no delay.
    """
    if not delay or isinstance(delay, str):
        return []
    return [("delay", f"u acts {delay} sample{'s' * (delay != 1)} late")]


def units_of(force: str, x: str) -> dict[str, str]:
    """Units of the parameters; kg, N s/m and N, or kg m^2, N m s/rad and N m, where force and
    position are SI.

    Parameters
    ----------
    force : str
        Unit of the force.
    x : str
        Unit of the position.

    Returns
    -------
    dict[str, str]
        Unit by name of the parameter.
    """
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
    """The friction that was chosen, and by what, in words.

    Parameters
    ----------
    fit : DriveFit
        What was found.

    Returns
    -------
    str
        One line.
    """
    if not fit.holdout:
        return f"{fit.structure}, as given"
    tried = [f"{fit.structure} {fit.holdout[fit.structure]:.4g}, taken"]
    for name, why in fit.reasons.items():
        error = f" {fit.holdout[name]:.4g}" if name in fit.holdout else ""
        tried.append(f"{name}{error}: {why}")
    return "force error on held-out data: " + "; ".join(tried)
