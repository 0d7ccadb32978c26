"""Heat: wires, plates and body as a three-node ladder to the air.

(5.6) is the input impedance of such a ladder. The wires also store latent heat, so their plain
capacity is smaller than the apparent one in (5.6).
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro import nominal
from macromicro.columns import Meaning
from macromicro.kernel import kernel
from macromicro.plant import VARIANT, value_noise
from macromicro.schema.par import Par

_S7 = "calibrated to S7 ((5.6))"


class Thermal(NamedTuple):
    """The ladder. One normalised unit of (5.6) is 150 K/W (wire mass about 9 mg).

    As an impedance, (5.6) has C1 0.999, R1 0.7454, C2 44.93, R2 0.2126, C3 1768, R3 0.0517.
    """

    ambient: Annotated[float, Par("degC", "room temperature", "Section 5.2.2", lo=-40, hi=80)] = (
        nominal.AMBIENT
    )
    wire_capacity: Annotated[
        float,
        Par(
            "J/K",
            "heat capacity of the wires, latent heat aside",
            _S7 + ", S13c",
            shown="mJ/K",
            positive=True,
        ),
    ] = 0.70 / 150.0
    wire_resistance: Annotated[float, Par("K/W", "wires to plates", _S7, positive=True)] = (
        0.7454 * 150.0
    )
    plate_capacity: Annotated[
        float, Par("J/K", "heat capacity of the plates", _S7, positive=True)
    ] = 44.93 / 150.0
    plate_resistance: Annotated[float, Par("K/W", "plates to body", _S7, positive=True)] = (
        0.2126 * 150.0
    )
    body_capacity: Annotated[float, Par("J/K", "heat capacity of the body", _S7, positive=True)] = (
        1768.0 / 150.0
    )
    body_resistance: Annotated[
        float, Par("K/W", "body to air", "calibrated to I3", positive=True)
    ] = 0.08 * 150.0
    fan_factor: Annotated[
        float,
        Par(
            "1",
            "factor of the two outer resistances with the fan",
            "calibrated to I4",
            lo=0.01,
            hi=1.0,
        ),
    ] = 0.82
    convection: Annotated[
        float,
        Par(
            "1/K",
            "rise of the wires' heat transfer with their temperature",
            VARIANT,
            lo=0.0,
            hi=0.02,
        ),
    ] = 0.0
    draught: Annotated[
        float,
        Par(
            "1",
            "change of the heat transfer to the air (standard deviation)",
            VARIANT,
            lo=0.0,
            hi=0.5,
        ),
    ] = 0.0
    draught_time: Annotated[float, Par("s", "time over which it changes", positive=True)] = 5.0
    draught_seed: Annotated[float, Par("", "which draught", lo=0.0)] = 0.0


_USUAL = 40.0  # K of the wires above the plates, for which `wire_resistance` holds
_LEAST = 0.1  # share of the heat transfer that is always left


@kernel
def to_plates(p: Thermal, wire: float, plates: float) -> float:
    """Heat from wires to plates, which rises with temperature (deg C)."""
    above = wire - plates
    ease = max(1.0 + p.convection * (abs(above) - _USUAL), _LEAST) if p.convection > 0.0 else 1.0
    return above / p.wire_resistance * ease


@kernel
def airy(p: Thermal, t: float) -> float:
    """Relative heat transfer to the air at a time, which draughts change."""
    if p.draught <= 0.0:
        return 1.0
    return max(1.0 + p.draught * value_noise.at(p.draught_seed, t / p.draught_time), _LEAST)


@kernel
def flows(
    p: Thermal, wire: float, plates: float, body: float, fan: float, air: float
) -> tuple[
    Annotated[float, Meaning(name="wire")],
    Annotated[float, Meaning(name="plates")],
    Annotated[float, Meaning(name="body")],
]:
    """Heat flows of the ladder (temperatures in deg C)."""
    ease = 1.0 + fan * (p.fan_factor - 1.0)
    return (
        to_plates(p, wire, plates),
        (plates - body) / (p.plate_resistance * ease) * air,
        (body - p.ambient) / (p.body_resistance * ease) * air,
    )
