"""What is not known exactly about the machine: one table of parameters and their ranges.

Within its range each is taken as uniformly distributed and independent of the others:
nothing but the range is known of it.

That the stroke, the transformation temperatures and the hysteresis of NiTi actuators change
as they are cycled is established (functional fatigue: J. Frenzel, "On the Importance of
Structural and Functional Fatigue in Shape Memory Technology", Shape Memory and
Superelasticity 6 (2020) 213-222). How much depends on alloy, treatment, load and strain, and
nobody measured it on the thesis' actuator: the sizes below are assumptions.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

from macromicro.errors import InputError
from macromicro.schema import config
from macromicro.schema.par import Entry, changed, entries, value_at
from macromicro.settings import Settings

FACTOR, SHIFT, VALUE = "factor", "shift", "value"
_WORN = "assumption; that it changes with cycling: Frenzel (2020)"
_ASSUMED = "assumption"


class Uncertain(NamedTuple):
    """One quantity that is uncertain, from `low` to `high`.

    `kind`: FACTOR multiplies what the settings say at every path of `parts`, SHIFT is added
    to it, times the part's weight, VALUE takes its place. `unit` is that of `low` and `high`.
    """

    name: str
    parts: tuple[tuple[str, float], ...]
    kind: str
    low: float
    high: float
    unit: str
    meaning: str
    source: str


def _factor(
    name: str, low: float, high: float, meaning: str, source: str, *paths: str
) -> Uncertain:
    parts = tuple((path, 1.0) for path in paths)
    return Uncertain(name, parts, FACTOR, low, high, "", meaning, source)


_FRICTION = "assumption: wear, dust and grease, 30 % both ways"
# 0.35 of a shift of the heating thresholds reaches the cooling ones through the default
# `bench.phase.cool_slope`; the rest makes it a shift of the whole loop.
_LOOP = (
    ("bench.phase.heat_start", 1.0),
    ("bench.phase.heat_end", 1.0),
    ("bench.phase.cool_offset", 0.65),
    ("bench.phase.cool_end", 1.0),
)

UNCERTAIN: tuple[Uncertain, ...] = (
    _factor("coulomb", 0.7, 1.3, "kinetic friction", _FRICTION, "bench.friction.coulomb"),
    _factor("stribeck", 0.7, 1.3, "breakaway above it", _FRICTION, "bench.friction.stribeck"),
    _factor("viscous", 0.7, 1.3, "viscous friction", _FRICTION, "bench.friction.viscous"),
    _factor("belt_frequency", 0.9, 1.1, "belt tension", _ASSUMED, "bench.belt.frequency"),
    _factor("belt_decay", 0.7, 1.3, "belt damping", _ASSUMED, "bench.belt.decay"),
    _factor("belt_share", 0.7, 1.3, "rocking of the stage", _ASSUMED, "bench.belt.participation"),
    Uncertain(
        "ambient",
        (("bench.thermal.ambient", 1.0),),
        VALUE,
        15.0,
        35.0,
        "degC",
        "room temperature",
        "assumption: 10 K both ways of the 25 degC of Section 5.2.2",
    ),
    _factor("hall_noise", 0.5, 2.0, "Hall sensor's noise", _ASSUMED, "sensors.hall.noise"),
    _factor(
        "laser_noise",
        0.5,
        2.0,
        "laser's noise, fast and slow",
        _ASSUMED,
        "sensors.laser.noise",
        "sensors.laser.drift",
    ),
    # A stop or end switch beyond the stroke left would be a machine that never was; both stay
    # where they are as a share of it.
    _factor(
        "stroke",
        0.95,
        1.0,
        "stroke left by ageing",
        _WORN,
        "bench.wire.stroke",
        "bench.wire.stop",
        "bench.driver.contract_on",
        "bench.driver.contract_off",
    ),
    Uncertain(
        "loop_shift",
        _LOOP,
        SHIFT,
        -10.0,
        5.0,
        "K",
        "shift of all transformation temperatures by ageing",
        _WORN,
    ),
    _factor("latent", 0.85, 1.0, "latent heat left by ageing", _ASSUMED, "bench.wire.latent"),
    _factor(
        "wire_heat_path",
        0.9,
        1.2,
        "heat resistance, wires to plates, as contacts age",
        _ASSUMED,
        "bench.thermal.wire_resistance",
    ),
    _factor(
        "body_heat_path",
        0.85,
        1.15,
        "heat resistance, body to air: mounting, dust",
        _ASSUMED,
        "bench.thermal.body_resistance",
    ),
    _factor(
        "supply",
        0.97,
        1.03,
        "driver's supply; its square is the heat, which falls as the wires' resistance rises",
        _ASSUMED,
        "bench.driver.supply",
    ),
)


def nominal(each: Uncertain, settings: Settings) -> float:
    """Where the settings themselves stand on this parameter's scale."""
    if each.kind == VALUE:
        return float(value_at(settings, each.parts[0][0]))
    return 1.0 if each.kind == FACTOR else 0.0


def applied(settings: Settings, each: Uncertain, amount: float) -> Settings:
    """The settings with one uncertain parameter at `amount`; not yet checked."""
    changes = {}
    for path, weight in each.parts:
        now = float(value_at(settings, path))
        new = {FACTOR: now * amount, SHIFT: now + weight * amount, VALUE: amount}
        changes[path] = new[each.kind]
    tree: Settings = changed(settings, changes)
    return tree


def refusal(tree: Settings) -> str | None:
    """Why these settings cannot be a machine, in words; None where they can be."""
    try:
        for entry in _varied():
            entry.check(value_at(tree, entry.path), entry.path)
        config.check(tree, "these settings", together=False)
    except InputError as error:
        return str(error)
    return None


@cache
def _varied() -> tuple[Entry, ...]:
    """The parameters that can be varied."""
    varied = {path for each in UNCERTAIN for path, _ in each.parts}
    return tuple(e for e in entries(Settings()) if e.path in varied)
