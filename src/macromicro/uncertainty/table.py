"""The table of what is not known exactly about a machine, each quantity with one range.

Within its range each is taken as uniformly distributed and independent of the others:
nothing but the range is known of it. `robust` draws all of them; `tune --robust` those of the
stage that it tunes, on the bench or on the model that was identified from it.

None of the ranges was measured on the thesis' machine. That the stroke, the transformation
temperatures and the hysteresis of NiTi actuators change as they are cycled is established
(functional fatigue: J. Frenzel, "On the Importance of Structural and Functional Fatigue in
Shape Memory Technology", Shape Memory and Superelasticity 6 (2020) 213-222); how much depends
on alloy, treatment, load and strain. The bench's own sources are in docs/bench.md.
"""

from __future__ import annotations

from typing import NamedTuple

FACTOR, SHIFT, VALUE = "factor", "shift", "value"
MACRO, MICRO = "macro", "micro"
# What the macro-stage's model (4.2)-(4.5) has of it: gain and pole of (4.2), the dead zone.
GAIN, POLE, WIDTH = "gain", "pole", "width"

_WORN = "assumption; that it changes with cycling: Frenzel (2020)"
_ASSUMED = "assumption"
_FRICTION = "assumption: wear, dust and grease, 30 % both ways"
_FREQUENCY = (
    "assumption: the thesis prints none; 20 % is 40 % of the belt's stiffness, which changes "
    "with tension and with the carriage's place"
)
_SHARE = 'assumption: it follows from an amplitude of "about 20 um" (Section 6.2) alone'
_LAGS = "assumption: the thesis prints none"
# The model's powers are the logarithmic derivatives of (4.2) at the default bench: of the pole's
# numerator so much is back-EMF, the rest viscous friction. Of the breakaway that makes the dead
# zone (M1), kinetic friction with its ripple and the drop have these shares.
_BACK_EMF = 0.73
_KINETIC, _DROP = 0.85, 0.15
# 0.35 of a shift of the heating thresholds reaches the cooling ones through the default
# `bench.phase.cool_slope`; the rest makes it a shift of the whole loop.
_LOOP = (
    ("bench.phase.heat_start", 1.0),
    ("bench.phase.heat_end", 1.0),
    ("bench.phase.cool_offset", 0.65),
    ("bench.phase.cool_end", 1.0),
)


class Uncertain(NamedTuple):
    """One quantity that is uncertain, from `low` to `high`.

    Attributes
    ----------
    name : str
        One word, unique in the table.
    stage : {"macro", "micro"}
        The stage that it belongs to.
    parts : tuple of (str, float)
        Dotted paths within the settings, each with its weight.
    kind : {"factor", "shift", "value"}
        An amount multiplies what the settings say at every path, is added to it, times the
        part's weight, or takes its place.
    low, high : float
        The range, in `unit`.
    unit : str
        Of `low` and `high`; "" for a factor.
    meaning, source : str
        For a person.
    model : tuple of (str, float)
        What of the macro-stage's model goes with it: `GAIN`, `POLE` or `WIDTH`, each
        multiplied by the amount to the power that is given. Empty for what the model has not.
    """

    name: str
    stage: str
    parts: tuple[tuple[str, float], ...]
    kind: str
    low: float
    high: float
    unit: str
    meaning: str
    source: str
    model: tuple[tuple[str, float], ...] = ()


def _factor(
    name: str,
    stage: str,
    ends: tuple[float, float],
    words: tuple[str, str],
    *paths: str,
    model: tuple[tuple[str, float], ...] = (),
) -> Uncertain:
    """A factor on the parameters at `paths`; `words`: meaning and source."""
    parts = tuple((path, 1.0) for path in paths)
    return Uncertain(name, stage, parts, FACTOR, *ends, "", *words, model)


UNCERTAIN: tuple[Uncertain, ...] = (
    _factor(
        "coulomb",
        MACRO,
        (0.7, 1.3),
        ("kinetic friction, and its change along the rod", _FRICTION),
        "bench.friction.coulomb",
        "bench.friction.ripple",
        model=((WIDTH, _KINETIC),),
    ),
    _factor(
        "stribeck",
        MACRO,
        (0.7, 1.3),
        ("breakaway above it", _FRICTION),
        "bench.friction.stribeck",
        model=((WIDTH, _DROP),),
    ),
    _factor(
        "viscous",
        MACRO,
        (0.7, 1.3),
        ("viscous friction", _FRICTION),
        "bench.friction.viscous",
        model=((POLE, 1.0 - _BACK_EMF),),
    ),
    _factor(
        "motor_constant",
        MACRO,
        (0.9, 1.1),
        ("motor's torque and back-EMF constant", "assumption: magnets and windings of one type"),
        "bench.motor.constant",
        model=((GAIN, 1.0), (POLE, 2.0 * _BACK_EMF), (WIDTH, -1.0)),
    ),
    _factor(
        "mass",
        MACRO,
        (0.8, 1.2),
        ("moving mass: what the carriage bears", _ASSUMED),
        "bench.carriage.mass",
        model=((GAIN, -1.0), (POLE, -1.0)),
    ),
    _factor(
        "belt_frequency",
        MACRO,
        (0.8, 1.2),
        ("belt's frequency", _FREQUENCY),
        "bench.belt.frequency",
    ),
    _factor("belt_decay", MACRO, (0.7, 1.3), ("belt damping", _ASSUMED), "bench.belt.decay"),
    _factor(
        "belt_share",
        MACRO,
        (0.5, 2.0),
        ("rocking of the stage", _SHARE),
        "bench.belt.participation",
    ),
    Uncertain(
        "ambient",
        MICRO,
        (("bench.thermal.ambient", 1.0),),
        VALUE,
        15.0,
        35.0,
        "degC",
        "room temperature",
        "assumption: 10 K both ways of the 25 degC of Section 5.2.2",
    ),
    _factor(
        "hall_noise", MICRO, (0.5, 2.0), ("Hall sensor's noise", _ASSUMED), "sensors.hall.noise"
    ),
    _factor("hall_lag", MICRO, (0.5, 2.0), ("Hall sensor's lag", _LAGS), "sensors.hall.lag"),
    _factor(
        "laser_noise",
        MICRO,
        (0.5, 2.0),
        ("laser's noise, fast and slow", _ASSUMED),
        "sensors.laser.noise",
        "sensors.laser.drift",
    ),
    # A stop or end switch beyond the stroke left would be a machine that never was; both stay
    # where they are as a share of it.
    _factor(
        "stroke",
        MICRO,
        (0.95, 1.0),
        ("stroke left by ageing", _WORN),
        "bench.wire.stroke",
        "bench.wire.stop",
        "bench.driver.contract_on",
        "bench.driver.contract_off",
    ),
    Uncertain(
        "loop_shift",
        MICRO,
        _LOOP,
        SHIFT,
        -10.0,
        5.0,
        "K",
        "shift of all transformation temperatures by ageing",
        _WORN,
    ),
    _factor(
        "latent", MICRO, (0.85, 1.0), ("latent heat left by ageing", _ASSUMED), "bench.wire.latent"
    ),
    _factor(
        "wire_heat_path",
        MICRO,
        (0.8, 1.2),
        ("heat resistance, wires to plates, as contacts age", _ASSUMED),
        "bench.thermal.wire_resistance",
    ),
    _factor(
        "body_heat_path",
        MICRO,
        (0.85, 1.15),
        ("heat resistance, body to air: mounting, dust", _ASSUMED),
        "bench.thermal.body_resistance",
    ),
    _factor("preload", MICRO, (0.8, 1.2), ("bias spring's pull", _ASSUMED), "bench.bias.preload"),
    _factor(
        "supply",
        MICRO,
        (0.95, 1.05),
        (
            "driver's supply; its square is the heat, which falls as the wires' resistance rises",
            _ASSUMED,
        ),
        "bench.driver.supply",
    ),
    _factor("driver_lag", MICRO, (0.5, 2.0), ("driver's lag", _LAGS), "bench.driver.lag"),
)


def of_stage(stage: str) -> tuple[Uncertain, ...]:
    """Give the rows of the table that belong to a stage.

    Parameters
    ----------
    stage : {"macro", "micro"}
        Which one.

    Returns
    -------
    tuple of Uncertain
        In the table's order.
    """
    return tuple(each for each in UNCERTAIN if each.stage == stage)
