"""The actuator's driver circuit (Section 3.2.1): CTRL to heat, CONTRACT cut-off, EXTEND."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.columns import Meaning
from macromicro.kernel import kernel
from macromicro.schema.par import Par

_MAP = "calibrated to S3-S7 ((5.5), (5.8))"
# CTRL [D/A volts] and heat [W]. Between 1.5 and 1.6 V these are back-solved from (5.5);
# above they stay near (5.8), which runs away from 1.9 V on, against the text: bounded here.
# fmt: off
_POINTS = (
    (1.25, 0.0), (1.3, 0.02), (1.4, 0.15), (1.5, 0.3880), (1.525, 0.4920), (1.55, 0.5393),
    (1.575, 0.5573), (1.6, 0.5613), (1.65, 0.6553), (1.7, 0.8), (1.8, 1.0), (1.9, 1.3667),
    (2.1, 1.4067), (5.0, 1.42),
)
# fmt: on
_CTRL: tuple[float, ...] = tuple(point[0] for point in _POINTS)
_HEAT: tuple[float, ...] = tuple(point[1] for point in _POINTS)


class Driver(NamedTuple):
    """The circuit's map from CTRL to heat, its lag, and where its end switches act."""

    supply: Annotated[
        float,
        Par("V", "supply VDC; heat is proportional to its square", "Section 3.2.1", positive=True),
    ] = 4.0
    map_ctrl: Annotated[
        tuple[float, ...],
        Par("V", "CTRL values of the heat map, in D/A volts", _MAP, lo=0.0),
    ] = _CTRL
    map_heat: Annotated[
        tuple[float, ...], Par("W", "heat in the wires at 4 V supply", _MAP, lo=0.0)
    ] = _HEAT
    lag: Annotated[
        float, Par("s", "driver's lag", "calibrated to S11, S13c", shown="ms", lo=0.0)
    ] = 2.0e-3
    contract_on: Annotated[
        float,
        Par(
            "m",
            "contraction that closes CONTRACT",
            "Section 3.2.1; value assumed",
            shown="mm",
            positive=True,
        ),
    ] = 3.979e-3
    contract_off: Annotated[
        float, Par("m", "contraction that opens it again", shown="mm", positive=True)
    ] = 3.970e-3
    extend_on: Annotated[
        float,
        Par(
            "m",
            "contraction up to which EXTEND shows",
            "Section 3.2.1; value assumed",
            shown="mm",
            lo=0.0,
        ),
    ] = 0.05e-3


class DriverTable(NamedTuple):
    gain: Annotated[float, Meaning("factor on the heat, by the supply")]
    ctrl: Annotated[npt.NDArray[np.float64], Meaning("CTRL values of the map", "V")]
    heat: Annotated[npt.NDArray[np.float64], Meaning("heat there at 4 V supply", "W")]
    lag: Annotated[float, Meaning("", "s")]
    contract_on: Annotated[float, Meaning("", "m")]
    contract_off: Annotated[float, Meaning("", "m")]
    extend_on: Annotated[float, Meaning("", "m")]


def prepare(spec: Driver, reference_supply: float = 4.0) -> DriverTable:
    """Arrays for the kernels; heat scales with the supply squared (Joule heating)."""
    return DriverTable(
        (spec.supply / reference_supply) ** 2,
        np.array(spec.map_ctrl, dtype=float),
        np.array(spec.map_heat, dtype=float),
        float(spec.lag),
        float(spec.contract_on),
        float(spec.contract_off),
        float(spec.extend_on),
    )


@kernel
def heat(p: DriverTable, ctrl: float) -> float:
    """Steady heat, interpolated in the map."""
    last = len(p.ctrl) - 1
    if ctrl <= p.ctrl[0]:
        return float(p.gain * p.heat[0])
    if ctrl >= p.ctrl[last]:
        return float(p.gain * p.heat[last])
    i = 0
    while p.ctrl[i + 1] < ctrl:
        i += 1
    share = (ctrl - p.ctrl[i]) / (p.ctrl[i + 1] - p.ctrl[i])
    return float(p.gain * (p.heat[i] + share * (p.heat[i + 1] - p.heat[i])))


@kernel
def contract(p: DriverTable, on: float, x: float) -> float:
    """CONTRACT switch, with its own hysteresis."""
    if x >= p.contract_on:
        return 1.0
    if x < p.contract_off:
        return 0.0
    return on


@kernel
def delivered(p: DriverTable, power: float, ctrl: float, cut: float, dt: float) -> float:
    """Heat after one step of a first-order lag; none while CONTRACT cuts it off."""
    if cut > 0.5:
        return 0.0
    goal = heat(p, ctrl)
    if p.lag <= 0.0:
        return goal
    return goal + (power - goal) * math.exp(-dt / p.lag)
