"""Settings whose default is computed from others; a value set by the user stays."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from macromicro import nominal
from macromicro.control.live.parameters import BELOW, Live
from macromicro.plant.amplifier import Amplifier
from macromicro.programme.travel import Travel
from macromicro.rig.limits import Limits
from macromicro.schema.par import value_at

Derivation = tuple[str, Callable[[Any], float]]

_GUARD = ("macro_margin", "macro_rate", "macro_tolerance", "against", "fastest")


def _exact(value: float) -> float:
    """Rounded, so that the nominal machine keeps its round figures."""
    return round(value, 12)


def finer(tree: Any) -> float:
    """Counts per count of the nominal encoder."""
    return float(nominal.PITCH / tree.sensors.encoder.pitch)


def in_counts(path: str, nominally: float) -> Derivation:
    """The rule for a length or speed set in counts: the same in metres."""
    return path, lambda tree: _exact(nominally * finer(tree))


def _macro_travel(tree: Any) -> float:
    """Short of the stop by the thesis' margin, or the same share of a shorter travel."""
    high = tree.bench.carriage.stop_high
    spare = nominal.STOP_HIGH - nominal.TRAVEL
    return _exact(high - min(spare, spare / nominal.STOP_HIGH * high))


def _micro_travel(tree: Any) -> float:
    return _exact(tree.bench.wire.stop * (nominal.FINE_TRAVEL / nominal.FINE_STOP))


# Paths in an order in which none depends on a later one.
DERIVED: tuple[Derivation, ...] = (
    ("travel.macro", _macro_travel),
    ("travel.micro", _micro_travel),
    ("guard.motor", lambda tree: tree.bench.amplifier.full_scale),
    ("guard.ctrl", lambda tree: tree.bench.amplifier.full_scale),
    ("guard.hall_supply", lambda tree: tree.sensors.hall.supply),
    ("guard.ambient", lambda tree: tree.bench.thermal.ambient),
    ("controller.motor_limit", lambda tree: tree.guard.motor),
    ("controller.ctrl_limit", lambda tree: tree.guard.ctrl),
    ("controller.p.high", lambda tree: tree.controller.ctrl_limit),
    ("controller.pi.high", lambda tree: tree.controller.ctrl_limit),
    *(in_counts(f"guard.{name}", getattr(Limits(), name)) for name in _GUARD),
)


def of_law(tree: Any) -> tuple[Derivation, ...]:
    """Derived gains of laws that know their encoder, drive and D/A."""
    rules: tuple[Derivation, ...] = (
        ("controller.own.pitch", lambda tree: tree.sensors.encoder.pitch),
        ("controller.own.full", lambda tree: tree.controller.motor_limit),
        ("controller.fine.step", lambda tree: _code(tree.bench.amplifier)),
    )
    sets = {f"controller.{name}": getattr(tree.controller, name, ()) for name in ("own", "fine")}

    def there(path: str) -> bool:
        of, _, name = path.rpartition(".")
        return hasattr(sets[of], name)

    return tuple(rule for rule in rules if there(rule[0]))


def _code(p: Amplifier) -> float:
    return float(2.0 * p.full_scale / 2.0**p.bits)


def end_counts(tree: Any) -> tuple[int, int]:
    """Encoder counts at the two end stops."""
    stops, pitch = tree.bench.carriage, tree.sensors.encoder.pitch
    low, high = round(stops.stop_low / pitch, 6), round(stops.stop_high / pitch, 6)
    return math.ceil(low), math.floor(high)


def _share(nominally: float) -> Callable[[Any], float]:
    return lambda tree: _exact(nominally * (tree.travel.micro / Travel().micro))


def _inward(value: float, pitch: float, way: Callable[[float], int]) -> float:
    """Rounded down to a round figure of about two counts; in m."""
    step = 10.0 ** math.floor(math.log10(2.0 * pitch))
    return _exact(way(round(value / step, 6)) * step)


def _spare(tree: Any) -> float:
    """Distance [counts] that soft limits keep from an end stop."""
    return round(10.0 * finer(tree))


def _whole_low(tree: Any) -> float:
    pitch, live = tree.sensors.encoder.pitch, tree.live
    low = (live.limits.macro_low + 2.0) * pitch + live.fine.bias_low
    return _inward(low, pitch, math.ceil)


def _whole_high(tree: Any) -> float:
    pitch, live = tree.sensors.encoder.pitch, tree.live
    high = (live.limits.macro_high - 2.0) * pitch + live.fine.bias_high
    return _inward(high, pitch, math.floor)


_LIVE_COUNTS = (
    *("homing.speed", "homing.approach", "homing.quick", "homing.near"),
    *("homing.fastest", "homing.lead"),
    *("brake.fastest", "brake.margin", "edges.fastest"),
)

LIVE: tuple[Derivation, ...] = (
    ("live.pitch", lambda tree: tree.sensors.encoder.pitch),
    ("live.homing.volts", lambda tree: _exact(tree.guard.push - BELOW)),
    ("live.jogging.lean", lambda tree: tree.guard.lean),
    *(in_counts(f"live.{path}", value_at(Live(), path)) for path in _LIVE_COUNTS),
    ("live.homing.back_off", lambda tree: round(5.0 * finer(tree)) - end_counts(tree)[0]),
    ("live.limits.macro_low", lambda tree: end_counts(tree)[0] + _spare(tree)),
    ("live.limits.macro_high", lambda tree: end_counts(tree)[1] - _spare(tree)),
    ("live.limits.micro_high", _share(Live().limits.micro_high)),
    ("live.fine.bias_low", _share(Live().fine.bias_low)),
    ("live.fine.bias_high", _share(Live().fine.bias_high)),
    ("live.limits.whole_low", _whole_low),
    ("live.limits.whole_high", _whole_high),
    ("live.edges.lag", lambda tree: tree.sensors.hall.lag),
)
