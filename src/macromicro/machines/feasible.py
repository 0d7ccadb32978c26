"""What an axis cannot do: rules over its settings, as in `macromicro.rules`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from macromicro import place as places
from macromicro.machines import _feasible_lines, _stability, sheets
from macromicro.machines.tree import Checked, Problem

PERIODS = 2.0  # of the loop in a mechanical time constant, at least


def problems(tree: Any) -> list[Problem]:
    every = (
        *_way(tree),
        *_force(tree),
        *_encoder(tree),
        *_loop(tree),
        *_feasible_lines.check_lines(tree),
    )
    found = [(path, value, words) for wrong, path, value, words in every if wrong]
    return found or _stability.problems(tree, _stability.axis)


def _way(tree: Any) -> Iterator[Checked]:
    """Targets within soft limits within stops."""
    travel, guard, (low, high) = tree.travel, tree.guard, sheets.ends(tree)
    begin = f"{places.of(tree).told(0.0)}, where every run begins"
    yield travel.low > 0.0, "travel.low", travel.low, f"at most {begin}"
    yield travel.high <= 0.0, "travel.high", travel.high, f"above {begin}"
    for wrong, name, stop in (
        (travel.low < low, "low", "{load.stop_low} or more"),
        (travel.high > high, "high", "at most {load.stop_high}"),
    ):
        yield wrong, f"travel.{name}", getattr(travel, name), f"{stop}: the end stop"
    yield (
        guard.low < low,
        "guard.low",
        guard.low,
        "{load.stop_low} or more: the end stop",
    )
    yield (
        guard.high > high,
        "guard.high",
        guard.high,
        "at most {load.stop_high}, the end stop",
    )
    yield travel.low < guard.low, "travel.low", travel.low, "{guard.low} or more, the soft limit"
    yield travel.high > guard.high, "travel.high", travel.high, "at most {guard.high}"


def _force(tree: Any) -> Iterator[Checked]:
    """A motor that can move its load."""
    most, held, place = sheets.force(tree), sheets.breakaway_force(tree), places.of(tree)
    newton = place.named("N")
    yield (
        held >= sheets.SPARE * most,
        "friction.coulomb",
        tree.friction.coulomb,
        f"friction and weight below {sheets.SPARE * most:.4g} {newton}, {sheets.SPARE:.0%} of the "
        f"motor's capacity at {sheets.current(tree):.3g} A; this axis takes {held:.4g} {newton} to "
        "start",
    )
    needed = sheets.mass(tree) * tree.motion.acceleration + held
    yield (
        needed > most * (1.0 + 1e-9),
        "motion.acceleration",
        tree.motion.acceleration,
        f"at most {place.told(max(most - held, 0.0) / sheets.mass(tree), 'm/s^2', 4)}, what "
        f"{most:.4g} {newton} are left for behind friction and weight of {held:.4g} {newton} with "
        f"{sheets.mass(tree):.4g} {place.named('kg')}",
    )
    volts = sheets.fastest(tree) / sheets.SPARE
    fastest = place.told(volts, "m/s", 4)
    yield (
        tree.motion.velocity > volts,
        "motion.velocity",
        tree.motion.velocity,
        f"at most {fastest}, which {{amplifier.supply}} drive the motor to under friction",
    )
    yield (
        tree.guard.effort > tree.amplifier.full_scale,
        "guard.effort",
        tree.guard.effort,
        "at most {amplifier.full_scale}, all that the D/A gives",
    )
    yield (
        tree.controller.limit > tree.guard.effort,
        "controller.limit",
        tree.controller.limit,
        "at most {guard.effort}, or the guard stops the first effort beyond it",
    )


def _encoder(tree: Any) -> Iterator[Checked]:
    """Counts fine enough, and not too fast."""
    encoder = tree.encoder
    yield (
        encoder.pitch > tree.arrival.tolerance,
        "arrival.tolerance",
        tree.arrival.tolerance,
        "{encoder.pitch} or more, one count; a finer encoder allows less",
    )
    counts = tree.motion.velocity / encoder.pitch
    yield (
        counts > encoder.rate,
        "motion.velocity",
        tree.motion.velocity,
        f"at most {places.of(tree).told(encoder.rate * encoder.pitch, 'm/s', 4)}: it makes "
        f"{counts:.4g} counts/s of "
        "{encoder.rate}; a faster counter or coarser counts allow more",
    )
    low, high = sheets.ends(tree)
    longest = max(high, -low) / encoder.pitch
    yield (
        longest >= 2.0 ** (encoder.bits - 1.0),
        "encoder.bits",
        encoder.bits,
        f"a counter that holds the {longest:.0f} counts to the end of its way without wrapping",
    )


def _loop(tree: Any) -> Iterator[Checked]:
    """A period short enough for the loop."""
    timing, drive = tree.timing, tree.drive
    yield (
        timing.delay > timing.period,
        "timing.delay",
        timing.delay,
        "at most {timing.period}: an effort acts within the period that it was computed in",
    )
    yield (
        drive.backlash > 0.0 and drive.frequency == 0.0,
        "drive.backlash",
        drive.backlash,
        f"{places.of(tree).told(0.0)}, or a drive.frequency above 0 Hz: backlash needs a "
        "compliant drive",
    )
    if drive.frequency > 0.0:
        slowest = 0.1 / drive.frequency
        yield (
            timing.period > slowest,
            "timing.period",
            timing.period,
            f"at most {1e3 * slowest:.4g} ms, a tenth of a period of {{drive.frequency}}",
        )
        yield (
            sheets.turning(tree) <= 0.0,
            "drive.frequency",
            drive.frequency,
            "0 Hz, or a motor with inertia: a mode needs a mass at either end",
        )
    rate = bandwidth_set(tree)
    allowed = 1.0 / sheets.lag(tree)
    yield (
        rate > allowed,
        "controller.velocity",
        tree.controller.velocity,
        f"a velocity loop of at most {allowed:.4g} rad/s, which a delay of "
        f"{1e3 * sheets.lag(tree):.3g} ms allows (timing.period, timing.delay and the motor's "
        f"current); this gain makes it {rate:.4g} rad/s",
    )
    mechanical = mechanical_pole(tree)
    yield (
        timing.period * PERIODS > 1.0 / mechanical,
        "timing.period",
        timing.period,
        f"at most {1e3 / PERIODS / mechanical:.4g} ms, half the mechanical time constant of this "
        "axis",
    )
    for name in ("silent", "stuck", "leant", "window", "clock"):
        value = getattr(tree.guard, name)
        yield (
            value < timing.period,
            f"guard.{name}",
            value,
            "{timing.period} or more: the guard looks once a period",
        )


def bandwidth_set(tree: Any) -> float:
    return float(tree.controller.velocity / (sheets.per_newton(tree) * sheets.mass(tree)))


def mechanical_pole(tree: Any) -> float:
    """Pole of the axis between effort and speed."""
    drag = tree.friction.viscous
    if tree.amplifier.mode == "voltage":
        k = sheets.constant(tree)
        drag += k * k * tree.drive.efficiency / tree.motor.resistance
    return float(max(drag, 1e-12) / sheets.mass(tree))
