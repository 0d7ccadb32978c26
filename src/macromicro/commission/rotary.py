"""Commissioning of a rotary axis, with an eccentric load if any."""

from __future__ import annotations

from macromicro.commission import _axis_page, _gravity, axis
from macromicro.commission._axis_fit import Model
from macromicro.commission._gravity import Weight
from macromicro.commission._probing import Ends
from macromicro.commission.courses import QUIET
from macromicro.commission.procedure import SIMULATED, Estimate, Step, Work
from macromicro.commission.stand import BALANCED
from macromicro.identify import axis_settings, eccentric
from macromicro.identify.axis_inverse import ECCENTRIC
from macromicro.place import ANGLE

MEANINGS = {
    "unbalance": "gravity's greatest torque",
    "hangs": "rest angle of the load, from the low end",
}


def _weight_intent(work: Work) -> str:
    o, p = work.options, work.stand.place
    low, high = _window(work)
    return (
        f"No effort for {QUIET} s; whatever falls or swings then has up to "
        f"{_gravity.SINKING:.0f} s to settle, and is lifted off an end on which it leans. Then "
        f"the effort rises from 0 to at most {o.effort:.3g} V until the axis starts, in both "
        f"directions, there and at up to {2 * len(_gravity.OFFSETS)} angles from "
        f"{p.per * low:.4g} to {p.per * high:.4g} {p.unit}, reached at "
        f"{p.told(o.creep, 'm/s', 3)} unless an end blocks it. An eccentric load is held from "
        "then on, and falls if this is interrupted."
    )


def _window(work: Work) -> tuple[float, float]:
    o = work.options
    return (-o.travel, o.travel) if o.low is None or o.high is None else (o.low, o.high)


def _weight(work: Work) -> Weight:
    o, stand = work.options, work.stand
    stand.sign, stand.hold, stand.pull = 1.0, 0.0, BALANCED
    free, lifted = o.caution(float("inf")), axis.LIFT * o.travel
    found = _gravity.balance(stand, free, o.creep, lifted, _window(work))
    if axis.DIRECTION in work.found:  # by a session before
        stand.sign = axis.direction_of(work).sign
    return found


def _ready(work: Work) -> None:
    """Clear what was held: a new session first measures the weight again."""
    # Strokes give the load's angle from the low end, which is the same place in a new session if it
    # was found by touch; a named window lies where the load stood.
    felt = axis.ENDS not in work.found or axis.ends_of(work).found
    if work[axis.WEIGHT].pull != BALANCED and not felt:
        work.found.pop(axis.STROKES, None)


def settings(work: Work, found: Model, ends: Ends | None) -> dict[str, str]:
    load, low = eccentric.of(found.axis), axis.ends_of(work).low
    zero = low if ends is None else ends.low
    load = load._replace(hangs=load.hangs - (zero - low))
    made = axis_settings.as_rotary(axis.settings(work, found, ends), load)
    return axis_settings.endless(made) if work.options.endless else made


def estimates(found: Model) -> dict[str, Estimate]:
    told = _axis_page.estimates(found)
    made = {
        name: one._replace(unit=ANGLE.named(one.unit))
        for name, one in told.items()
        if name not in ECCENTRIC
    }
    halves = found.half_widths(eccentric.slopes(found)).tolist()
    load = zip(eccentric.NAMES, eccentric.of(found.axis), halves, ("V", "rad"), strict=False)
    for name, value, half, unit in load:
        made[name] = Estimate(MEANINGS[name], value, half, unit)
    return made


def doubts(work: Work, model: Model) -> list[str]:
    said = _axis_page.doubts(work, model)
    if work[axis.WEIGHT].pull != BALANCED:
        said.insert(
            0,
            "Only the motor holds the eccentric load: it falls when the drive is off or a "
            "guard stops a run. A brake or a counterweight would hold it.",
        )
    return said


_GRAVITY = Step(axis.WEIGHT, "gravity", _weight_intent, _weight, Weight, places=True)

KIND = axis.KIND._replace(
    name="rotary",
    steps=(_GRAVITY, *axis.KIND.steps[1:]),
    prepare=_ready,
    note=f"Torques are in volts of effort. {SIMULATED}",
    head="One newton metre below is one volt at the D/A.",
    settings=settings,
    estimates=estimates,
    doubts=doubts,
    place=ANGLE,
)
