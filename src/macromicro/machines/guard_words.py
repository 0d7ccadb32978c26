"""Faults of the single-stage guard in words."""

from __future__ import annotations

from typing import NamedTuple

OK, ILLEGAL, SILENT, LOW, HIGH, FAST, LOST, STUCK = range(8)
LIMIT_LOW, LIMIT_HIGH, LIMITS, DRIVE, NOT_ENABLED = range(8, 13)
JUMP, FROZEN, AGAINST, HOT, CLOCK = range(13, 18)
OTHER_AXIS = 100  # the guard of another axis of the machine has found a fault
KEEPS_PLACE = (OK, ILLEGAL, DRIVE, NOT_ENABLED, HOT, OTHER_AXIS)  # else the position is in doubt


class Text(NamedTuple):
    """A fault in words; `evidence` formats {value} and {limit}, positions in {unit}."""

    name: str
    message: str
    evidence: str
    remedy: str
    placed: bool = False


TEXTS = {
    ILLEGAL: Text(
        "illegal effort",
        "The law commanded an effort that is out of range or not a number.",
        "commanded {value:.4g} V, allowed {limit:.4g} V",
        "Check the law and its gains; guard.effort sets the limit.",
    ),
    SILENT: Text(
        "encoder silent",
        "The encoder gives no new values.",
        "nothing new for {value:.4f} s, allowed {limit:.4f} s",
        "Check the encoder's plug and its counter; guard.silent sets the limit.",
    ),
    LOW: Text(
        "below the soft limit",
        "The stage is below its lower soft limit.",
        "position {value:.4f} {unit}, allowed {limit:.4f} {unit} or more",
        "Bring it back by hand and check target and zero; guard.low sets the limit.",
        True,
    ),
    HIGH: Text(
        "above the soft limit",
        "The stage is above its upper soft limit.",
        "position {value:.4f} {unit}, allowed at most {limit:.4f} {unit}",
        "Bring it back by hand and check target and zero; guard.high sets the limit.",
        True,
    ),
    FAST: Text(
        "overspeed",
        "The stage is faster than allowed.",
        "{value:.4g} {unit}/s, allowed {limit:.4g} {unit}/s",
        "Check gains, direction of encoder and motor; guard.speed sets the limit, and off a "
        "tripped limit switch twice switches.leave.",
        True,
    ),
    LOST: Text(
        "following error",
        "The stage does not follow its set point.",
        "following error {value:.4g} {unit}, allowed {limit:.4g} {unit}",
        "Check that it is free and its encoder and motor are connected, then gains and motion "
        "limits; guard.error sets the limit.",
        True,
    ),
    STUCK: Text(
        "stuck",
        "The motor pushes and the stage does not move.",
        "{value:.3g} V without a new position for more than {limit:.3g} s",
        "Free the stage, check motor supply and encoder; guard.push and guard.stuck set the "
        "limits, and guard.lean and guard.leant those of a smaller effort.",
    ),
    LIMIT_LOW: Text(
        "lower limit switch",
        "The stage has run into its lower limit switch.",
        "it tripped with the encoder at {value:.4f} {unit}",
        "Clear the fault, enable and jog or move up: the stage leaves the switch slowly. Then find "
        "out why it went there: wrong home, sign of the encoder, a cut wire of the switch.",
        True,
    ),
    LIMIT_HIGH: Text(
        "upper limit switch",
        "The stage has run into its upper limit switch.",
        "it tripped with the encoder at {value:.4f} {unit}",
        "Clear the fault, enable and jog or move down: the stage leaves the switch slowly. Then "
        "find out why it went there: wrong home, sign of the encoder, a cut wire of the switch.",
        True,
    ),
    LIMITS: Text(
        "both limit switches",
        "Both limit switches are tripped at once.",
        "the encoder is at {value:.4f} {unit}",
        "Check the supply and the wires of the switches: a cut wire trips a switch.",
        True,
    ),
    DRIVE: Text(
        "drive fault",
        "The drive reports a fault.",
        "its fault output is on",
        "Check the drive's own display: overcurrent, overheating, supply. Let motor and drive cool "
        "and free the stage, then clear the fault and enable.",
    ),
    NOT_ENABLED: Text(
        "drive not enabled",
        "The drive is off although its enable line is on.",
        "off {value:.4f} s after it was switched on, allowed {limit:.4f} s",
        "Check the enable wire, the drive's supply and its safe-torque-off inputs; "
        "amplifier.enable_time sets the limit.",
    ),
    JUMP: Text(
        "position jump",
        "The position reading jumped farther than the stage can move.",
        "by {value:.4g} {unit} between two readings; it is never faster than {limit:.4g} {unit}/s",
        "Check the encoder's cable, shield and supply, then clear the fault and home; guard.leap "
        "and guard.surge set the limits.",
        True,
    ),
    FROZEN: Text(
        "position frozen",
        "The position sensor repeats one value, which its noise makes impossible.",
        "the same value for {value:.4f} s, allowed {limit:.4f} s",
        "Check the sensor and its converter; guard.repeats sets the limit, and encoder.noise says "
        "how noisy the sensor is.",
    ),
    AGAINST: Text(
        "motion against the motor",
        "The stage moves against the push of its motor.",
        "{value:.4g} {unit} against the effort, allowed {limit:.4g} {unit}",
        "Check the polarity of motor and encoder, and that nothing else drives the stage; "
        "guard.against and guard.lean set the limits.",
        True,
    ),
    CLOCK: Text(
        "clock wrong",
        "The rig's clock has jumped or stopped.",
        "a step of {value:.3f} s between two periods, allowed above 0 and at most {limit:.3f} s",
        "Check the source of the samples' time, and what delayed the loop (`macromicro doctor`); "
        "guard.clock sets the limit.",
    ),
    HOT: Text(
        "heated too long",
        "The mean effort overheats the actuator.",
        "{value:.3g} V on average, allowed {limit:.3g} V",
        "Let it cool. Check that the stage is free, its sensor works and the target is within its "
        "stroke; guard.heat and guard.heating set the limits.",
    ),
}
