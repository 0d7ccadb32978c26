"""Steps of commissioning in order: announced, done, saved and resumed.

A `Kind` has steps, the model of their results, the machine that follows and its page (`kinds` lists
them). Positions count from the encoder at the start of a session, so a new session repeats a step
that finds positions before it moves on, unless only computing is left.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from macromicro.commission.stand import Caution, Stand
from macromicro.errors import InputError, ProblemError
from macromicro.place import LENGTH, Place

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# Hears designs that were tried, and the least cost.
Progress = Callable[[int, float], None]


class Robustness(NamedTuple):
    """How robust gains are to what is not known, in words.

    Examples
    --------
    >>> from macromicro.commission.procedure import Robustness
    >>> Robustness(doubts=("The loop is unstable with a load of 2 kg.",)).rows
    ()
    """

    rows: tuple[tuple[str, ...], ...] = ()  #: quantity, value, the least of what may be, unit
    doubts: tuple[str, ...] = ()  #: points to check, a sentence each


class Tuned(NamedTuple):
    """What a search for gains found.

    Examples
    --------
    >>> from macromicro.commission.procedure import Tuned
    >>> Tuned({"pi.integral": '"12 V/(m*s)"'}).gains["pi.integral"]
    '"12 V/(m*s)"'
    """

    #: path to a TOML value; none where the rules' gains stay
    gains: Mapping[str, str] = MappingProxyType({})
    rows: tuple[tuple[str, ...], ...] = ()  #: quantity, value, what it was by the rules, unit
    doubts: tuple[str, ...] = ()  #: points to check, a sentence each


class Options(NamedTuple):
    """What commissioning may do.

    Examples
    --------
    >>> from macromicro.commission.procedure import Options
    >>> options = Options(effort=5.0, speed=0.2, creep=0.02, travel=0.5).checked()  # V, m/s, m/s, m
    >>> options.bottom
    -5.0
    """

    effort: float  #: largest effort, V
    speed: float  #: greatest speed, m/s
    creep: float  #: speed at which ends are looked for, m/s
    travel: float  #: longest way on which an end is looked for, m
    low: float | None = None  #: the window, m from where the axis stands at the start
    high: float | None = None  #: None: its ends are felt for
    lowest: float | None = None  #: lowest effort, V; None: as far below zero as `effort` is above
    #: whether nothing ends its way: it turns on, within a window that must be named
    endless: bool = False

    def checked(self, place: Place = LENGTH) -> Options:
        """These options.

        Parameters
        ----------
        place : Place, optional
            Units of positions in messages.

        Returns
        -------
        Options
            As they are.

        Raises
        ------
        InputError
            A value is not accepted.
        ProblemError
            Options do not go together.
        """
        for name in ("effort", "speed", "creep", "travel"):
            if not 0.0 < getattr(self, name) < float("inf"):
                raise InputError(f"--{name}", getattr(self, name), "a finite value above zero")
        if self.creep > self.speed:
            accepted = f"at most --speed {place.told(self.speed, 'm/s')}"
            raise InputError("--creep", place.told(self.creep, "m/s"), accepted)
        if self.endless and self.low is None:
            remedy = "Add --from and --to."
            raise ProblemError("--ends none", "continuous rotation needs a window", remedy)
        if (self.low is None) != (self.high is None):
            remedy = "Give both, or none."
            raise ProblemError("--from and --to", "only one of them is given", remedy)
        if self.low is not None and self.high is not None and not self.low <= 0.0 <= self.high:
            window = f"from {place.told(self.low)} to {place.told(self.high)}"
            found = f"{window} excludes the present position, 0"
            raise ProblemError("--from and --to", found, "Give a window around it.")
        if self.lowest is not None and not -float("inf") < self.lowest <= 0.0:
            raise InputError("--lowest", f"{self.lowest:g} V", "a finite value, at most 0 V")
        return self

    @property
    def bottom(self) -> float:
        """Lowest effort, V."""
        return -self.effort if self.lowest is None else self.lowest

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
        every = Caution(self.effort, speed, lowest=self.bottom)
        if self.low is None or self.high is None:
            return every
        return every._replace(low=self.low, high=self.high)


@dataclass
class Work:
    """A commissioning under way."""

    stand: Stand  #: the stage
    options: Options  #: limits and options
    found: dict[str, Any] = field(default_factory=dict)  #: results by step
    placed: bool = False  #: positions found in this session

    def __getitem__(self, name: str) -> Any:
        return self.found[name]


class Step(NamedTuple):
    """A step that moves the stage.

    Examples
    --------
    >>> from macromicro.commission.procedure import Step
    >>> def drift(work):
    ...     return work.stand.drive(lambda t, x, v: 0.0, 1.0, work.options.caution(0.01))
    >>> step = Step("drift", "Drift at rest", lambda work: "It stays at 0 V for 1 s.", drift, None)
    >>> step.intent(None)
    'It stays at 0 V for 1 s.'
    """

    name: str  #: for files
    title: str  #: for people
    intent: Callable[[Work], str]  #: announcement: motion, distance and effort
    run: Callable[[Work], Any]  #: does it; gives what it found
    result: (
        Any  #: type of that, a NamedTuple of numbers and tuples of them; None: a list of records
    )
    places: bool = False  #: finds positions, which a new session repeats


# Said on the page of each kind whose records do not show all of its errors.
SIMULATED = (
    "Intervals include errors that no record shows; these come from simulated machines, not from "
    "this one."
)


class Estimate(NamedTuple):
    """A quantity that was found, and how sure it is.

    Examples
    --------
    >>> from macromicro.commission.procedure import Estimate
    >>> mass = Estimate("moving mass", 1.2, 0.1, "kg")
    >>> f"{mass.value} +- {mass.half} {mass.unit}"
    '1.2 +- 0.1 kg'
    """

    meaning: str  #: in words
    value: float  #: in `unit`
    half: float  #: half of its 95 % interval
    unit: str  #: for people


class Drawn(NamedTuple):
    """A figure of a page.

    Examples
    --------
    >>> from macromicro.commission.procedure import Drawn
    >>> Drawn("Friction", "Force over speed.", lambda work, model: None).title
    'Friction'
    """

    #: title, caption: for people
    title: str
    caption: str
    figure: Callable[[Work, Any], Figure]  #: draws it of a commissioning's steps and model


def turned_round(work: Work) -> None:
    """Reverse the efforts of the stand for a new session where an earlier step requires it.

    Parameters
    ----------
    work : Work
        With earlier results.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from macromicro.commission.procedure import Options, Work, turned_round
    >>> options = Options(effort=5.0, speed=0.2, creep=0.02, travel=0.5)  # V, m/s, m/s, m
    >>> stand = SimpleNamespace(sign=1.0)
    >>> turned_round(Work(stand, options, {"direction": SimpleNamespace(sign=-1.0)}))
    >>> stand.sign
    -1.0
    """
    work.stand.sign = _sign(work.found.values())


class Kind(NamedTuple):
    """What can be commissioned."""

    name: str  #: of the machine that it gives, as a settings file names it
    steps: Sequence[Step]  #: in their order; what one of the first found has a `sign`
    model: Callable[[Work], Any]  #: the model of what the steps found
    #: the machine of steps, model and what `home` found (None before): paths and TOML values
    settings: Callable[[Work, Any, Any], dict[str, str]]
    estimates: Callable[[Any], dict[str, Estimate]]  #: quantities of the model, by short names
    #: what a person should do where the sign is -1
    turned: str = (
        "A positive effort made the reading fall: swap the drive's leads, or reverse the "
        "sensor's sign, before using this file."
    )
    note: str = ""  #: units of the results, for the page
    #: makes the stand ready for the steps that are left, by what was found before
    prepare: Callable[[Work], None] = turned_round
    head: str = ""  #: first lines of the machine's file, beside the estimates
    #: what the stage does before it is verified
    homing: str = "The stage takes its present position as 0"
    #: brings it to the machine's 0; gives what `settings` takes
    home: Callable[[Work, Any], Any] = lambda work, model: None
    #: what the steps found: quantity, value, half interval, unit
    rows: Callable[[Work], list[tuple[str, ...]]] = lambda work: []
    #: what a person should look at
    doubts: Callable[[Work, Any], list[str]] = lambda work, model: []
    figures: Mapping[str, Drawn] = MappingProxyType({})  #: by file name
    place: Place = LENGTH  #: unit of positions
    #: from the machine and its settings to the tolerance within which its model comes to rest, m;
    #: None where that which follows will do, or there is no such rehearsal
    rehearse: Callable[[Any, Any], float | None] | None = None
    #: from the settings that were found, with the tolerance of the rehearsal, and the model to
    #: gains that do better on it; hears of designs that were tried
    tune: Callable[[Any, Any, Progress], Tuned] | None = None
    #: from the stage at the machine's 0, the machine and its settings to how long it takes to
    #: settle, s, and what its guard saw, after moves on the stage. Gains of `tune` stay only where
    #: that is less by them; None: they always stay
    compare: Callable[[Stand, Any, Any], tuple[float, str]] | None = None
    #: from the settings that were found and the model to how robust the gains are
    margins: Callable[[Any, Any], Robustness] = lambda settings, model: Robustness()
    #: whether its efforts have a lowest one of their own; else they are as large both ways
    one_way: bool = False


def left(kind: Kind, work: Work) -> list[Step]:
    """The steps that a session has to do.

    Parameters
    ----------
    kind, work : Kind, Work
        What is commissioned; results of earlier sessions.

    Returns
    -------
    list[Step]
        Unfinished steps; with a new zero of the encoder, first those that find positions again.

    Examples
    --------
    >>> from macromicro.commission import piezo
    >>> from macromicro.commission.procedure import Options, Work, left
    >>> options = Options(effort=5.0, speed=0.2, creep=0.02, travel=0.5)  # V, m/s, m/s, m
    >>> [step.name for step in left(piezo.KIND, Work(None, options))]
    ['gain', 'reach', 'swings', 'steps']
    """
    todo = [s for s in kind.steps if s.name not in work.found]
    again = [s for s in kind.steps if s.places and s.name in work.found and not work.placed]
    return [*again, *todo]


def sign(kind: Kind, work: Work) -> float:
    """Direction of the encoder.

    Parameters
    ----------
    kind, work : Kind, Work
        What is commissioned; the result of the step that finds the direction.

    Returns
    -------
    float
        1, or -1 where a positive effort made the encoder count down; 1 where no step finds it.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from macromicro.commission import piezo
    >>> from macromicro.commission.procedure import Options, Work, sign
    >>> options = Options(effort=5.0, speed=0.2, creep=0.02, travel=0.5)  # V, m/s, m/s, m
    >>> first = {piezo.KIND.steps[0].name: SimpleNamespace(sign=-1.0)}
    >>> sign(piezo.KIND, Work(None, options, first))
    -1.0
    """
    return _sign(work.found.get(step.name) for step in kind.steps)


def _sign(results: Iterable[Any]) -> float:
    """The first direction among results; 1 where none has found one."""
    signs = (getattr(one, "sign", None) for one in results)
    return float(next((s for s in signs if s is not None), 1.0))


def perform(
    kind: Kind, work: Work, ask: Callable[[Step, str], None], done: Callable[[Step, Any], None]
) -> None:
    """Do all steps that are left.

    Parameters
    ----------
    kind, work : Kind, Work
        What is commissioned; options and earlier results.
    ask, done : Callable[[Step, str], None], Callable[[Step, Any], None]
        Called before each step with its intent (raises to stop there), and after it with its
        result.

    Raises
    ------
    CommissionError
        A step cannot do its work.

    Examples
    --------
    >>> from macromicro.commission.procedure import Kind, Options, Step, Work, perform
    >>> step = Step("gain", "Gain", lambda work: "It moves by 1 mm.", lambda work: 35.0, None)
    >>> kind = Kind("mine", [step], model=dict, settings=dict, estimates=dict)
    >>> work = Work(None, Options(effort=5.0, speed=0.2, creep=0.02, travel=0.5))
    >>> perform(kind, work, ask=lambda step, intent: print(intent), done=lambda step, found: None)
    It moves by 1 mm.
    >>> work["gain"]
    35.0
    """
    if kind.steps[0].name in work.found:
        kind.prepare(work)
    for step in left(kind, work):
        ask(step, step.intent(work))
        work.found[step.name] = step.run(work)
        work.placed = work.placed or step.places
        done(step, work.found[step.name])
