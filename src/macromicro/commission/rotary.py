"""Commissioning of an axis that turns: the steps of one that slides, in angles."""

from __future__ import annotations

from macromicro.commission import axis, axis_page
from macromicro.commission.model import Model
from macromicro.commission.probing import Ends
from macromicro.commission.procedure import Estimate, Work
from macromicro.identify import axis_settings
from macromicro.place import ANGLE


def settings(work: Work, found: Model, ends: Ends | None) -> dict[str, str]:
    """The machine that was found.

    Parameters
    ----------
    work : Work
        With all steps done.
    found : Model
        Of the strokes, in V and rad.
    ends : Ends | None
        From `axis.home`; None: as the step found them.

    Returns
    -------
    dict[str, str]
        Path to a TOML value.
    """
    return axis_settings.turned(axis.settings(work, found, ends))


def estimates(found: Model) -> dict[str, Estimate]:
    """What the model says.

    Parameters
    ----------
    found : Model
        Of the strokes, in V and rad.

    Returns
    -------
    dict[str, Estimate]
        By the names of its parameters.
    """
    told = axis_page.estimates(found)
    return {name: one._replace(unit=ANGLE.named(one.unit)) for name, one in told.items()}


KIND = axis.KIND._replace(
    name="rotary",
    note="Torques are in volts: the effort that gives them.",
    head="One newton metre below stands for one volt at the D/A.",
    settings=settings,
    estimates=estimates,
    place=ANGLE,
)
