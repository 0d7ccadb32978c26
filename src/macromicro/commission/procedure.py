"""The steps of commissioning in their order: announced, done, kept; resumed where they ended.

What a step found is written when it is done, so that an interrupted commissioning can be resumed.
Positions count from where the encoder stood at the start of a session; a new session therefore
does a step that finds places again before it moves on, unless only computing is left.

What is commissioned is a `Kind`: its steps, the model of what they found, the machine that follows
from that, and what a page shows of it. `kinds` lists them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from macromicro.commission.stand import Caution, Stand
from macromicro.errors import InputError
from macromicro.place import LENGTH, Place

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# Hears designs that were tried, and the least cost.
Progress = Callable[[int, float], None]


class Robustness(NamedTuple):
    """How robust gains are to what is not known, in words.

    Attributes
    ----------
    rows : tuple[tuple[str, ...], ...]
        Quantity, value, the least of what may be, unit.
    doubts : tuple[str, ...]
        What a person should look at, a sentence each.
    """

    rows: tuple[tuple[str, ...], ...] = ()
    doubts: tuple[str, ...] = ()


class Tuned(NamedTuple):
    """What a search for gains found.

    Attributes
    ----------
    gains : Mapping[str, str]
        Path to a TOML value; none where the rules' gains stay.
    rows : tuple[tuple[str, ...], ...]
        Quantity, value, what it was by the rules, unit.
    doubts : tuple[str, ...]
        What a person should look at, a sentence each.
    """

    gains: Mapping[str, str] = MappingProxyType({})
    rows: tuple[tuple[str, ...], ...] = ()
    doubts: tuple[str, ...] = ()


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
    lowest : float | None
        Lowest effort, V; None: as far below zero as `effort` is above.
    endless : bool
        Whether nothing ends its way: it turns on, within a window that must be named.
    """

    effort: float
    speed: float
    creep: float
    travel: float
    low: float | None = None
    high: float | None = None
    lowest: float | None = None
    endless: bool = False

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
        if self.endless and self.low is None:
            raise InputError("--ends", "none", "with a window, --from and --to")
        if (self.low is None) != (self.high is None):
            raise InputError("--from and --to", "one of them", "both, or none")
        if self.low is not None and self.high is not None and not self.low <= 0.0 <= self.high:
            found = f"{self.low:g} m to {self.high:g} m"
            raise InputError("--from and --to", found, "a window around where the axis stands, 0")
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
    """A commissioning under way.

    Attributes
    ----------
    stand : Stand
        The stage.
    options : Options
        What may be done.
    found : dict[str, Any]
        What each step has found, by its name.
    placed : bool
        Whether places were found since the encoder's zero was set.
    """

    stand: Stand
    options: Options
    found: dict[str, Any] = field(default_factory=dict)
    placed: bool = False

    def __getitem__(self, name: str) -> Any:
        """What a step has found."""
        return self.found[name]


class Step(NamedTuple):
    """A step that moves the stage.

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
    result : Any
        Type of that, a NamedTuple of numbers and tuples of them; None: a list of records.
    places : bool
        Whether it finds places, which a new session has to find again.
    """

    name: str
    title: str
    intent: Callable[[Work], str]
    run: Callable[[Work], Any]
    result: Any
    places: bool = False


class Estimate(NamedTuple):
    """A quantity that was found, and how sure it is.

    Attributes
    ----------
    meaning : str
        In words.
    value : float
        In `unit`.
    half : float
        Half of its 95 % interval.
    unit : str
        For people.
    """

    meaning: str
    value: float
    half: float
    unit: str


class Drawn(NamedTuple):
    """A figure of a page.

    Attributes
    ----------
    title, caption : str
        For people.
    figure : Callable[[Work, Any], Figure]
        Draws it of a commissioning's steps and model.
    """

    title: str
    caption: str
    figure: Callable[[Work, Any], Figure]


def turned_round(work: Work) -> None:
    """Make the stand ready for a new session: efforts are turned round where a step found so.

    Parameters
    ----------
    work : Work
        With what was found before.
    """
    signs = (getattr(one, "sign", None) for one in work.found.values())
    work.stand.sign = float(next((s for s in signs if s is not None), 1.0))


class Kind(NamedTuple):
    """What can be commissioned.

    Attributes
    ----------
    name : str
        Of the machine that it gives, as a settings file names it.
    steps : Sequence[Step]
        In their order; what one of the first found has a `sign`.
    model : Callable[[Work], Any]
        The model of what the steps found.
    settings : Callable[[Work, Any, Any], dict[str, str]]
        The machine of steps, model and what `home` found (None before): paths and TOML values.
    estimates : Callable[[Any], dict[str, Estimate]]
        What the model says, by short names.
    turned : str, optional
        What a person should do where the sign is -1.
    note : str, optional
        What units the results are in, for the page.
    prepare : Callable[[Work], None], optional
        Makes the stand ready for the steps that are left, by what was found before.
    head : str, optional
        First lines of the machine's file, beside the estimates.
    homing : str, optional
        What the stage does before it is verified.
    home : Callable[[Work, Any], Any], optional
        Brings it to the machine's 0; gives what `settings` takes.
    rows : Callable[[Work], list[tuple[str, ...]]], optional
        What the steps found: quantity, value, half interval, unit.
    doubts : Callable[[Work, Any], list[str]], optional
        What a person should look at.
    figures : Mapping[str, Drawn], optional
        By the name of the file.
    place : Place, optional
        What its places are counted in.
    rehearse : Callable[[Any, Any], float | None] | None, optional
        From the machine and its settings to the tolerance within which its model comes to rest, m;
        None where that which follows will do, or there is no such rehearsal.
    tune : Callable[[Any, Any, Progress], Tuned] | None, optional
        From the settings that were found, with the tolerance of the rehearsal, and the model to
        gains that do better on it; hears of designs that were tried.
    compare : Callable[[Stand, Any, Any], tuple[float, str]] | None, optional
        From the stage at the machine's 0, the machine and its settings to how long it takes to
        settle, s, and what its guard saw, after moves on the stage. Gains of `tune` stay only where
        that is less by them; None: they always stay.
    margins : Callable[[Any, Any], Robustness], optional
        From the settings that were found and the model to how robust the gains are.
    one_way : bool, optional
        Whether its efforts have a lowest one of their own; else they are as large both ways.
    """

    name: str
    steps: Sequence[Step]
    model: Callable[[Work], Any]
    settings: Callable[[Work, Any, Any], dict[str, str]]
    estimates: Callable[[Any], dict[str, Estimate]]
    turned: str = (
        "A positive effort made the reading fall: exchange the drive's leads, or turn the sensor's "
        "sign, before this file is used."
    )
    note: str = ""
    prepare: Callable[[Work], None] = turned_round
    head: str = ""
    homing: str = "The stage stays where it stands, which is its 0,"
    home: Callable[[Work, Any], Any] = lambda work, model: None
    rows: Callable[[Work], list[tuple[str, ...]]] = lambda work: []
    doubts: Callable[[Work, Any], list[str]] = lambda work, model: []
    figures: Mapping[str, Drawn] = MappingProxyType({})
    place: Place = LENGTH
    rehearse: Callable[[Any, Any], float | None] | None = None
    tune: Callable[[Any, Any, Progress], Tuned] | None = None
    compare: Callable[[Stand, Any, Any], tuple[float, str]] | None = None
    margins: Callable[[Any, Any], Robustness] = lambda settings, model: Robustness()
    one_way: bool = False


def left(kind: Kind, work: Work) -> list[Step]:
    """The steps that a session has to do.

    Parameters
    ----------
    kind : Kind
        What is commissioned.
    work : Work
        With what earlier sessions found.

    Returns
    -------
    list[Step]
        Those that are not done; before others that need them the places again, where the encoder's
        zero is new.
    """
    todo = [s for s in kind.steps if s.name not in work.found]
    again = [s for s in kind.steps if s.places and s.name in work.found and not work.placed]
    return [*again, *todo]


def sign(kind: Kind, work: Work) -> float:
    """Which way it counts.

    Parameters
    ----------
    kind : Kind
        What is commissioned.
    work : Work
        With the step done that found it.

    Returns
    -------
    float
        1, or -1 where a positive effort made the encoder count down.
    """
    signs = (getattr(work.found.get(step.name), "sign", None) for step in kind.steps)
    return float(next(s for s in signs if s is not None))


def perform(
    kind: Kind,
    work: Work,
    ask: Callable[[Step, str], None],
    done: Callable[[Step, Any], None],
) -> None:
    """Do all steps that are left.

    Parameters
    ----------
    kind : Kind
        What is commissioned.
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
    if kind.steps[0].name in work.found:
        kind.prepare(work)
    for step in left(kind, work):
        ask(step, step.intent(work))
        work.found[step.name] = step.run(work)
        work.placed = work.placed or step.places
        done(step, work.found[step.name])
