"""The machine that a commissioning found, as settings of the machine `axis`.

The model is in volts and metres; one newton stands for one volt at the D/A.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from macromicro.commission.friction import FrictionMap
from macromicro.commission.model import Model
from macromicro.commission.probing import Ends
from macromicro.commission.stand import Record, Stand
from macromicro.identify import axis_settings
from macromicro.identify.axis_settings import Around


def settings(
    model: Model,
    ends: Ends,
    *,
    friction: FrictionMap,
    strokes: Sequence[Record],
    effort: float,
    stand: Stand,
) -> dict[str, str]:
    """Settings by their paths, as text with units; 0 mm is the low end of the travel.

    Parameters
    ----------
    model : Model
        Of the strokes.
    ends : Ends
        Travel.
    friction : FrictionMap
        Along the travel.
    strokes : Sequence[Record]
        They show the greatest speed.
    effort : float
        Largest, V.
    stand : Stand
        With the control period and the travel per count.

    Returns
    -------
    dict[str, str]
        Path to a TOML value.
    """
    dt = stand.dt
    fastest = max(float(np.abs(np.gradient(one.x, dt)).max()) for one in strokes)
    around = Around(
        gain=1.0,
        effort=effort,
        pitch=stand.pitch,
        period=dt,
        travel=ends.travel,
        speed=fastest,
        ripple=max(friction.largest - friction.mean, 0.0),
    )
    started = max(friction.mean - model.axis.coulomb, 0.0)
    return axis_settings.values(model.whole._replace(stribeck=started), around)
