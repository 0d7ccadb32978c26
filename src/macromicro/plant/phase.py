"""The alloy's relays (Section 2.4.1): a density over heating and cooling thresholds."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.hysteresis import Everett, from_density
from macromicro.schema.par import Par

_CAL = "calibrated to S2, S4, S6, S8, S13a, S13b, I3"


class Phase(NamedTuple):
    """Density of the transformation's relays at the reference load (`wire.reference_load`).

    Thresholds lie within 0-120 degC, the range of the relay table.
    """

    heat_start: Annotated[float, Par("degC", "first heating threshold (austenite start)", _CAL)] = (
        43.0
    )
    heat_end: Annotated[float, Par("degC", "last heating threshold (austenite finish)", _CAL)] = (
        108.9
    )
    heat_fold: Annotated[
        float,
        Par("K", "temperature in which the heating density falls e-fold", _CAL, positive=True),
    ] = 10.0
    cool_offset: Annotated[
        float, Par("degC", "mean cooling threshold at a heating threshold of 0 degC", _CAL)
    ] = 44.5
    cool_slope: Annotated[
        float, Par("1", "mean cooling threshold per heating threshold", _CAL, lo=0.0, hi=1.0)
    ] = 0.35
    cool_spread: Annotated[
        float,
        Par("K", "scatter of the cooling thresholds (standard deviation)", _CAL, positive=True),
    ] = 13.5
    cool_end: Annotated[
        float, Par("degC", "last cooling threshold (martensite finish)", "calibrated to I3, I4")
    ] = 35.0
    width_min: Annotated[
        float, Par("K", "least distance of a relay's two thresholds", _CAL, lo=0.1)
    ] = 2.0


_LOW, _STEP, _NODES = 0.0, 0.5, 241
TABLE_END = _LOW + _STEP * (_NODES - 1)


def weights(
    p: Phase, up: npt.NDArray[np.float64], down: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Density (not normalised) of the relays; `up`, `down` in deg C."""
    within = (up >= p.heat_start) & (up <= p.heat_end)
    rising = np.where(within, np.exp(np.minimum(up - p.heat_end, 0.0) / p.heat_fold), 0.0)
    centre = p.cool_offset + p.cool_slope * up
    scatter = np.exp(-0.5 * ((down - centre) / p.cool_spread) ** 2)
    # Relays whose drawn cooling threshold comes too close are not there at all; the
    # heating curve keeps its shape because each heating threshold is normalised.
    allowed = np.where((down <= up - p.width_min) & (down >= p.cool_end), scatter, 0.0)
    total = allowed.sum(axis=-1, keepdims=True)
    share = np.divide(allowed, total, out=np.zeros_like(allowed), where=total > 1e-12)
    return np.asarray(rising * share, dtype=float)


def table(p: Phase) -> Everett:
    """Everett table of the density on 0-120 deg C in half degrees."""
    return from_density(lambda up, down: weights(p, up, down), _LOW, _STEP, _NODES)
