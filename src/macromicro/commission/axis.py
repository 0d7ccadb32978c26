"""Commissioning of an axis: a motor, an encoder, friction; its steps and what follows."""

from __future__ import annotations

from macromicro.commission import (
    axis_margins,
    axis_page,
    comparing,
    exciting,
    friction,
    gains,
    mode,
    model,
    momentum,
    probing,
    rehearsal,
    shaking,
    weight,
)
from macromicro.commission import settings as found_settings
from macromicro.commission.friction import FrictionMap
from macromicro.commission.model import Model
from macromicro.commission.probing import Direction, Ends, go
from macromicro.commission.procedure import Kind, Step, Work
from macromicro.commission.stand import BALANCED, CommissionError, Pull, Record
from macromicro.commission.weight import Weight

WEIGHT, DIRECTION = "weight", "direction"
LIFT = 2e-3  # of the longest way on which an end is looked for
ENDS, FRICTION, STROKES, MODES = "ends", "friction", "strokes", "modes"


def direction_of(work: Work) -> Direction:
    """What starts the axis.

    Parameters
    ----------
    work : Work
        With that step done.

    Returns
    -------
    Direction
        Sign and efforts.
    """
    found: Direction = work[DIRECTION]
    return found


def ends_of(work: Work) -> Ends:
    """Where it may go.

    Parameters
    ----------
    work : Work
        With that step done.

    Returns
    -------
    Ends
        m from where the encoder stood at the session's start.
    """
    found: Ends = work[ENDS]
    return found


def _weight_intent(work: Work) -> str:
    o, p = work.options, work.stand.place
    return (
        f"No effort for {weight.QUIET} s. If it sinks then, it is left to sink to its lower end "
        f"for up to {weight.SINKING:.0f} s, and effort rises from 0 to at most {o.effort:.3g} V of "
        f"either sign until it is lifted by {p.per * LIFT * o.travel:.2g} {p.unit}; it is held "
        "there, and sinks whenever this is interrupted."
    )


def _weight(work: Work) -> Weight:
    o = work.options
    return weight.found(work.stand, o.caution(float("inf")), o.creep, LIFT * o.travel)


def _direction_intent(work: Work) -> str:
    o = work.options
    return (
        f"Effort rises from 0 to at most {o.effort:.3g} V, three times each way, and is taken away "
        f"when the encoder moves by {probing.MOVED:.0f} counts. The axis may jump a little."
    )


def _direction(work: Work) -> Direction:
    return probing.direction(work.stand, work.options.caution(float("inf")))


def _ends_intent(work: Work) -> str:
    o, p = work.options, work.stand.place
    push = probing.PUSH * direction_of(work).surely(o.effort)
    if o.low is not None and o.high is not None:
        which = "Nothing ends its way: a window" if o.endless else "The window that was named"
        return (
            f"{which} is used, {o.low * p.per:.4g} to {o.high * p.per:.4g} "
            f"{p.unit} from where the axis stands now. Nothing moves."
        )
    return (
        f"The axis creeps at {o.creep * p.per:.3g} {p.unit}/s to one end and to the other, at most "
        f"{o.travel * p.per:.4g} {p.unit} each way, until a stop holds it against {push:.3g} V."
    )


def _ends(work: Work) -> Ends:
    o = work.options
    if o.low is not None and o.high is not None:
        return Ends(o.low, o.high, False)
    caution = o.caution(o.creep)
    return probing.ends(work.stand, direction_of(work), caution, o.travel)


def _friction_intent(work: Work) -> str:
    ends, p = ends_of(work), work.stand.place
    return (
        f"The axis creeps to {friction.PLACES} places between {ends.low * p.per:.4g} and "
        f"{ends.high * p.per:.4g} {p.unit}; at each, effort rises until it moves, both ways."
    )


def _friction(work: Work) -> FrictionMap:
    caution = work.options.caution(work.options.creep)
    return friction.mapped(work.stand, direction_of(work), ends_of(work), caution)


def _strokes_intent(work: Work) -> str:
    o, ends, p = work.options, ends_of(work), work.stand.place
    least = direction_of(work).surely(o.effort)
    most = least + exciting.LEVELS[-1] * (o.effort - least)
    return (
        f"{len(exciting.LEVELS) * exciting.STROKES} strokes with efforts up to {most:.3g} V and "
        f"speeds up to {p.told(o.speed, 'm/s', 3)}, within {ends.low * p.per:.4g} and "
        f"{ends.high * p.per:.4g} {p.unit}."
    )


def _strokes(work: Work) -> list[Record]:
    o = work.options
    caution = o.caution(o.speed)
    made = exciting.excite(work.stand, direction_of(work), ends_of(work), caution, o.creep)
    pull = work.stand.pull.times(work.stand.sign)
    if pull == BALANCED:
        return made
    # With what held the load, and from the low end: sessions count places from elsewhere.
    low = ends_of(work).low
    return [one._replace(u=one.u + pull.along(one.x), x=one.x - low) for one in made]


def pull_of(work: Work) -> Pull:
    """What held the load in the strokes.

    Parameters
    ----------
    work : Work
        With the ends found.

    Returns
    -------
    Pull
        In the direction of the strokes' efforts, by angles from the low end.
    """
    return work.stand.pull.times(work.stand.sign).seen_from(ends_of(work).low)


def _modes_intent(work: Work) -> str:
    o, ends, p = work.options, ends_of(work), work.stand.place
    at = shaking.speed(ends, o.caution(o.speed))
    most = shaking.strength(direction_of(work), o.effort)
    return (
        f"{shaking.PASSES} passes at {p.told(at, 'm/s', 3)} within {ends.low * p.per:.4g} and "
        f"{ends.high * p.per:.4g} {p.unit}, while a chirp of {shaking.SECONDS} s with up to "
        f"{most:.3g} V shakes it, from {shaking.LOW:g} to {shaking.HIGH / work.stand.dt:.4g} Hz."
    )


def _modes(work: Work) -> list[Record]:
    o = work.options
    strokes = momentum.unloaded(work[STROKES], pull_of(work))
    return shaking.shaken(
        work.stand, strokes, direction_of(work), ends_of(work), o.caution(o.speed), o.creep
    )


def _ready(work: Work) -> None:
    work.stand.hold = work[WEIGHT].hold
    if DIRECTION in work.found:
        work.stand.sign = direction_of(work).sign


def fitted(work: Work) -> Model:
    """The model of the strokes.

    Parameters
    ----------
    work : Work
        With all steps done.

    Returns
    -------
    Model
        With its covariance.

    Raises
    ------
    CommissionError
        The strokes do not tell mass and friction apart.
    """
    found: FrictionMap = work[FRICTION]
    made = model.fitted(
        work[STROKES], work.stand.dt, found.mean, found.spread, found.slid, pull_of(work)
    )
    made = made._replace(hold=work.stand.sign * work.stand.hold)
    return made.shaken(mode.found(work[MODES], work.stand.dt))


def settings(work: Work, found: Model, ends: Ends | None) -> dict[str, str]:
    """The machine that was found.

    Parameters
    ----------
    work : Work
        With all steps done.
    found : Model
        Of the strokes.
    ends : Ends | None
        From `home`; None: as the step found them.

    Returns
    -------
    dict[str, str]
        Path to a TOML value.
    """
    where = ends_of(work) if ends is None else ends
    return found_settings.settings(
        found, where, friction=work[FRICTION], strokes=work[STROKES],
        effort=work.options.effort, stand=work.stand,
    )  # fmt: skip


def home(work: Work, found: Model) -> Ends:
    """Creep to the low end, which becomes the machine's 0.

    Parameters
    ----------
    work : Work
        With all steps done.
    found : Model
        Not needed for that.

    Returns
    -------
    Ends
        From where it stands now to the high end.

    Raises
    ------
    CommissionError
        It is held on the way.
    """
    ends, stand = ends_of(work), work.stand
    near = ends.low + 0.02 * ends.travel
    if not go(stand, near, direction_of(work), work.options.caution(work.options.creep)):
        raise CommissionError("the axis was held on its way to the low end: look what is in it")
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
    turned="A positive effort made the encoder count down: exchange the motor's leads, or the "
    "encoder's channels A and B, before this file is used.",
    note="Forces are in volts: the effort that gives them.",
    prepare=_ready,
    model=fitted,
    settings=settings,
    head="One newton below stands for one volt at the D/A.",
    homing="The axis creeps to its low end",
    home=home,
    rows=axis_page.rows,
    estimates=axis_page.estimates,
    doubts=axis_page.doubts,
    figures=axis_page.FIGURES,
    rehearse=rehearsal.rested,
    tune=gains.searched,
    compare=comparing.settling,
    margins=axis_margins.told,
)
