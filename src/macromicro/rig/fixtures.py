"""What the two test fixtures measure and take: the kiln of Section 5.2.1, the cycle bench of
Appendix D."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.nominal import PERIOD

KILN_PERIOD = 0.2  # s
CYCLE_PERIOD = PERIOD
KILN_PITCH = 14e-6  # m, travel per encoder count


class KilnSample(NamedTuple):
    t: Annotated[float, Meaning("", "s")]
    thermocouple: Annotated[float, Meaning("", "degC")]
    encoder: Annotated[float, Meaning("contraction", "count")]


class KilnOutputs(NamedTuple):
    heater: float  # relay, 0 or 1


class CycleSample(NamedTuple):
    t: Annotated[float, Meaning("", "s")]
    encoder: Annotated[float, Meaning("contraction", "count")]
    extend: Annotated[float, Meaning("0 or 1")]
    contract: Annotated[float, Meaning("0 or 1")]


class CycleOutputs(NamedTuple):
    ctrl: float  # V at the D/A
    fan: float  # 0 or 1
