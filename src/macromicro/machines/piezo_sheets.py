"""What follows from a piezo stage's data sheet, and what the stage cannot do."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

from macromicro.hysteresis import prandtl
from macromicro.hysteresis.prandtl import Prandtl
from macromicro.hysteresis.prandtl_loop import Loop, shaped
from macromicro.machines._rounding import round_to
from macromicro.machines.tree import Checked, Problem
from macromicro.plant.gauge import repeats
from macromicro.plant.piezo import loaded_resonance

SPREAD = 0.25  # of the weights: a guess that suits soft ceramics; `identify plays` measures them
PLAYS = 12
SHARE = 0.15  # of the resonance that the integral gain takes: a gain margin of 2.7 where it is 10 %
# off, half as damped as usual, and the stroke 20 % more
MOST = 0.4  # from here on such a stage swings up
DRIFT = 0.1  # of the integral gain: the second integral takes 6 degrees of the phase margin
DAMPING = 0.02  # usual for a flexure guide
FINEST = 25e-6  # s; longest step of the physics
SPARE = 0.25  # share of the amplifier's current that moves may use


def omega(tree: Any) -> float:
    """Printed resonance with the load."""
    return 2.0 * math.pi * loaded_resonance(tree.guide)


def loop(tree: Any) -> Prandtl:
    """The hysteresis of the data sheet."""
    stack = tree.stack
    size = Loop(stack.stroke, stack.hysteresis * stack.stroke)
    return shaped(size, stack.span, SPREAD, PLAYS)


def lag(tree: Any) -> float:
    """Delay of hold, output, amplifier and damped resonance."""
    amplifier = 1.0 / (2.0 * math.pi * tree.amplifier.bandwidth)
    timing = 0.5 * tree.timing.period + tree.timing.delay
    return float(timing + amplifier + 2.0 * DAMPING / omega(tree))


def fastest(tree: Any) -> float:
    """Speed at the amplifier's full current."""
    slew = tree.amplifier.current / tree.amplifier.capacitance
    return float(slew * tree.stack.stroke / tree.stack.span)


def reach(tree: Any) -> tuple[float, float]:
    """Stroke over the amplifier's range: up from rest, then down."""
    high, low = prandtl.run(loop(tree), [tree.amplifier.high, tree.amplifier.low])
    return float(low), float(high)


def _acceleration(tree: Any) -> float:
    # The speed is reached over six periods of the resonance, its rise over two: it stays quiet.
    return round_to(tree.motion.velocity * omega(tree) / (12.0 * math.pi))


def _soft_limit(tree: Any, edge: float) -> float:
    """A soft limit 5 % beyond the travel, within the sensor's range."""
    room = 0.05 * (tree.travel.high - tree.travel.low)
    if edge < 0.0:
        return round_to(max(tree.travel.low - room, tree.encoder.low))
    return round_to(min(tree.travel.high + room, tree.encoder.high))


RULES: tuple[tuple[str, Callable[[Any], Any]], ...] = (
    ("timing.steps", lambda t: float(max(math.ceil(t.timing.period / FINEST), 1))),
    (
        "arrival.tolerance",
        lambda t: round_to(max(6.0 * t.encoder.noise, 4.0 * t.encoder.pitch, 1e-4 * t.travel.high)),
    ),
    ("motion.velocity", lambda t: round_to(SPARE * fastest(t))),
    ("motion.acceleration", _acceleration),
    ("motion.jerk", lambda t: round_to(t.motion.acceleration * omega(t) / (4.0 * math.pi))),
    ("controller.gain", lambda t: t.amplifier.gain),
    ("controller.low", lambda t: round_to(t.amplifier.low / t.amplifier.gain, 12)),
    ("controller.high", lambda t: round_to(t.amplifier.high / t.amplifier.gain, 12)),
    ("controller.integral", lambda t: round_to(SHARE * omega(t))),
    ("controller.drift", lambda t: round_to(DRIFT * t.controller.integral)),
    ("controller.ahead_velocity", lambda t: round_to(lag(t))),
    ("controller.ahead_acceleration", lambda t: round_to(omega(t) ** -2 + 0.5 * lag(t) ** 2)),
    ("controller.notch.frequency", lambda t: round_to(omega(t) / (2.0 * math.pi))),
    ("controller.loop_thresholds", lambda t: tuple(round_to(r, 9) for r in loop(t).thresholds)),
    ("controller.loop_weights", lambda t: tuple(round_to(w, 6) for w in loop(t).weights)),
    ("guard.effort", lambda t: max(t.controller.high, -t.controller.low)),
    ("guard.push", lambda t: t.guard.effort),  # a stage at the end of its range does not move
    ("guard.low", lambda t: _soft_limit(t, -1.0)),
    ("guard.high", lambda t: _soft_limit(t, 1.0)),
    ("guard.speed", lambda t: round_to(2.0 * fastest(t))),
    ("guard.error", lambda t: round_to(0.1 * (t.travel.high - t.travel.low))),
    ("guard.still", lambda t: round_to(2.0 * t.encoder.pitch + 8.0 * t.encoder.noise)),
    ("guard.leap", lambda t: t.guard.speed),
    ("guard.repeats", lambda t: round_to(repeats(t.encoder, t.timing.period))),
)  # fmt: skip


def problems(tree: Any) -> list[Problem]:
    every = (*_way(tree), *_sensor(tree), *_loop(tree))
    return [(path, value, words) for wrong, path, value, words in every if wrong]


def _way(tree: Any) -> Iterator[Checked]:
    """Travel within the voltages' reach, speed within the current."""
    travel, guard = tree.travel, tree.guard
    low, high = reach(tree)
    yield travel.low > 0.0, "travel.low", travel.low, "at most 0 mm, where every run begins"
    yield (
        travel.low < low,
        "travel.low",
        travel.low,
        f"{low * 1e6:.4g} um or more, which {{amplifier.low}} reach after {{amplifier.high}}",
    )
    yield (
        not 0.0 < travel.high <= high,
        "travel.high",
        travel.high,
        f"above 0 mm and at most {high * 1e6:.4g} um, which {{amplifier.high}} reach from rest "
        "with {stack.stroke} over {stack.span}",
    )
    yield travel.low < guard.low, "travel.low", travel.low, "{guard.low} or more, the soft limit"
    yield travel.high > guard.high, "travel.high", travel.high, "at most {guard.high}"
    most = fastest(tree)
    yield (
        tree.motion.velocity > most,
        "motion.velocity",
        tree.motion.velocity,
        f"at most {most * 1e3:.4g} mm/s: {{amplifier.current}} charge {{amplifier.capacitance}} no "
        "faster",
    )
    yield (
        tree.controller.gain != tree.amplifier.gain,
        "controller.gain",
        tree.controller.gain,
        "{amplifier.gain}, which the amplifier has",
    )


def _sensor(tree: Any) -> Iterator[Checked]:
    """A sensor of sufficient range and resolution."""
    encoder, tolerance = tree.encoder, tree.arrival.tolerance
    yield (
        tree.guard.low < encoder.low,
        "guard.low",
        tree.guard.low,
        "{encoder.low} or more, the end of what the sensor shows",
    )
    yield (
        tree.guard.high > encoder.high,
        "guard.high",
        tree.guard.high,
        "at most {encoder.high}, the end of what the sensor shows",
    )
    yield (
        tolerance < 3.0 * encoder.noise,
        "arrival.tolerance",
        tolerance,
        f"{3e9 * encoder.noise:.4g} nm or more, three times {{encoder.noise}}: no arrival is seen "
        "below the sensor's noise",
    )
    yield (
        tolerance < encoder.pitch,
        "arrival.tolerance",
        tolerance,
        "{encoder.pitch} or more, one step of the sensor",
    )


def _loop(tree: Any) -> Iterator[Checked]:
    """A loop slower than the resonance and the period."""
    timing, resonance = tree.timing, omega(tree)
    hertz = resonance / (2.0 * math.pi)
    yield (
        timing.period > 0.1 / hertz,
        "timing.period",
        timing.period,
        f"at most {100.0 / hertz:.4g} ms, a tenth of a period of the resonance, {hertz:.4g} Hz "
        "with {guide.load}",
    )
    yield (
        timing.delay > timing.period,
        "timing.delay",
        timing.delay,
        "at most {timing.period}: an effort acts within the period that it was computed in",
    )
    yield (
        tree.controller.integral > MOST * resonance,
        "controller.integral",
        tree.controller.integral,
        f"at most {MOST * resonance:.4g} 1/s, a bandwidth of {MOST * hertz:.3g} Hz with a "
        f"resonance at {hertz:.4g} Hz",
    )
    yield (
        tree.controller.proportional > MOST,
        "controller.proportional",
        tree.controller.proportional,
        f"at most {MOST:g}: the resonance would swing up",
    )
    for name in ("silent", "stuck", "window"):
        value = getattr(tree.guard, name)
        yield (
            value < timing.period,
            f"guard.{name}",
            value,
            "{timing.period} or more: the guard looks once a period",
        )
