"""The steps of commissioning in their order: announced, done, kept; resumed where they ended.

What a step found is written when it is done, so that an interrupted commissioning can be resumed.
Positions count from where the encoder stood at the start of a session; a new session therefore
looks for the ends again before it moves on, unless only computing is left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from macromicro.commission import exciting, friction, model, probing
from macromicro.commission.friction import FrictionMap
from macromicro.commission.model import Model
from macromicro.commission.probing import Direction, Ends
from macromicro.commission.stand import Caution, Record, Stand
from macromicro.errors import InputError

DIRECTION, ENDS, FRICTION, STROKES = "direction", "ends", "friction", "strokes"


class Options(NamedTuple):
    """What commissioning may do.

    Attributes
    ----------
    effort : float
        Largest effort, V.
    speed : float
        Greatest speed, m/s.
    creep : float
        Speed at which ends are looked for, m/s.
    travel : float
        Longest way on which an end is looked for, m.
    low, high : float | None
        The window, m from where the axis stands at the start; None: its ends are felt for.
    """

    effort: float
    speed: float
    creep: float
    travel: float
    low: float | None = None
    high: float | None = None

    def checked(self) -> Options:
        """These options.

        Returns
        -------
        Options
            As they are.

        Raises
        ------
        InputError
            One that is not accepted.
        """
        for name in ("effort", "speed", "creep", "travel"):
            if not 0.0 < getattr(self, name) < float("inf"):
                raise InputError(f"--{name}", getattr(self, name), "a finite value above zero")
        if self.creep > self.speed:
            raise InputError(
                "--creep", f"{self.creep:g} m/s", f"at most --speed {self.speed:g} m/s"
            )
        if (self.low is None) != (self.high is None):
            raise InputError("--from and --to", "one of them", "both, or none")
        if self.low is not None and self.high is not None and not self.low <= 0.0 <= self.high:
            found = f"{self.low:g} m to {self.high:g} m"
            raise InputError("--from and --to", found, "a window around where the axis stands, 0")
        return self

    def caution(self, speed: float) -> Caution:
        """What may not be passed.

        Parameters
        ----------
        speed : float
            m/s.

        Returns
        -------
        Caution
            Within the window, where there is one.
        """
        every = Caution(self.effort, speed)
        if self.low is None or self.high is None:
            return every
        return every._replace(low=self.low, high=self.high)


@dataclass
class Work:
    """A commissioning under way.

    Attributes
    ----------
    stand : Stand
        The axis.
    options : Options
        What may be done.
    found : dict[str, Any]
        What each step has found, by its name.
    placed : bool
        Whether the ends were found since the encoder's zero was set.
    """

    stand: Stand
    options: Options
    found: dict[str, Any] = field(default_factory=dict)
    placed: bool = False

    @property
    def direction(self) -> Direction:
        """What starts the axis."""
        found: Direction = self.found[DIRECTION]
        return found

    @property
    def ends(self) -> Ends:
        """Where it may go."""
        found: Ends = self.found[ENDS]
        return found

    @property
    def friction(self) -> FrictionMap:
        """What starts it along the travel."""
        found: FrictionMap = self.found[FRICTION]
        return found

    @property
    def strokes(self) -> list[Record]:
        """Its strokes."""
        found: list[Record] = self.found[STROKES]
        return found

    def fitted(self) -> Model:
        """The model of the strokes.

        Returns
        -------
        Model
            With its covariance.

        Raises
        ------
        CommissionError
            The strokes do not tell mass and friction apart.
        """
        found = self.friction
        return model.fitted(self.strokes, self.stand.dt, found.mean, found.spread)


class Step(NamedTuple):
    """A step that moves the axis.

    Attributes
    ----------
    name : str
        For files.
    title : str
        For people.
    intent : Callable[[Work], str]
        What it will do, how far and how hard.
    run : Callable[[Work], Any]
        Does it; gives what it found.
    """

    name: str
    title: str
    intent: Callable[[Work], str]
    run: Callable[[Work], Any]


def _direction_intent(work: Work) -> str:
    o = work.options
    return (
        f"Effort rises from 0 to at most {o.effort:.3g} V, three times each way, and is taken away "
        f"when the encoder moves by {probing.MOVED:.0f} counts. The axis may jump a little."
    )


def _direction(work: Work) -> Direction:
    return probing.direction(work.stand, work.options.caution(float("inf")))


def _ends_intent(work: Work) -> str:
    o = work.options
    push = probing.PUSH * work.direction.surely(o.effort)
    if o.low is not None and o.high is not None:
        return (
            f"The window that was named is used, {o.low * 1e3:.4g} to {o.high * 1e3:.4g} mm from "
            "where the axis stands now. Nothing moves."
        )
    return (
        f"The axis creeps at {o.creep * 1e3:.3g} mm/s to one end and to the other, at most "
        f"{o.travel * 1e3:.4g} mm each way, until a stop holds it against {push:.3g} V."
    )


def _ends(work: Work) -> Ends:
    o = work.options
    if o.low is not None and o.high is not None:
        return Ends(o.low, o.high, False)
    caution = o.caution(o.creep)
    return probing.ends(work.stand, work.direction, caution, o.travel)


def _friction_intent(work: Work) -> str:
    ends = work.ends
    return (
        f"The axis creeps to {friction.PLACES} places between {ends.low * 1e3:.4g} and "
        f"{ends.high * 1e3:.4g} mm; at each, effort rises until it moves, both ways."
    )


def _friction(work: Work) -> FrictionMap:
    caution = work.options.caution(work.options.creep)
    return friction.mapped(work.stand, work.direction, work.ends, caution)


def _strokes_intent(work: Work) -> str:
    o, ends = work.options, work.ends
    least = work.direction.surely(o.effort)
    most = least + exciting.LEVELS[-1] * (o.effort - least)
    return (
        f"{len(exciting.LEVELS) * exciting.STROKES} strokes with efforts up to {most:.3g} V and "
        f"speeds up to {o.speed:.3g} m/s, within {ends.low * 1e3:.4g} and {ends.high * 1e3:.4g} mm."
    )


def _strokes(work: Work) -> list[Record]:
    o = work.options
    caution = o.caution(o.speed)
    return exciting.excite(work.stand, work.direction, work.ends, caution, o.creep)


STEPS: Sequence[Step] = (
    Step(DIRECTION, "sign and breakaway", _direction_intent, _direction),
    Step(ENDS, "end stops and travel", _ends_intent, _ends),
    Step(FRICTION, "friction over position", _friction_intent, _friction),
    Step(STROKES, "strokes for the model", _strokes_intent, _strokes),
)


def left(work: Work) -> list[Step]:
    """The steps that a session has to do.

    Parameters
    ----------
    work : Work
        With what earlier sessions found.

    Returns
    -------
    list[Step]
        Those that are not done; before others that need them the ends again, where the encoder's
        zero is new.
    """
    todo = [s for s in STEPS if s.name not in work.found]
    known = ENDS in work.found
    if known and not work.placed:
        todo.insert(0, STEPS[1])
    return todo


def perform(
    work: Work,
    ask: Callable[[Step, str], None],
    done: Callable[[Step, Any], None],
) -> None:
    """Do all steps that are left.

    Parameters
    ----------
    work : Work
        Options, and what was found before.
    ask : Callable[[Step, str], None]
        Called with each step and what it will do before it moves; raises to end it there.
    done : Callable[[Step, Any], None]
        Called with each step and what it found.

    Raises
    ------
    CommissionError
        A step cannot do its work; says why.
    """
    if DIRECTION in work.found:
        work.stand.sign = work.direction.sign
    for step in left(work):
        ask(step, step.intent(work))
        work.found[step.name] = step.run(work)
        work.placed = work.placed or step.name == ENDS
        done(step, work.found[step.name])
