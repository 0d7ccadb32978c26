"""Settings of the live positioner."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from macromicro import nominal
from macromicro.control import calibration
from macromicro.control.calibration import Calibration
from macromicro.control.settings import Control
from macromicro.place import ANGLE, LENGTH, Place
from macromicro.schema.par import Par

STAGES = ("macro", "micro")
CHOICE = "machine choice"
M16 = "200 mm = 2800 counts (M16)"
BELOW = 0.2  # V; by how much homing pushes less than `guard.push`


def _machine_par(unit: str, meaning: str, source: str = CHOICE, **rest: Any) -> Par:
    """A parameter chosen for this machine."""
    return Par(unit, meaning, source, **rest)


class SoftLimits(NamedTuple):
    """Soft limits: macro in counts of the homed frame, micro and whole in m."""

    macro_low: Annotated[float, _machine_par("count", "lowest macro position")] = -130.0
    macro_high: Annotated[float, _machine_par("count", "highest macro position")] = 2990.0
    micro_low: Annotated[float, _machine_par("m", "smallest contraction", shown="mm", lo=0.0)] = 0.0
    micro_high: Annotated[float, _machine_par("m", "largest contraction", shown="mm", lo=0.0)] = (
        3.5e-3
    )
    whole_low: Annotated[float, _machine_par("m", "lowest absolute position", shown="mm")] = -8.8e-3
    whole_high: Annotated[float, _machine_par("m", "highest absolute position", shown="mm")] = (
        0.2169
    )


class Fine(NamedTuple):
    """When the micro-stage counts as arrived, and the share of its stroke in use."""

    bias_low: Annotated[
        float,
        _machine_par(
            "m", "contraction below which no absolute move relies on it", shown="mm", lo=0.0
        ),
    ] = 0.3e-3
    bias_high: Annotated[
        float,
        _machine_par(
            "m", "contraction above which no absolute move relies on it", shown="mm", lo=0.0
        ),
    ] = 3.5e-3
    band: Annotated[
        float,
        _machine_par(
            "m", "error of a window's mean that counts as on target", shown="mm", positive=True
        ),
    ] = 10e-6
    window: Annotated[
        float, _machine_par("s", "span that the Hall reading is averaged over", lo=0.0)
    ] = 0.1
    dwell: Annotated[
        float, _machine_par("s", "time on target before arrival is declared", positive=True)
    ] = 0.5
    patience: Annotated[
        float, _machine_par("s", "longest wait for it; the move has then stalled", positive=True)
    ] = 20.0


class Homing(NamedTuple):
    """Homing by touch: there is no home switch."""

    speed: Annotated[
        float,
        _machine_par(
            "count/s", "speed of the touch that counts, and of backing off", positive=True
        ),
    ] = 140.0
    approach: Annotated[
        float,
        _machine_par("count/s", "speed of the search where no stop is expected", positive=True),
    ] = 1000.0
    quick: Annotated[
        float, _machine_par("count/s", "speed of the way to where one is expected", positive=True)
    ] = 2000.0
    near: Annotated[
        float, _machine_par("count", "distance from there at which it becomes slow", lo=1.0)
    ] = 40.0
    fastest: Annotated[
        float,
        _machine_par(
            "count/s",
            "carriage speed above which the motor is off; at least 1.4 of the reference's",
            positive=True,
        ),
    ] = 700.0
    volts: Annotated[
        float,
        _machine_par("V", "largest effort; below the guard's push", positive=True),
    ] = round(nominal.PUSH - BELOW, 9)
    lead: Annotated[
        float,
        _machine_par("count", "farthest that the reference runs ahead of the carriage", lo=10.0),
    ] = 100.0
    stand: Annotated[
        float,
        _machine_par(
            "s",
            "standstill before the full push, and under it, that is taken for the stop",
            positive=True,
        ),
    ] = 0.3
    patience: Annotated[
        float, _machine_par("s", "longest search; homing has then stalled", positive=True)
    ] = 40.0
    back_off: Annotated[
        float, _machine_par("count", "way back from the place pushed against the stop", lo=1.0)
    ] = 145.0
    coordinate: Annotated[float, _machine_par("count", "name of the place backed off to")] = 0.0

    @property
    def leans(self) -> float:
        """Longest time that homing pushes against a stop without a count."""
        return 2.0 * self.stand


class Jogging(NamedTuple):
    macro: Annotated[
        float, _machine_par("m/s", "fastest macro jog", shown="mm/s", positive=True)
    ] = 0.05
    slow: Annotated[
        float, _machine_par("m/s", "fastest macro jog before homing", shown="mm/s", positive=True)
    ] = 0.01
    micro: Annotated[
        float, _machine_par("m/s", "fastest micro jog", shown="mm/s", positive=True)
    ] = 0.5e-3
    micro_lead: Annotated[
        float,
        _machine_par(
            "m", "farthest that a micro jog runs ahead of the stage", shown="mm", positive=True
        ),
    ] = 0.2e-3
    patience: Annotated[
        float,
        _machine_par("s", "longest time that a carriage may be leaned on and stand", positive=True),
    ] = 0.85
    lean: Annotated[
        float,
        _machine_par("V", "effort at which the carriage should move", positive=True),
    ] = nominal.LEAN


class Brake(NamedTuple):
    deceleration: Annotated[
        float, _machine_par("m/s^2", "deceleration of the reference", positive=True)
    ] = 2.0
    fastest: Annotated[
        float,
        _machine_par("count/s", "speed beyond which the encoder is not believed", positive=True),
    ] = 10000.0
    margin: Annotated[
        float, _machine_par("count", "way beyond the reference's that a stop may take", lo=1.0)
    ] = 25.0
    rest: Annotated[
        float, _machine_par("s", "time without a count that is taken for rest", positive=True)
    ] = 0.1
    patience: Annotated[
        float, _machine_par("s", "longest braking; the motor is off from then on", positive=True)
    ] = 1.0


class Edges(NamedTuple):
    """Laser and encoder: position of the edges, detection of lost counts."""

    use: Annotated[
        int, _machine_par("", "1: the laser refines the position and watches the count", lo=0, hi=1)
    ] = 1
    needed: Annotated[
        int,
        _machine_par("", "edges that must have been crossed before the laser is relied on", lo=1),
    ] = 12
    fastest: Annotated[
        float,
        _machine_par(
            "count/s", "speed up to which a crossing shows where its edge is", positive=True
        ),
    ] = 400.0
    factor: Annotated[
        float,
        _machine_par("", "standard errors of the phase within the reported uncertainty", lo=1.0),
    ] = 3.0
    laser: Annotated[
        float, _machine_par("m", "half peak-to-peak of the laser", "I5", shown="um", lo=0.0)
    ] = 2e-6
    hall: Annotated[
        float, _machine_par("m", "accuracy of the Hall calibration", "D6", shown="um", lo=0.0)
    ] = 5e-6
    noise: Annotated[
        float,
        _machine_par("m", "standard error of a slow crossing's path", shown="um", positive=True),
    ] = 5e-6
    rocking: Annotated[
        float,
        _machine_par(
            "m", "the same for two seconds after a fast way", "the belt, I2", shown="um", lo=0.0
        ),
    ] = 12e-6
    bounce: Annotated[
        float,
        _machine_par("m", "the slack wire's on a fast way, unseen by the Hall", shown="um", lo=0.0),
    ] = 120e-6
    lag: Annotated[
        float, _machine_par("s", "lag of the Hall sensor", "S11", shown="ms", lo=0.0)
    ] = 3e-3
    reset: Annotated[
        float, _machine_par("m", "what a reset of the laser adds (rms)", "I5", shown="um", lo=0.0)
    ] = 0.45e-6
    drift: Annotated[
        float, _machine_par("m", "what the laser drifts in a second (rms)", shown="um", lo=0.0)
    ] = 0.05e-6
    scale: Annotated[
        float,
        _machine_par("1", "standard error of `pitch`, as a share of it", positive=True, hi=0.01),
    ] = 2e-4
    lost: Annotated[
        float, _machine_par("count", "disagreement of laser and encoder that is a fault", lo=1.5)
    ] = 2.0
    span: Annotated[
        float, _machine_par("s", "time for which it must have been beyond that", positive=True)
    ] = 0.05
    skew: Annotated[
        float,
        _machine_par(
            "s", "age of the laser's reading; lets more pass at speed", shown="ms", lo=0.0
        ),
    ] = nominal.PERIOD


class Live(NamedTuple):
    """Settings of the live machine beside the control laws."""

    pitch: Annotated[
        float, _machine_par("m", "travel per count", M16, shown="um", positive=True)
    ] = nominal.PITCH
    limits: SoftLimits = SoftLimits()
    fine: Fine = Fine()
    homing: Homing = Homing()
    jogging: Jogging = Jogging()
    brake: Brake = Brake()
    edges: Edges = Edges()
    supersede: Annotated[
        int,
        _machine_par("", "1: a new motion replaces one under way; 0: it is refused", lo=0, hi=1),
    ] = 0
    gains_while_moving: Annotated[
        int, _machine_par("", "1: gains may change during a motion; 0: refused", lo=0, hi=1)
    ] = 0
    turns: int = 0  # 1: of a stage that turns, rad for m; its settings say so, no file

    @property
    def place(self) -> Place:
        return ANGLE if self.turns else LENGTH

    def problems(self) -> list[tuple[str, Any, str]]:
        q, fine = self.limits, self.fine
        rules = (
            (q.macro_low >= q.macro_high, "limits.macro_low", q.macro_low, "limits.macro_high"),
            (q.micro_low >= q.micro_high, "limits.micro_low", q.micro_low, "limits.micro_high"),
            (q.whole_low >= q.whole_high, "limits.whole_low", q.whole_low, "limits.whole_high"),
            (fine.bias_low >= fine.bias_high, "fine.bias_low", fine.bias_low, "fine.bias_high"),
        )
        found = [
            (path, value, "below {" + bound + "}") for wrong, path, value, bound in rules if wrong
        ]
        return found


class LiveParameters(NamedTuple):
    settings: Live  # everything beside the laws
    control: Control
    calibration: Calibration  # calibration of the Hall sensor
    stages: tuple[str, ...] = STAGES  # stages that the machine has


def prepare(
    settings: Live | None = None,
    control: Control | None = None,
    table: Calibration | None = None,
    stages: tuple[str, ...] = STAGES,
) -> LiveParameters:
    """Parameters of a machine, with defaults."""
    return LiveParameters(
        Live() if settings is None else settings,
        Control() if control is None else control,
        calibration.default_calibration() if table is None else table,
        stages,
    )
