"""Opens the rig of ``--rig``: the twin, or one from a user's module."""

from __future__ import annotations

import inspect
import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from macromicro.control.calibration import Calibration
from macromicro.control.settings import Control
from macromicro.errors import InputError, ProblemError
from macromicro.rig import _comedi, _nidaqmx
from macromicro.rig.board import named as boards
from macromicro.rig.board.named import Boarded
from macromicro.rig.cards import _wiring
from macromicro.rig.cards._rig import CardRig
from macromicro.rig.limits import Limits
from macromicro.rig.session import BENCH, KILN, KINDS, Fixture
from macromicro.schema import plugins
from macromicro.schema.text import printable

T = TypeVar("T")

TWIN = "twin"
OPTION = "--rig"
GROUP = "macromicro.rigs"  # of the entry points of installed packages
ACCEPTED = (
    "twin, MODULE:FACTORY with a module of yours and a function in it that takes a seed and "
    "returns the rig, FILE.toml with the wiring of a card, board with --port, or, for `run`, "
    "replay:FILE with a recording; with --config of a machine xy two of them, + between "
    "(docs/rigs.md)"
)
CARDS = {"comedi": _comedi, "nidaqmx": _nidaqmx}
_METHODS = ("read", "write", "stop", "__enter__", "__exit__")


@dataclass(frozen=True)
class Factory:
    """A user's function, by name, so that a process may hand it to another.

    Examples
    --------
    >>> from macromicro.rig.opening import Factory
    >>> str(Factory("mylab", "rig"))
    'mylab:rig'
    """

    module: str  #: dotted name
    function: str  #: its name in the module

    def __call__(self, seed: int) -> Any:
        """The rig that the function makes. InputError if it is not to be had."""
        made = _found(self.module, self.function)(int(seed))
        _check(made, self)
        return made

    def check(self) -> None:
        """Import it, without calling it.

        Raises
        ------
        InputError
            It cannot be found or loaded.
        """
        _found(self.module, self.function)

    def __str__(self) -> str:
        return f"{self.module}:{self.function}"


@dataclass(frozen=True)
class Carded:
    """A card, by the file of its wiring.

    Examples
    --------
    >>> from pathlib import Path
    >>> from macromicro.rig.opening import Carded
    >>> str(Carded(Path("card.toml")))
    'card.toml'
    """

    path: Path  #: TOML file

    def __call__(self, seed: int) -> CardRig:
        """The rig; not opened. InputError for what the file gets wrong."""
        wired = _wiring.read_wiring(self.path, {name: card.KEYS for name, card in CARDS.items()})
        if wired.keeps_count and wired.card == "nidaqmx":
            accepted = "false with nidaqmx: its counters begin at 0 when they are opened"
            raise InputError(f"{self.path}: keeps_count", "true", accepted)
        return CardRig(wired, CARDS[wired.card].Card())

    def check(self) -> None:
        """Read the file, without opening the card.

        Raises
        ------
        InputError
            It cannot be read, or is wrong.
        """
        self(0)

    def __str__(self) -> str:
        return str(self.path)


AnyFactory = Factory | Carded | Boarded


def open_rig(
    name: str,
    seed: int = 0,
    *,
    alone: bool = False,
    limits: Limits | None = None,
    gains: Control | None = None,
) -> Fixture:
    """The rig that "MODULE:FACTORY" or the wiring of a card names, ready to be opened for runs.

    The module is looked for in the working directory as well. The factory is called once to see
    what the rig has: `channels`; and where it has them, `kind` ("bench", "kiln" or "cycle"), `dt`
    (s), `rest` (s), `limits`, `calibration` (the table) and `pitch` (m) as in `Fixture`, and
    `counted`, `timed` (bool). The twin is no `Fixture`: callers know it by its name.

    Parameters
    ----------
    name : str
        "MODULE:FACTORY" or "FILE.toml".
    seed : int, optional
        Given to the factory.
    alone : bool, optional
        Whether it is one stage, whose law runs at any period; else a bench has that of its laws.
    limits : Limits | None, optional
        Of the guard of a board, where it is one; None: those of the thesis' machine.
    gains : Control | None, optional
        Of the laws of a board that closes the loop; None: those of the thesis.

    Returns
    -------
    Fixture
        The rig, and how to open it.

    Raises
    ------
    InputError
        It cannot be loaded, is no rig, or lacks the law of `gains`.
    """
    factory = named(name)
    if isinstance(factory, Boarded):
        if gains is not None:
            boards.check_laws(factory, gains)
        factory = replace(factory, limits=limits, gains=gains, yielding=alone)
    rig = factory(seed)
    kind = getattr(rig, "kind", BENCH)
    if not isinstance(kind, str) or kind not in KINDS:
        raise InputError(f"{OPTION} {factory}, kind", printable(kind), " or ".join(KINDS))
    known = KINDS[kind]
    fixture = Fixture(
        str(factory),
        kind,
        factory,
        _channels(rig, factory, known.channels),
        _number(rig, factory, "dt", known.dt),
        _number(rig, factory, "rest", 0.0),
        _own(rig, factory, "limits", Limits),
        _own(rig, factory, "calibration", Calibration),
        counted=_own(rig, factory, "counted", bool) or False,
        timed=_own(rig, factory, "timed", bool) or False,
    )
    if kind != KILN and fixture.dt != known.dt and not (alone and kind == BENCH):
        accepted = f"{known.dt:g} s for a {kind}: its control laws and procedures have this period"
        raise InputError(f"{OPTION} {factory}, dt", f"{fixture.dt:g} s", accepted)
    return fixture._replace(pitch=_number(rig, factory, "pitch", fixture.pitch))


def named(name: str) -> Factory | Carded | Boarded:
    """The factory that "MODULE:FACTORY", "FILE.toml" or "board:PORT" names, not looked for.

    Parameters
    ----------
    name : str
        Either of them, or the name of an installed entry point of the group `GROUP`.

    Returns
    -------
    Factory | Carded | Boarded
        Module and function, the file, or the port.

    Raises
    ------
    InputError
        Another text.

    Examples
    --------
    >>> from macromicro.rig.opening import named
    >>> named("mylab:rig")
    Factory(module='mylab', function='rig')
    """
    if boards.is_board(name):
        return boards.parse(name)
    if name.endswith(_wiring.SUFFIX):
        return Carded(Path(name))
    place = plugins.place(name, GROUP)
    if place is None or not plugins.is_plugin_name(place):
        others = plugins.entry_points(GROUP)
        offered = f"; installed: {', '.join(sorted(others))}" if others else ""
        raise InputError(OPTION, printable(name) or "nothing", ACCEPTED + offered)
    module, _, function = place.partition(":")
    return Factory(module, function)


def _found(module: str, function: str) -> Any:
    where = f"{OPTION} {module}:{function}"
    made = plugins.load(f"{module}:{function}", where, "a function", inspect.isfunction)
    if not _takes_seed(made):
        raise InputError(where, printable(made), "a function that takes a seed")
    return made


def _takes_seed(function: Any) -> bool:
    try:
        inspect.signature(function).bind(0)
    except TypeError:  # of what cannot be called, too
        return False
    except ValueError:  # written in C, without a signature
        return True
    return True


def _check(rig: Any, factory: AnyFactory) -> None:
    """Check that `rig` has the shape of `types.Rig`."""
    missing = [n for n in _METHODS if not callable(getattr(rig, n, None))]
    missing += [n for n in ("channels", "clock") if not hasattr(rig, n)]
    if not missing:
        missing = [f"clock.{n}" for n in ("now", "wait") if not hasattr(rig.clock, n)]
    if missing:
        problem = f"returned {printable(type(rig).__name__)} without {', '.join(missing)}"
        raise ProblemError(f"{OPTION} {factory}", problem, "Return a rig as in docs/rigs.md.")


def _channels(rig: Any, factory: AnyFactory, known: tuple[str, ...]) -> tuple[str, ...]:
    named = rig.channels
    several = isinstance(named, Collection) and not isinstance(named, str)
    if not several or not all(isinstance(c, str) for c in named):
        accepted = f"a tuple of names, of {', '.join(known)}"
        raise InputError(f"{OPTION} {factory}, channels", printable(named), accepted)
    strange = [c for c in named if c not in ("t", *known)]
    if strange:
        accepted = f"channels of {', '.join(known)}"
        raise InputError(f"{OPTION} {factory}, channels", printable(strange[0]), accepted)
    return tuple(c for c in named if c != "t")


def _number(rig: Any, factory: AnyFactory, name: str, default: float) -> float:
    """The rig's attribute `name`: a number >= 0, or > 0 if the default is."""
    value = getattr(rig, name, default)
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not math.isfinite(value) or value < 0.0 or (default > 0.0 and value == 0.0):
        accepted = "a number above 0" if default > 0.0 else "a number, 0 or more"
        raise InputError(f"{OPTION} {factory}, {name}", printable(value), accepted)
    return float(value)


def _own(rig: Any, factory: AnyFactory, name: str, kind: type[T]) -> T | None:
    """The rig's attribute `name` of this type, or None."""
    value = getattr(rig, name, None)
    if value is not None and not isinstance(value, kind):
        accepted = f"a {kind.__module__}.{kind.__name__}"
        raise InputError(f"{OPTION} {factory}, {name}", printable(value), accepted)
    return value
