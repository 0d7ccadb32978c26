"""What follows from a shape-memory wire's data sheet, and what a stage of it cannot do."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from macromicro.machines._rounding import round_to
from macromicro.machines.tree import Checked, Problem
from macromicro.plant.flexure import stiffness
from macromicro.plant.gauge import repeats

DENSITY = 6450.0  # kg/m^3; Dynalloy, F1140, physical properties
SPECIFIC = 837.0  # J/(kg K); the same: 0.2 cal/(g K)
LATENT = 24.2e3  # J/kg; the same: 5.78 cal/g
STIFFENING = 8e6  # Pa/K; Clausius-Clapeyron, literature: 6.5 to 10
MARTENSITE, AUSTENITE = 30e9, 75e9  # Pa; literature: 28 to 41, 83 at most
ROOM = 0.9  # share of the wire's way that targets may use
SLOWER = 0.5  # share of what heating and cooling can that moves use
QUICK = 100.0  # rad/s; bandwidth at most
LATE = 0.6  # rad; phase that period and driver may take there
HOTTER = 1.5  # times the rise to austenite finish that the guard allows
LEANS, SLOWLY = 0.9, 2.0  # of full effort, and times the warm-up: guard.lean and guard.leant
AGAINST = 0.1  # of the whole way, back under full effort
LEAP = 10.0  # times the greatest speed: guard.leap
# Integral action per proportional action, in thermal time constants of the wire. While the
# temperature crosses the hysteresis the position stands and the integral grows: above 3 the loop
# hunts, below 1 it arrives late (wires of 100, 150 and 250 um, the machines of examples/machines).
INTEGRAL = 2.0
PATIENT, SHORTEST = 2.0, 10.0  # arrival.patience: times the slowest crossing, and s at least


class Heats(NamedTuple):
    capacity: float  # J/K
    latent: float  # of the full transformation, J
    resistance: float  # to the air, K/W


class Shifted(NamedTuple):
    """Transformation temperatures at a load, deg C: start and end of heating and cooling."""

    heat_start: float  # austenite start
    heat_end: float  # austenite finish
    cool_start: float  # martensite start
    cool_end: float  # martensite finish


def area(tree: Any) -> float:
    return float(0.25 * math.pi * tree.wire.diameter**2)


def heats(tree: Any) -> Heats:
    """Heat capacity, latent heat and thermal resistance to the air.

    C dT/dt = -(T - T_a)/R from austenite finish to martensite finish, with the latent heat released
    midway between martensite start and finish, takes the printed cooling time.
    """
    alloy = tree.wire
    mass = DENSITY * area(tree) * alloy.length
    capacity, latent = mass * SPECIFIC, mass * LATENT
    room = tree.air.printed
    fall = capacity * math.log((alloy.heat_end - room) / (alloy.cool_end - room))
    middle = 0.5 * (alloy.cool_start + alloy.cool_end) - room
    return Heats(capacity, latent, alloy.cooling / (fall + latent / middle))


def stroke(tree: Any) -> float:
    """Contraction of the free wire."""
    return float(tree.wire.strain * tree.wire.length)


def rate(tree: Any) -> float:
    """Rise of the load with the contraction: spring and guide."""
    return float(tree.bias.rate + stiffness(tree.flexure))


def way(tree: Any) -> float:
    """Contraction against the load, less elastic stretch."""
    scale = area(tree) / tree.wire.length
    cold = tree.bias.preload / (MARTENSITE * scale)
    hot = 1.0 / (AUSTENITE * scale)
    return float((stroke(tree) + cold - hot * tree.bias.preload) / (1.0 + hot * rate(tree)))


def pull(tree: Any, x: float) -> float:
    """Load at a contraction."""
    return float(tree.bias.preload + rate(tree) * x)


def shift_temperatures(tree: Any, load: float) -> Shifted:
    """Transformation temperatures (deg C) at a load; the printed ones hold at the printed pull."""
    alloy = tree.wire
    off = (load - alloy.pull) / (STIFFENING * area(tree))
    return Shifted(
        alloy.heat_start + off, alloy.heat_end + off, alloy.cool_start + off, alloy.cool_end + off
    )


def power(tree: Any) -> float:
    """Heat at full effort."""
    ohms = tree.wire.resistance * tree.wire.length
    return float(tree.driver.current**2 * ohms)


def per_joule(tree: Any) -> float:
    """Contraction per heat while the wire transforms."""
    found, alloy = heats(tree), tree.wire
    rise = alloy.heat_end - alloy.heat_start + rate(tree) * way(tree) / (STIFFENING * area(tree))
    return float(way(tree) / (found.latent + found.capacity * rise))


def speeds(tree: Any) -> tuple[float, float]:
    """Greatest speeds of contraction and extension, at their slowest points."""
    found, room = heats(tree), tree.air.ambient
    hot = shift_temperatures(tree, pull(tree, way(tree))).heat_end
    cold = shift_temperatures(tree, tree.bias.preload).cool_end
    lost = (hot - room) / found.resistance
    return (
        per_joule(tree) * (power(tree) - lost),
        per_joule(tree) * (cold - room) / found.resistance,
    )


def time_constant(tree: Any) -> float:
    """Thermal time constant of the wire in air, s, without latent heat."""
    found = heats(tree)
    return found.capacity * found.resistance


def bandwidth(tree: Any) -> float:
    """Bandwidth of the position loop, limited by period and driver lag."""
    return min(QUICK, LATE / float(tree.timing.period + tree.driver.lag))


def warm_up(tree: Any) -> float:
    """Time in which full effort warms the cold wire until it contracts."""
    found, room = heats(tree), tree.air.ambient
    rise = shift_temperatures(tree, tree.bias.preload).heat_start - room
    share = rise / (power(tree) * found.resistance)
    if share >= 1.0:
        return math.inf
    return -time_constant(tree) * math.log(1.0 - share)


def _heat_limit(tree: Any) -> float:
    """The mean effort above which a wire of the sheet is hotter than necessary."""
    found, room = heats(tree), tree.air.ambient
    rise = shift_temperatures(tree, pull(tree, way(tree))).heat_end - room
    allowed = HOTTER * rise + found.latent / found.capacity
    return round_to(tree.guard.effort * allowed / (power(tree) * found.resistance))


def _velocity(tree: Any) -> float:
    return round_to(SLOWER * max(min(speeds(tree)), 1e-3 * way(tree)))


def _gain(tree: Any) -> float:
    return float(bandwidth(tree) * tree.driver.full_scale / (per_joule(tree) * power(tree)))


def crossing(tree: Any) -> float:
    """Time in which the integral of an error at the tolerance crosses the hysteresis, s."""
    width = (tree.wire.heat_start - tree.wire.cool_end) / heats(tree).resistance
    effort = width / power(tree) * tree.driver.full_scale
    return float(effort / (tree.controller.ki * tree.arrival.tolerance))


RULES: tuple[tuple[str, Callable[[Any], Any]], ...] = (
    ("travel.high", lambda t: round_to(ROOM * way(t))),
    ("arrival.tolerance", lambda t: round_to(max(4.0 * t.encoder.pitch, 6.0 * t.encoder.noise))),
    ("motion.velocity", _velocity),
    # Speed within a tenth of the way, its rise within a third of that time.
    ("motion.acceleration", lambda t: round_to(t.motion.velocity**2 / (0.2 * way(t)))),
    ("motion.jerk", lambda t: round_to(3.0 * t.motion.acceleration**2 / t.motion.velocity)),
    ("controller.kp", lambda t: round_to(_gain(t))),
    ("controller.ki", lambda t: round_to(INTEGRAL * t.controller.kp / time_constant(t))),
    ("arrival.patience", lambda t: round_to(max(SHORTEST, PATIENT * crossing(t)))),
    ("controller.ahead_velocity", lambda t: round_to(_gain(t) / bandwidth(t))),
    ("controller.low", lambda t: 0.0),
    ("controller.high", lambda t: t.driver.full_scale),
    ("guard.effort", lambda t: t.controller.high),
    ("guard.push", lambda t: t.guard.effort),  # a cold wire is driven and does not move yet
    ("guard.low", lambda t: round_to(-0.1 * way(t))),
    ("guard.high", lambda t: round_to(1.1 * way(t))),
    ("guard.speed", lambda t: round_to(2.0 * per_joule(t) * power(t))),
    ("guard.error", lambda t: round_to(1.1 * way(t))),  # it begins to move when it is warm
    ("guard.lean", lambda t: round_to(LEANS * t.guard.effort)),
    ("guard.leant", lambda t: round_to(0.5 + SLOWLY * warm_up(t))),
    ("guard.still", lambda t: round_to(2.0 * t.encoder.pitch + 8.0 * t.encoder.noise)),
    ("guard.against", lambda t: round_to(AGAINST * way(t))),
    ("guard.leap", lambda t: round_to(LEAP * t.guard.speed)),
    ("guard.repeats", lambda t: round_to(repeats(t.encoder, t.timing.period))),
    ("guard.heat", _heat_limit),
    ("guard.heating", lambda t: round_to(time_constant(t))),
)


def problems(tree: Any) -> list[Problem]:
    every = (*_load(tree), *_heat(tree), *_way(tree), *_sensor(tree))
    return [(path, value, words) for wrong, path, value, words in every if wrong]


def _load(tree: Any) -> Iterator[Checked]:
    """A spring that stretches the cold wire and that the hot wire can pull."""
    alloy, bias = tree.wire, tree.bias
    yield (
        bias.preload < alloy.stretch,
        "bias.preload",
        bias.preload,
        "{wire.stretch} or more, or the cold wire is not stretched again",
    )
    most = pull(tree, way(tree))
    yield (
        most > alloy.pull,
        "bias.rate",
        bias.rate,
        f"a load of at most {{wire.pull}} at full contraction; spring and guide make it "
        f"{most:.4g} N",
    )
    for first, last in (("heat_start", "heat_end"), ("cool_end", "cool_start")):
        value = getattr(alloy, last)
        yield value <= getattr(alloy, first), f"wire.{last}", value, f"above {{wire.{first}}}"
    yield (
        alloy.cool_start >= alloy.heat_end,
        "wire.cool_start",
        alloy.cool_start,
        "below {wire.heat_end}",
    )


def _heat(tree: Any) -> Iterator[Checked]:
    """A wire that gets hot enough, and cold again."""
    found = heats(tree)
    hot = shift_temperatures(tree, pull(tree, way(tree))).heat_end
    reached = tree.air.ambient + power(tree) * found.resistance
    needed = math.sqrt(max(hot - tree.air.ambient, 0.0) / found.resistance)
    ohms = tree.wire.resistance * tree.wire.length
    yield (
        reached <= hot,
        "driver.current",
        tree.driver.current,
        f"above {needed / math.sqrt(ohms):.3g} A: the wire reaches {reached:.4g} degC, and is "
        f"contracted at {hot:.4g} degC under its load",
    )
    cold = shift_temperatures(tree, tree.bias.preload).cool_end
    yield (
        tree.air.ambient >= cold,
        "air.ambient",
        tree.air.ambient,
        f"below {cold:.4g} degC, or the wire never extends under {{bias.preload}}",
    )
    yield (
        hot > 119.0,
        "wire.heat_end",
        tree.wire.heat_end,
        f"at most 119 degC under load, where the relays' table ends; this is {hot:.4g} degC",
    )


def _way(tree: Any) -> Iterator[Checked]:
    """Travel within the contraction, speed within heating and cooling."""
    travel, guard, most = tree.travel, tree.guard, way(tree)
    yield travel.low < 0.0, "travel.low", travel.low, "0 mm or more: a wire only contracts"
    yield travel.low > 0.0, "travel.low", travel.low, "0 mm, where every run begins"
    yield (
        not 0.0 < travel.high <= most,
        "travel.high",
        travel.high,
        f"above 0 mm and at most {1e3 * most:.4g} mm, {{wire.strain}} of {{wire.length}} less the "
        "wire's stretch",
    )
    yield travel.high > guard.high, "travel.high", travel.high, "at most {guard.high}"
    yield guard.low > 0.0, "guard.low", guard.low, "at most 0 mm, where every run begins"
    up, down = speeds(tree)
    yield (
        tree.motion.velocity > max(up, 0.0),
        "motion.velocity",
        tree.motion.velocity,
        f"at most {1e3 * up:.3g} mm/s, which {{driver.current}} heat the wire for",
    )
    yield (
        tree.motion.velocity > max(down, 0.0),
        "motion.velocity",
        tree.motion.velocity,
        f"at most {1e3 * down:.3g} mm/s, at which the wire cools; {{wire.cooling}} is printed",
    )


def _sensor(tree: Any) -> Iterator[Checked]:
    """A sensor of sufficient resolution, and a loop quick enough."""
    encoder, tolerance, timing = tree.encoder, tree.arrival.tolerance, tree.timing
    yield (
        tree.travel.high > encoder.high,
        "travel.high",
        tree.travel.high,
        "at most {encoder.high}, the end of what the sensor shows",
    )
    yield (
        tolerance < max(3.0 * encoder.noise, encoder.pitch),
        "arrival.tolerance",
        tolerance,
        f"{1e6 * max(3.0 * encoder.noise, encoder.pitch):.4g} um or more: three times "
        "{encoder.noise}, and one step of {encoder.pitch}",
    )
    yield (
        timing.period > 0.1 / bandwidth(tree),
        "timing.period",
        timing.period,
        f"at most {100.0 / bandwidth(tree):.4g} ms for a loop of {bandwidth(tree):.3g} rad/s",
    )
    for name in ("silent", "stuck", "window"):
        value = getattr(tree.guard, name)
        yield (
            value < timing.period,
            f"guard.{name}",
            value,
            "{timing.period} or more: the guard looks once a period",
        )
