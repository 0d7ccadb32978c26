"""The machine that a commissioning found, as settings of the machine `axis`.

The model is in volts and metres; one newton stands for one volt at the D/A.
"""

from __future__ import annotations

import numpy as np

from macromicro.commission.model import UNITS, Model
from macromicro.commission.probing import Ends
from macromicro.commission.procedure import Work
from macromicro.identify import axis_settings
from macromicro.identify.axis_settings import Around


def settings(model: Model, work: Work, ends: Ends, pitch: float) -> dict[str, str]:
    """Settings by their paths, as text with units; 0 mm is the low end of the travel.

    Parameters
    ----------
    model : Model
        Of the strokes.
    work : Work
        What the steps found.
    ends : Ends
        Travel.
    pitch : float
        Travel per count, m.

    Returns
    -------
    dict[str, str]
        Path to a TOML value.
    """
    friction, dt = work.friction, work.stand.dt
    fastest = max(float(np.abs(np.gradient(one.x, dt)).max()) for one in work.strokes)
    around = Around(
        gain=1.0,
        effort=work.options.effort,
        pitch=pitch,
        period=dt,
        travel=ends.travel,
        speed=fastest,
        ripple=max(friction.largest - friction.mean, 0.0),
    )
    started = max(friction.mean - model.axis.coulomb, 0.0)
    return axis_settings.values(model.axis._replace(stribeck=started), around)


def as_toml(values: dict[str, str], model: Model, head: str) -> str:
    """A machine's file.

    Parameters
    ----------
    values : dict[str, str]
        From `settings`.
    model : Model
        For the intervals in the comments.
    head : str
        First lines, as a comment.

    Returns
    -------
    str
        TOML.
    """
    lines = [head, "", "As found, in volts and metres, with 95 % intervals:"]
    for name in model.names:
        value, half = getattr(model.axis, name), model.half_width(name)
        lines.append(f"  {name} = {value:.4g} +- {half:.2g} {UNITS[name]}")
    lines.append("One newton below stands for one volt at the D/A.")
    return axis_settings.as_toml(values, "\n".join(lines))
