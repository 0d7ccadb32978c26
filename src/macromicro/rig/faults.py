"""The guard's faults in words: event, evidence, remedy."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from macromicro.recording_format import Attribute
from macromicro.rig import codes
from macromicro.rig.guard import Watch

SWITCHED_OFF = "all outputs were set to off (written to the rig, not read back)"


class Fault(NamedTuple):
    code: int  # one of `codes`
    name: str
    time_s: float  # when, in the run's time, s
    message: str
    evidence: str  # what was measured, and its limit
    remedy: str

    @property
    def text(self) -> str:
        """All of it in one line."""
        return f"{self.message} {self.evidence}. {self.remedy}"


class Said(Protocol):
    """A fault in words."""

    @property
    def message(self) -> str: ...

    @property
    def evidence(self) -> str: ...


def ended(finished: bool, fault: Said | None) -> dict[str, Attribute]:
    """The end of a run for its recording."""
    words = {} if fault is None else {"fault": f"{fault.message} {fault.evidence}"}
    return {"finished": int(finished), **words}


class Text(NamedTuple):
    """A fault in words; evidence formats {value} and {limit} of `Watch`, times `scale`."""

    name: str
    message: str
    evidence: str
    remedy: str
    scale: float = 1.0

    def seen(self, value: float, limit: float) -> str:
        """The evidence of these."""
        return self.evidence.format(value=self.scale * value, limit=self.scale * limit)


TEXTS = {
    codes.ILLEGAL: Text(
        "illegal output",
        "The controller commanded an output that is out of range or not a number.",
        "commanded {value:.4g} V, allowed {limit:.4g} V "
        "(or a fan or laser reset other than 0 or 1)",
        "Check the controller's gains and its law; guard.motor and guard.ctrl set the limits.",
    ),
    codes.MACRO_LOST: Text(
        "macro following error",
        "The carriage does not follow its set point.",
        "following error {value:.0f} counts, allowed {limit:.0f} counts",
        "Check that the carriage is free and the encoder plugged in, then the macro gains; "
        "guard.macro_rate and guard.macro_tolerance set what is allowed.",
    ),
    codes.MICRO_LOST: Text(
        "micro following error",
        "The micro-stage does not follow its set point.",
        "following error {value:.3f} mm, allowed {limit:.3f} mm",
        "Let the actuator cool or use the fan, check its supply, the Hall sensor and the micro "
        "gains; "
        "guard.micro_rate and guard.micro_tolerance set what is allowed.",
        scale=1e3,
    ),
    codes.ENCODER_SILENT: Text(
        "encoder silent",
        "The encoder gives no new values.",
        "nothing new for {value:.3f} s, allowed {limit:.3f} s",
        "Check the encoder's plug and its counter board; guard.silent sets the limit.",
    ),
    codes.HALL_SILENT: Text(
        "Hall sensor silent",
        "The Hall sensor gives no new values.",
        "nothing new for {value:.3f} s, allowed {limit:.3f} s",
        "Check the sensor's plug and the A/D board; guard.silent sets the limit.",
    ),
    codes.HALL_FROZEN: Text(
        "Hall sensor frozen",
        "The Hall sensor repeats one value, which its noise makes impossible.",
        "the same code for {value:.3f} s, allowed {limit:.3f} s",
        "Check the sensor's supply and the A/D board; if the noise is really so low, raise "
        "guard.frozen.",
    ),
    codes.HALL_RANGE: Text(
        "Hall sensor off the scale",
        "The Hall sensor reads the end of its scale.",
        "{value:.3f} V, accepted {limit:.3f} V or more away from 0 V and guard.hall_supply",
        "Check the magnets' place and the sensor's wiring; guard.rail and guard.rail_time set "
        "the limits.",
    ),
    codes.STUCK: Text(
        "carriage stuck",
        "The motor pushes and the carriage does not move.",
        "{value:.2f} V without a single count for {limit:.3f} s",
        "Free the carriage, check motor supply and encoder, then home; guard.push with "
        "guard.stuck, and guard.lean with guard.leant, set the limits.",
    ),
    codes.TOO_HOT: Text(
        "actuator too hot",
        "The temperature estimated from CTRL is too high.",
        "estimated {value:.0f} degC, allowed {limit:.0f} degC",
        "Let the actuator cool, lower the duty or use the fan; guard.hottest sets the limit.",
    ),
    codes.NO_MOTION: Text(
        "heating without motion",
        "The actuator is heated and does not contract.",
        "estimated {value:.0f} degC for {limit:.2f} s without motion",
        "Check that the actuator is connected and not jammed, and the Hall sensor; guard.warm "
        "and guard.idle set the limits.",
    ),
    codes.ENCODER_JUMP: Text(
        "encoder jumped",
        "The encoder's count jumped farther than the carriage can move.",
        "{value:.0f} counts at once, possible {limit:.0f} counts",
        "Check the encoder's cable and shield and its counter board, then home; guard.fastest "
        "sets the limit.",
    ),
    codes.ENCODER_AGAINST: Text(
        "encoder against the motor",
        "The encoder counts against the motor's push and keeps doing so.",
        "{value:.0f} counts against it, allowed {limit:.0f} counts",
        "Check that the encoder's channels or the motor's wires are not swapped, then "
        "home; guard.lean and guard.against set the limits.",
    ),
    codes.HALL_NOISY: Text(
        "Hall sensor noisy",
        "The Hall sensor's reading is too noisy to be a position.",
        "{value:.3g} mV rms, allowed {limit:.3g} mV",
        "Check the sensor's cable, shield and supply; guard.noise and guard.noise_time set the "
        "limit.",
    ),
    codes.CLOCK: Text(
        "clock jumped",
        "The rig's clock has jumped.",
        "it stepped by {value:.3f} s in one period, allowed 0 to {limit:.3f} s",
        "Check what sets the rig's clock, and what delayed the loop (`macromicro doctor`); "
        "guard.clock sets the limit.",
    ),
    codes.CLOCK_STANDS: Text(
        "clock stopped",
        "The rig's clock has stopped or returned an invalid time.",
        "no later time for {value:.3f} s, allowed {limit:.3f} s",
        "Check the source of the samples' time `t`; guard.clock sets the limit.",
    ),
}


def describe(watch: Watch) -> Fault | None:
    if watch.fault == codes.OK:
        return None
    text = TEXTS[watch.fault]
    return Fault(
        watch.fault,
        text.name,
        round(watch.time, 9),
        text.message,
        f"{text.seen(watch.value, watch.limit)}, at {watch.time:.3f} s; {SWITCHED_OFF}",
        text.remedy,
    )
