"""Commissioning of an axis that turns: the steps of one that slides, in angles; beside a constant
weight gravity may pull at an eccentric load."""

from __future__ import annotations

from macromicro.commission import axis, axis_page, unbalance, weight
from macromicro.commission.model import Model
from macromicro.commission.probing import Ends
from macromicro.commission.procedure import Estimate, Step, Work
from macromicro.commission.stand import BALANCED
from macromicro.commission.weight import Weight
from macromicro.identify import axis_settings, eccentric
from macromicro.identify.axis_inverse import ECCENTRIC
from macromicro.place import ANGLE

MEANINGS = {
    "unbalance": "gravity's greatest torque",
    "hangs": "where the load hangs, from the low end",
}


def _weight_intent(work: Work) -> str:
    o, p = work.options, work.stand.place
    low, high = _window(work)
    return (
        f"No effort for {weight.QUIET} s; what falls or swings then is left to for up to "
        f"{weight.SINKING:.0f} s, and lifted off an end on which it leans. Then effort rises from "
        f"0 to at most {o.effort:.3g} V until it starts, both ways, there and at up to "
        f"{2 * len(unbalance.OFFSETS)} places from {p.per * low:.4g} to {p.per * high:.4g} "
        f"{p.unit}, to which it creeps at {p.told(o.creep, 'm/s', 3)} until an end holds it. An "
        "eccentric load is held from then on, and falls whenever this is interrupted."
    )


def _window(work: Work) -> tuple[float, float]:
    o = work.options
    return (-o.travel, o.travel) if o.low is None or o.high is None else (o.low, o.high)


def _weight(work: Work) -> Weight:
    o, stand = work.options, work.stand
    stand.sign, stand.hold, stand.pull = 1.0, 0.0, BALANCED
    free, lifted = o.caution(float("inf")), axis.LIFT * o.travel
    found = unbalance.found(stand, free, o.creep, lifted, _window(work))
    if axis.DIRECTION in work.found:  # by a session before
        stand.sign = axis.direction_of(work).sign
    return found


def _ready(work: Work) -> None:
    """Nothing is held yet: a new session finds the weight again before all else.

    Strokes of an eccentric load say where it hangs from the low end. That is the same place again
    where it was felt for; a window that was named lies where the load stood.
    """
    felt = axis.ENDS not in work.found or axis.ends_of(work).found
    if work[axis.WEIGHT].pull != BALANCED and not felt:
        work.found.pop(axis.STROKES, None)


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
    load, low = eccentric.of(found.axis), axis.ends_of(work).low
    zero = low if ends is None else ends.low
    load = load._replace(hangs=load.hangs - (zero - low))
    made = axis_settings.turned(axis.settings(work, found, ends), load)
    return axis_settings.endless(made) if work.options.endless else made


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
    made = {
        name: one._replace(unit=ANGLE.named(one.unit))
        for name, one in told.items()
        if name not in ECCENTRIC
    }
    values, errors = eccentric.told(found)
    load = zip(values.tolist(), errors.tolist(), strict=True)
    for name, unit, (value, error) in zip(eccentric.NAMES, ("V", "rad"), load, strict=False):
        made[name] = Estimate(MEANINGS[name], value, found.within * error, unit)
    return made


def doubts(work: Work, model: Model) -> list[str]:
    """What a person should look at before the result is relied on.

    Parameters
    ----------
    work : Work
        With all steps done.
    model : Model
        Of the strokes.

    Returns
    -------
    list[str]
        A sentence each.
    """
    said = axis_page.doubts(work, model)
    if work[axis.WEIGHT].pull != BALANCED:
        said.insert(
            0,
            "Nothing but effort holds its eccentric load: it falls when the drive is off, and when "
            "a guard ends a run. A brake or a balance would hold it.",
        )
    return said


_GRAVITY = Step(axis.WEIGHT, "gravity", _weight_intent, _weight, Weight, places=True)

KIND = axis.KIND._replace(
    name="rotary",
    steps=(_GRAVITY, *axis.KIND.steps[1:]),
    prepare=_ready,
    note="Torques are in volts: the effort that gives them.",
    head="One newton metre below stands for one volt at the D/A.",
    settings=settings,
    estimates=estimates,
    doubts=doubts,
    place=ANGLE,
)
