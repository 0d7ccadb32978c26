"""The guard's faults in words: what happened, on what evidence, what to do."""

from __future__ import annotations

from typing import NamedTuple

from macromicro.rig import codes
from macromicro.rig.guard import Watch

SWITCHED_OFF = "all outputs were set to off (written to the rig, not read back)"


class Fault(NamedTuple):
    """A tripped guard, in words.

    Attributes
    ----------
    code : int
        One of `codes`.
    name : str
        Short.
    time_s : float
        When, in the run's time, s.
    message : str
        What happened.
    evidence : str
        What was measured, and its limit.
    remedy : str
        What to do.
    """

    code: int
    name: str
    time_s: float
    message: str
    evidence: str
    remedy: str


class _Text(NamedTuple):
    """Evidence may hold {value} and {limit} of the guard's `Watch`, times `scale`."""

    name: str
    message: str
    evidence: str
    remedy: str
    scale: float = 1.0


TEXTS = {
    codes.ILLEGAL: _Text(
        "illegal output",
        "The controller asked for an output that is not a number or out of range.",
        "it asked for {value:.4g} V where at most {limit:.4g} V are allowed "
        "(or for a fan or laser reset other than 0 or 1)",
        "Check the controller's gains and its law; guard.motor and guard.ctrl set the limits.",
    ),
    codes.MACRO_LOST: _Text(
        "macro following error",
        "The carriage does not follow its set point.",
        "following error {value:.0f} counts, allowed {limit:.0f} counts",
        "Check that the carriage is free and the encoder plugged in, then the macro gains; "
        "guard.macro_rate and guard.macro_tolerance set what is allowed.",
    ),
    codes.MICRO_LOST: _Text(
        "micro following error",
        "The micro-stage does not follow its set point.",
        "following error {value:.3f} mm, allowed {limit:.3f} mm",
        "Let the actuator cool or use the fan, check its supply, the Hall sensor and the micro "
        "gains; "
        "guard.micro_rate and guard.micro_tolerance set what is allowed.",
        scale=1e3,
    ),
    codes.ENCODER_SILENT: _Text(
        "encoder silent",
        "The encoder gives no new values.",
        "nothing new for {value:.3f} s, allowed {limit:.3f} s",
        "Check the encoder's plug and its counter board; guard.silent sets the limit.",
    ),
    codes.HALL_SILENT: _Text(
        "Hall sensor silent",
        "The Hall sensor gives no new values.",
        "nothing new for {value:.3f} s, allowed {limit:.3f} s",
        "Check the sensor's plug and the A/D board; guard.silent sets the limit.",
    ),
    codes.HALL_FROZEN: _Text(
        "Hall sensor frozen",
        "The Hall sensor repeats one and the same value, which its noise makes impossible.",
        "the same code for {value:.3f} s, allowed {limit:.3f} s",
        "Check the sensor's supply and the A/D board; where so little noise is right, raise "
        "guard.frozen.",
    ),
    codes.HALL_RANGE: _Text(
        "Hall sensor off the scale",
        "The Hall sensor reads the end of its scale.",
        "{value:.3f} V, accepted {limit:.3f} V or more away from 0 V and 5 V",
        "Check the magnets' place and the sensor's wiring; guard.rail and guard.rail_time set "
        "the limits.",
    ),
    codes.STUCK: _Text(
        "carriage stuck",
        "The motor pushes and the carriage does not move.",
        "{value:.2f} V without a single count for {limit:.3f} s",
        "Free the carriage, check motor supply and encoder, then home; guard.push with "
        "guard.stuck, and guard.lean with guard.leant, set the limits.",
    ),
    codes.TOO_HOT: _Text(
        "actuator too hot",
        "The temperature estimated from CTRL is too high.",
        "estimated {value:.0f} degC, allowed {limit:.0f} degC",
        "Let the actuator cool, lower the duty or use the fan; guard.hottest sets the limit.",
    ),
    codes.NO_MOTION: _Text(
        "heating without motion",
        "The actuator is heated and does not contract.",
        "estimated {value:.0f} degC for {limit:.2f} s without motion",
        "Check that the actuator is connected and not jammed, and the Hall sensor; guard.warm "
        "and guard.idle set the limits.",
    ),
    codes.ENCODER_JUMP: _Text(
        "encoder jumped",
        "The encoder's count jumped farther than any carriage can go.",
        "{value:.0f} counts at once, possible {limit:.0f} counts",
        "Check the encoder's cable and shield and its counter board, then home; guard.fastest "
        "sets the limit.",
    ),
    codes.ENCODER_AGAINST: _Text(
        "encoder against the motor",
        "The encoder counts against the motor's push and keeps doing so.",
        "{value:.0f} counts against it, allowed {limit:.0f} counts",
        "See that the encoder's two channels, or the motor's two wires, are not swapped, then "
        "home; guard.lean and guard.against set the limits.",
    ),
    codes.HALL_NOISY: _Text(
        "Hall sensor noisy",
        "The Hall sensor's reading is too noisy to be a position.",
        "{value:.3g} mV rms, allowed {limit:.3g} mV",
        "Check the sensor's cable, shield and supply; guard.noise and guard.noise_time set the "
        "limit.",
    ),
    codes.CLOCK: _Text(
        "clock jumped",
        "The rig's time jumped: what is timed by it cannot be relied on.",
        "it stepped by {value:.3f} s in one period, allowed 0 to {limit:.3f} s",
        "See what sets the rig's clock, or what kept the loop from running so long "
        "(`macromicro doctor`); guard.clock sets the limit.",
    ),
    codes.CLOCK_STANDS: _Text(
        "clock stands",
        "The rig's time stands still, or is no number: nothing can be timed by it.",
        "no later time for {value:.3f} s, allowed {limit:.3f} s",
        "See what gives the samples their time `t`; guard.clock sets the limit.",
    ),
}


def describe(watch: Watch) -> Fault | None:
    """The fault of a guard's state.

    Parameters
    ----------
    watch : Watch
        The state.

    Returns
    -------
    Fault | None
        None if all is well.
    """
    if watch.fault == codes.OK:
        return None
    text = TEXTS[watch.fault]
    evidence = text.evidence.format(value=watch.value * text.scale, limit=watch.limit * text.scale)
    return Fault(
        watch.fault,
        text.name,
        round(watch.time, 9),
        text.message,
        f"{evidence}, at {watch.time:.3f} s; {SWITCHED_OFF}",
        text.remedy,
    )
