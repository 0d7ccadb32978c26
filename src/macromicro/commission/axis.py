"""Commissioning of a linear axis with a motor and an encoder."""

from __future__ import annotations

from macromicro.commission import (
    _axis_fit,
    _axis_gains,
    _axis_page,
    _exciting,
    _gravity,
    _mode,
    _probing,
    _settings,
    _verifying,
)
from macromicro.commission._axis_fit import Model
from macromicro.commission._gravity import Weight
from macromicro.commission._probing import Direction, Ends, FrictionMap, go
from macromicro.commission.courses import QUIET
from macromicro.commission.procedure import SIMULATED, Kind, Step, Work
from macromicro.commission.stand import BALANCED, CommissionError, Pull, Record

WEIGHT, DIRECTION = "weight", "direction"
LIFT = 2e-3  # of the longest way on which an end is looked for
ENDS, FRICTION, STROKES, MODES = "ends", "friction", "strokes", "modes"


def direction_of(work: Work) -> Direction:
    found: Direction = work[DIRECTION]
    return found


def ends_of(work: Work) -> Ends:
    found: Ends = work[ENDS]
    return found


def _weight_intent(work: Work) -> str:
    o, p = work.options, work.stand.place
    return (
        f"No effort for {QUIET} s. If the axis sinks, it may sink to its lower end for "
        f"up to {_gravity.SINKING:.0f} s; then the effort rises from 0 to at most "
        f"{o.effort:.3g} V of either sign until it is lifted by {p.per * LIFT * o.travel:.2g} "
        f"{p.unit}. It is held there, and sinks if this is interrupted."
    )


def _weight(work: Work) -> Weight:
    o = work.options
    return _gravity.find_weight(work.stand, o.caution(float("inf")), o.creep, LIFT * o.travel)


def _direction_intent(work: Work) -> str:
    o = work.options
    return (
        f"The effort rises from 0 to at most {o.effort:.3g} V, three times in each direction, "
        f"and is removed when the encoder moves by {_probing.MOVED:.0f} counts. The axis may "
        "jump a little."
    )


def _direction(work: Work) -> Direction:
    return _probing.direction(work.stand, work.options.caution(float("inf")))


def _ends_intent(work: Work) -> str:
    o, p = work.options, work.stand.place
    push = _probing.PUSH * direction_of(work).surely(o.effort)
    if o.low is not None and o.high is not None:
        which = "Continuous rotation: a window" if o.endless else "The given window"
        return (
            f"{which} is used, {o.low * p.per:.4g} to {o.high * p.per:.4g} {p.unit} from the "
            "present position. Nothing moves."
        )
    return (
        f"The axis creeps at {o.creep * p.per:.3g} {p.unit}/s to one end and to the other, at "
        f"most {o.travel * p.per:.4g} {p.unit} each way, until a stop resists {push:.3g} V."
    )


def _ends(work: Work) -> Ends:
    o = work.options
    if o.low is not None and o.high is not None:
        return Ends(o.low, o.high, False)
    caution = o.caution(o.creep)
    return _probing.ends(work.stand, direction_of(work), caution, o.travel)


def _friction_intent(work: Work) -> str:
    ends, p = ends_of(work), work.stand.place
    return (
        f"The axis creeps to {_probing.PLACES} positions between {ends.low * p.per:.4g} and "
        f"{ends.high * p.per:.4g} {p.unit}; at each, the effort rises until it moves, in both "
        "directions."
    )


def _friction(work: Work) -> FrictionMap:
    caution = work.options.caution(work.options.creep)
    return _probing.map_friction(work.stand, direction_of(work), ends_of(work), caution)


def _strokes_intent(work: Work) -> str:
    o, ends, p = work.options, ends_of(work), work.stand.place
    least = direction_of(work).surely(o.effort)
    most = least + _exciting.LEVELS[-1] * (o.effort - least)
    return (
        f"{len(_exciting.LEVELS) * _exciting.STROKES} strokes with efforts up to {most:.3g} V and "
        f"speeds up to {p.told(o.speed, 'm/s', 3)}, within {ends.low * p.per:.4g} and "
        f"{ends.high * p.per:.4g} {p.unit}."
    )


def _strokes(work: Work) -> list[Record]:
    o = work.options
    caution = o.caution(o.speed)
    made = _exciting.excite(work.stand, direction_of(work), ends_of(work), caution, o.creep)
    pull = work.stand.pull.times(work.stand.sign)
    if pull == BALANCED:
        return made
    # With what held the load, and from the low end: sessions count places from elsewhere.
    low = ends_of(work).low
    return [one._replace(u=one.u + pull.along(one.x), x=one.x - low) for one in made]


def pull_of(work: Work) -> Pull:
    return work.stand.pull.times(work.stand.sign).seen_from(ends_of(work).low)


def _modes_intent(work: Work) -> str:
    o, ends, p = work.options, ends_of(work), work.stand.place
    at = _exciting.speed(ends, o.caution(o.speed))
    most = _exciting.strength(direction_of(work), o.effort)
    return (
        f"{_exciting.PASSES} passes at {p.told(at, 'm/s', 3)} within {ends.low * p.per:.4g} and "
        f"{ends.high * p.per:.4g} {p.unit}, while a chirp of {_exciting.SECONDS} s with up to "
        f"{most:.3g} V excites it, from {_exciting.LOW:g} to {_exciting.HIGH / work.stand.dt:.4g} "
        "Hz."
    )


def _modes(work: Work) -> list[Record]:
    o = work.options
    about = _axis_fit.momentum(work[STROKES], work.stand.dt, pull_of(work))
    return _exciting.shaken(
        work.stand, about, direction_of(work), ends_of(work), o.caution(o.speed), o.creep
    )


def _ready(work: Work) -> None:
    work.stand.hold = work[WEIGHT].hold
    if DIRECTION in work.found:
        work.stand.sign = direction_of(work).sign


def fit(work: Work) -> Model:
    found: FrictionMap = work[FRICTION]
    made = _axis_fit.fit_axis(
        work[STROKES], work.stand.dt, found.mean, found.spread, found.slid, pull_of(work)
    )
    made = made._replace(hold=work.stand.sign * work.stand.hold)
    return made.shaken(_mode.find_mode(work[MODES], work.stand.dt))


def settings(work: Work, found: Model, ends: Ends | None) -> dict[str, str]:
    where = ends_of(work) if ends is None else ends
    return _settings.settings(
        found, where, friction=work[FRICTION], strokes=work[STROKES],
        effort=work.options.effort, stand=work.stand,
    )  # fmt: skip


def home(work: Work, found: Model) -> Ends:
    """Creep to the low end, which becomes the machine's 0."""
    ends, stand = ends_of(work), work.stand
    near = ends.low + 0.02 * ends.travel
    if not go(stand, near, direction_of(work), work.options.caution(work.options.creep)):
        raise CommissionError(
            "the axis was blocked on its way to the low end. Check for an obstacle"
        )
    return Ends(stand.position(), ends.high, ends.found)


KIND = Kind(
    name="axis",
    steps=(
        Step(WEIGHT, "weight", _weight_intent, _weight, Weight),
        Step(DIRECTION, "sign and breakaway", _direction_intent, _direction, Direction),
        Step(ENDS, "end stops and travel", _ends_intent, _ends, Ends, places=True),
        Step(FRICTION, "friction over position", _friction_intent, _friction, FrictionMap),
        Step(STROKES, "strokes for the model", _strokes_intent, _strokes, None),
        Step(MODES, "chirp for modes", _modes_intent, _modes, None),
    ),
    turned=(
        "A positive effort made the encoder count down: swap the motor leads or the "
        "encoder's channels A and B before using this file."
    ),
    note=f"Forces are in volts of effort. {SIMULATED}",
    prepare=_ready,
    model=fit,
    settings=settings,
    head="One newton below is one volt at the D/A.",
    homing="The axis creeps to its low end",
    home=home,
    rows=_axis_page.rows,
    estimates=_axis_page.estimates,
    doubts=_axis_page.doubts,
    figures=_axis_page.FIGURES,
    rehearse=_axis_gains.settling_time,
    tune=_axis_gains.search_gains,
    compare=_verifying.settling,
    margins=_axis_gains.robustness,
)
