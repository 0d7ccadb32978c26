from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro import nominal
from macromicro.schema.par import Par

NEVER = 1e9  # s, V, counts; beyond anything measured


class Limits(NamedTuple):
    """Defaults leave room for the thesis' worst controller on the default bench."""

    motor: Annotated[float, Par("V", "largest motor output", "Section 3.1", positive=True)] = (
        nominal.FULL_SCALE
    )
    ctrl: Annotated[float, Par("V", "largest CTRL output", "Section 3.2.1", positive=True)] = (
        nominal.FULL_SCALE
    )
    macro_margin: Annotated[
        float, Par("count", "macro following error allowed above that at the move's start", lo=1.0)
    ] = 60.0
    macro_grace: Annotated[float, Par("s", "time before the macro error must fall", lo=0.0)] = 0.5
    macro_rate: Annotated[
        float, Par("count/s", "slowest macro approach that is accepted", positive=True)
    ] = 500.0
    macro_tolerance: Annotated[
        float,
        Par(
            "count", "macro following error always allowed", "M9: the PID overshoots by 100", lo=1.0
        ),
    ] = 150.0
    micro_margin: Annotated[
        float,
        Par("m", "micro following error allowed above that at the step", shown="mm", positive=True),
    ] = 0.3e-3
    micro_grace: Annotated[float, Par("s", "time before the micro error must fall", lo=0.0)] = 1.5
    micro_rate: Annotated[
        float, Par("m/s", "slowest micro approach that is accepted", shown="mm/s", positive=True)
    ] = 0.5e-3
    micro_tolerance: Annotated[
        float,
        Par(
            "m",
            "micro following error always allowed",
            "S11: proportional control leaves 0.54 mm",
            shown="mm",
            positive=True,
        ),
    ] = 0.7e-3
    silent: Annotated[
        float, Par("s", "longest time without a new value of a sensor", shown="ms", positive=True)
    ] = 0.005
    frozen: Annotated[
        float, Par("s", "longest time of one Hall code (its noise changes it)", positive=True)
    ] = 0.5
    rail: Annotated[
        float,
        Par(
            "V",
            "Hall readings closer than this to 0 or `hall_supply` are off the scale",
            shown="mV",
            lo=0.0,
        ),
    ] = 0.01
    rail_time: Annotated[float, Par("s", "longest time off the scale", positive=True)] = 0.1
    push: Annotated[
        float, Par("V", "motor voltage at which the carriage must move", "above M1", positive=True)
    ] = nominal.PUSH
    stuck: Annotated[float, Par("s", "longest push without a count", positive=True)] = 0.25
    lean: Annotated[
        float, Par("V", "motor voltage at which it moves slowly", "just below M1", positive=True)
    ] = nominal.LEAN
    leant: Annotated[float, Par("s", "longest such push without a count", positive=True)] = 20.0
    against: Annotated[
        float, Par("count", "longest travel against the motor, as in braking", positive=True)
    ] = 250.0
    fastest: Annotated[
        float, Par("count/s", "speed impossible for the carriage", positive=True)
    ] = 50_000.0
    noise: Annotated[
        float, Par("V", "largest rms noise of the Hall sensor", shown="mV", positive=True)
    ] = 0.025
    noise_time: Annotated[
        float, Par("s", "time that this noise is averaged over", positive=True)
    ] = 0.1
    clock: Annotated[
        float, Par("s", "longest step of the rig's time between two periods", positive=True)
    ] = 0.1
    ambient: Annotated[
        float,
        Par(
            "degC",
            "room temperature, from which the wires are assumed to heat up",
            "Section 5.2.2",
            lo=-40,
            hi=80,
        ),
    ] = nominal.AMBIENT
    hottest: Annotated[
        float, Par("degC", "highest temperature estimated from CTRL", "above S6", positive=True)
    ] = 170.0
    ceiling: Annotated[
        float, Par("K", "heating at which the driver is assumed to level off", positive=True)
    ] = 250.0
    warm: Annotated[
        float,
        Par(
            "degC",
            "estimated temperature at which the wires must contract",
            "above S6",
            positive=True,
        ),
    ] = 120.0
    motion: Annotated[
        float, Par("m", "contraction that counts as motion", shown="um", positive=True)
    ] = 50e-6
    idle: Annotated[float, Par("s", "longest heating above that without motion", positive=True)] = (
        0.5
    )
    hall_supply: Annotated[
        float, Par("V", "supply of the Hall sensor, the end of its scale", positive=True)
    ] = nominal.HALL_SUPPLY


# A machine that serves is stopped sooner. In the simulator a carriage that its controller
# cannot move is a result, and is left to its patience. Homing leans on the stop for 0.6 s.
LIVE = Limits()._replace(stuck=0.1, leant=1.0)
