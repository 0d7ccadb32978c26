"""Heat: wires, plates and body as a three-node ladder to the air.

(5.6) is exactly the input impedance of such a ladder with positive elements; one ladder
then gives the heating, the one-second cooling and the slow warming over cycles of
Section 6.3 and Appendix D. The wires also store latent heat, so their plain capacity is
smaller than the apparent one in (5.6).
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.kernel import kernel
from macromicro.schema.par import Par

_S7 = "calibrated to S7 ((5.6))"


class Thermal(NamedTuple):
    """The ladder. One normalised unit of (5.6) is 150 K/W (wire mass about 9 mg).

    As an impedance, (5.6) has C1 0.999, R1 0.7454, C2 44.93, R2 0.2126, C3 1768, R3 0.0517.
    """

    ambient: Annotated[float, Par("degC", "room temperature", "Section 5.2.2", lo=-40, hi=80)] = (
        25.0
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


@kernel
def flows(
    p: Thermal, wire: float, plates: float, body: float, fan: float
) -> tuple[float, float, float]:
    """Heat flows of the ladder.

    Parameters
    ----------
    p : Thermal
        Parameters of the ladder.
    wire, plates, body : float
        Temperatures, deg C.
    fan : float
        0 or 1.

    Returns
    -------
    wire : float
        Wires to plates, W.
    plates : float
        Plates to body, W.
    body : float
        Body to air, W.
    """
    ease = 1.0 + fan * (p.fan_factor - 1.0)
    return (
        (wire - plates) / p.wire_resistance,
        (plates - body) / (p.plate_resistance * ease),
        (body - p.ambient) / (p.body_resistance * ease),
    )
