"""Parameters with units, meanings and bounds, and the one check of a value.

A parameter set is a ``NamedTuple`` whose fields are annotated with `Par`; the value
itself stays a plain float in SI (except encoder counts and deg C). Settings files, sweep
axes, batch variants, live gains, SCPI and the page all use the parameter's own bounds.
"""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, NamedTuple, TypeGuard, TypeVar, cast, get_type_hints

import numpy as np
import numpy.typing as npt

from macromicro.errors import InputError, ProblemError
from macromicro.schema.text import printable
from macromicro.units import convert, quantity, remedy, shown

ASSUMED = "bench assumption"
S = TypeVar("S")
NO_UNIT = ("", "1", "-")
MAX_WORD = 100  # characters


@dataclass(frozen=True)
class Par:
    """Unit, meaning, source and bounds of a parameter.

    Examples
    --------
    >>> from macromicro.schema.par import Par
    >>> travel = Par("m", "travel of the stage", shown="mm", lo=0.0, hi=0.2)
    >>> travel.spoken(0.15), travel.taken(150.0)
    ('150 mm', 0.15)
    """

    unit: str  #: unit in which the value is stored
    meaning: str  #: what it is, in words
    source: str = ASSUMED  #: A section of the thesis, or `ASSUMED`
    shown: str = ""  #: unit that a person reads, of the same dimension; "" for `unit`
    #: lo, hi: inclusive bounds, in `unit`
    lo: float = -math.inf
    hi: float = math.inf
    positive: bool = False  #: whether it must be strictly above zero
    choices: tuple[str, ...] = ()  #: accepted words of a text parameter; none: any word

    def spoken(self, value: Any, digits: int = 6) -> str:
        """A value in the displayed unit, as text.

        Parameters
        ----------
        value : Any
            In `unit`, or anything that is not a number.
        digits : int, optional
            Largest number of significant digits.

        Returns
        -------
        str
            A number in `shown`, anything else unchanged.
        """
        if not finite(value):
            return printable(value)
        return shown(value, self.unit, self.shown, digits)

    @property
    def read_in(self) -> str:
        """Unit in which clients read and write it."""
        return self.shown or self.unit

    def given(self, value: Any) -> Any:
        """A stored value as a plain number for clients.

        Parameters
        ----------
        value : Any
            In `unit`, or anything that is not a finite number.

        Returns
        -------
        Any
            A number in `read_in`, anything else unchanged.
        """
        return (
            value if not (self.shown and finite(value)) else convert(value, self.unit, self.shown)
        )

    def taken(self, value: Any) -> Any:
        """A client's plain number as a stored value, without a check.

        Parameters
        ----------
        value : Any
            In `read_in`, or anything that is not a finite number.

        Returns
        -------
        Any
            A number in `unit`, anything else unchanged.
        """
        return (
            value if not (self.shown and finite(value)) else convert(value, self.shown, self.unit)
        )


FOLLOWS = "another value, or other values that it is derived from"


class Entry(NamedTuple):
    """One parameter of a tree."""

    path: str  #: dotted
    par: Par  #: what it is
    #: in the stored unit; its type is the parameter's: true or false, text, a whole number, a
    #: number, or a list of numbers
    value: Any

    @property
    def number(self) -> bool:
        """Whether it is one number, which a sweep can vary."""
        return not isinstance(self.value, bool | str | tuple)

    @property
    def accepted(self) -> str:
        """The accepted values, in words."""
        par = self.par
        if isinstance(self.value, bool):
            return "true or false"
        if isinstance(self.value, str):
            return " or ".join(map(repr, par.choices)) or f"text of at most {MAX_WORD} characters"
        low, high = par.spoken(par.lo, 10), par.spoken(par.hi, 10)
        above = "above zero" if par.positive and par.lo <= 0.0 else ""
        words = [above] if above else []
        if not above and par.lo > -math.inf:
            words = [f"from {low} to {high}" if par.hi < math.inf else f"{low} or more"]
        if par.hi < math.inf and (above or not words):
            words.append(f"at most {high}")
        bounds = " and ".join(words)
        if isinstance(self.value, int):
            return f"a whole number {bounds}".strip()
        return bounds or "a finite number"

    def admits(self, values: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Which of some stored values the parameter accepts.

        Parameters
        ----------
        values : npt.ArrayLike
            In the stored unit, of any shape.

        Returns
        -------
        ndarray of bool
            In the shape of `values`.
        """
        found = np.asarray(values, dtype=np.float64)
        good = np.isfinite(found) & (self.par.lo <= found) & (found <= self.par.hi)
        if self.par.positive:
            good &= found > 0.0
        if isinstance(self.value, int):
            good &= found == np.floor(found)
        return good

    def check(self, value: Any, where: str) -> Any:
        """Check a stored value, and convert it to the parameter's type.

        Parameters
        ----------
        value : Any
            In the stored unit.
        where : str
            File and key, for the message.

        Returns
        -------
        Any
            The value as bool, str, int or float.

        Raises
        ------
        InputError
            Wrong type, not finite, out of the bounds, or none of the choices.
        """
        if isinstance(self.value, bool):
            right = isinstance(value, bool)
        elif isinstance(self.value, str):
            right = isinstance(value, str) and (
                value in self.par.choices
                if self.par.choices
                else len(value) <= MAX_WORD and value.isprintable()
            )
        else:
            right = finite(value) and bool(self.admits(value))
        if not right:
            raise InputError(where, self.par.spoken(value), self.accepted)
        return type(self.value)(value)

    def read(self, raw: object, where: str) -> Any:
        """Convert a value of a TOML file to the stored value.

        Parameters
        ----------
        raw : object
            Text with a unit, or a plain value.
        where : str
            File and key, for the message.

        Returns
        -------
        Any
            In the stored unit, as the parameter's type.

        Raises
        ------
        InputError
            As for `check`, and for a missing or a wrong unit.
        """
        if isinstance(self.value, tuple):
            return self._list(raw, where)
        if not self.number:
            return self.check(raw, where)
        if isinstance(raw, bool) or not isinstance(raw, int | float | str):
            raise InputError(where, printable(raw), remedy(self.par.read_in))
        written = raw if isinstance(raw, str) else printable(raw)
        value = quantity(written, self.par.unit, where, self.par.shown)
        if not self.admits(value):
            raise InputError(where, written, self.accepted)
        if isinstance(raw, int) and isinstance(self.value, int):
            return raw  # beyond 2^53 a float is another number
        return type(self.value)(value)

    def _list(self, raw: object, where: str) -> tuple[Any, ...]:
        if not isinstance(raw, list) or len(raw) < 2:
            example = printable(self.text or "a list")
            accepted = f"a list of two values or more, such as {example}"
            raise InputError(where, printable(raw), accepted)
        one = self._replace(value=self.value[0])
        return tuple(one.read(item, f"{where}, item {i}") for i, item in enumerate(raw, 1))

    @property
    def text(self) -> str | None:
        """The value as TOML; None if it cannot be written (NaN: not set)."""
        par, value = self.par, self.value
        if isinstance(value, tuple):
            items = [self._replace(value=item).text for item in value]
            return None if None in items else f"[{', '.join(str(item) for item in items)}]"
        if isinstance(value, bool):
            return str(value).lower()
        if isinstance(value, str):
            return _quote(value)
        if not isinstance(value, int | float) or not math.isfinite(value):
            return None
        plain = (par.shown or par.unit) in NO_UNIT
        if isinstance(value, int) and plain:
            return str(value)
        text = shown(value, par.unit, par.shown)
        return text if plain else _quote(text)


def _quote(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def finite(value: object) -> TypeGuard[int | float]:
    """Whether a value is a plain, finite number.

    Parameters
    ----------
    value : object
        Anything.

    Returns
    -------
    bool
        False for a boolean, and for an integer beyond the range of floats.

    Examples
    --------
    >>> from macromicro.schema.par import finite
    >>> finite(2.5), finite(float("nan")), finite(True)
    (True, False, False)
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def is_set(value: object) -> bool:
    """Whether a value is a parameter set, a ``NamedTuple``.

    Parameters
    ----------
    value : object
        Anything.

    Returns
    -------
    bool
        True for an instance, False for the class.

    Examples
    --------
    >>> from macromicro.motion import Segment
    >>> from macromicro.schema.par import is_set
    >>> is_set(Segment(1.0, 0.0, 0.0, 0.0, 0.0)), is_set((1.0, 2.0))
    (True, False)
    """
    return isinstance(value, tuple) and hasattr(value, "_fields")


@cache
def _hints(kind: type) -> dict[str, Any]:
    """A set's annotations, evaluated once: a study reads them for every machine."""
    return get_type_hints(kind, include_extras=True)


def entries(tree: Any, prefix: str = "") -> Iterator[Entry]:
    """All parameters of a (nested) parameter set, in order.

    A set may have a method ``also() -> dict[field, words]``: further choices of its text
    parameters.

    Parameters
    ----------
    tree : Any
        A set of parameters.
    prefix : str, optional
        Put before its paths, with its dot.

    Yields
    ------
    Entry
        A parameter with its dotted path and value.

    Examples
    --------
    >>> from macromicro import Settings
    >>> from macromicro.schema.par import entries
    >>> first = next(entries(Settings().bench.friction, "bench.friction."))
    >>> first.path, first.par.spoken(first.value), first.accepted
    ('bench.friction.coulomb', '10.485 N', '0 N or more')
    """
    kind: Any = type(tree)
    hints = _hints(kind)
    words: dict[str, tuple[str, ...]] = getattr(tree, "also", dict)()
    for name in tree._fields:
        value = getattr(tree, name)
        path = f"{prefix}{name}"
        if is_set(value):
            yield from entries(value, f"{path}.")
            continue
        for note in getattr(hints[name], "__metadata__", ()):
            if isinstance(note, Par):
                more = words.get(name, ())
                par = replace(note, choices=(*note.choices, *more)) if more else note
                yield Entry(path, par, value)


def with_sets(sets: Mapping[str, Any], before: str) -> Callable[[type[S]], type[S]]:
    """Decorator of a parameter set that adds sets to its fields.

    Parameters
    ----------
    sets : Mapping[str, Any]
        Field name to default; existing fields are left out. All own fields have defaults.
    before : str
        The field before which they are inserted.

    Returns
    -------
    Callable[[type[S]], type[S]]
        From the class to the one with the sets.

    Examples
    --------
    >>> from macromicro import Settings
    >>> from macromicro.schema.par import with_sets
    >>> from macromicro.plant.friction import Friction
    >>> Extended = with_sets({"seal": Friction()}, before="guard")(Settings)
    >>> Extended._fields, Extended().seal.coulomb
    (('bench', 'sensors', 'controller', 'seal', 'guard', 'travel', 'given'), 10.485)
    """

    def made(base: type[S]) -> type[S]:
        known = getattr(base, "__annotations__", {})
        new = {name: (type(value), value) for name, value in sets.items() if name not in known}
        return extended(base, new, before)

    return made


def extended(base: type[S], new: Mapping[str, tuple[Any, Any]], before: str) -> type[S]:
    """A parameter set with further fields.

    Parameters
    ----------
    base : type[S]
        All its own fields have defaults.
    new : Mapping[str, tuple[Any, Any]]
        Field name to annotation and default.
    before : str
        The field before which they are inserted.

    Returns
    -------
    type[S]
        A ``NamedTuple`` of the same name, module and methods.

    Examples
    --------
    >>> from macromicro import Settings
    >>> from macromicro.schema.par import extended
    >>> Extended = extended(Settings, {"payload": (float, 0.5)}, before="guard")
    >>> Extended().payload
    0.5
    """
    fields: dict[str, Any] = dict(getattr(base, "__annotations__", {}))
    defaults = dict(getattr(base, "_field_defaults", {}))
    names = list(fields)
    at = names.index(before)
    names[at:at] = new
    fields.update({name: kind for name, (kind, _) in new.items()})
    defaults.update({name: value for name, (_, value) in new.items()})
    made: Any = namedtuple(  # type: ignore[misc]
        base.__name__, names, defaults=[*map(defaults.get, names)], module=base.__module__
    )
    made.__annotations__ = {n: fields[n] for n in names}
    made.__doc__ = base.__doc__
    for name, value in vars(base).items():
        if callable(value) and name not in vars(made):
            setattr(made, name, value)
    return cast("type[S]", made)


def replaced(tree: Any, path: str, value: Any) -> Any:
    """A copy of a tree with one other value.

    Parameters
    ----------
    tree : Any
        A set of parameters.
    path : str
        Dotted path of the parameter.
    value : Any
        In the stored unit; not checked.

    Returns
    -------
    Any
        Of the same class.

    Examples
    --------
    >>> from macromicro import Settings
    >>> from macromicro.schema.par import replaced
    >>> replaced(Settings(), "bench.friction.coulomb", 11.0).bench.friction.coulomb  # N
    11.0
    """
    name, _, rest = path.partition(".")
    if rest:
        value = replaced(getattr(tree, name), rest, value)
    return tree._replace(**{name: value})


def value_at(tree: Any, path: str) -> Any:
    """The value at a dotted path.

    Parameters
    ----------
    tree : Any
        A set of parameters.
    path : str
        Dotted path of a parameter or of a set.

    Returns
    -------
    Any
        In the stored unit.

    Examples
    --------
    >>> from macromicro import Settings
    >>> from macromicro.schema.par import value_at
    >>> value_at(Settings(), "sensors.encoder.pitch")  # m
    7.142857142857143e-05
    """
    for name in path.split("."):
        tree = getattr(tree, name)
    return tree


class Given(frozenset[str]):
    """Paths of derived parameters that a user has set; sets of parameters equal by values alone.

    A tree keeps it in a field ``given``.

    Examples
    --------
    >>> from macromicro.schema.par import Given
    >>> Given({"guard.effort"}) == Given()
    True
    """

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Given)

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return 0


def is_given(tree: Any, path: str) -> bool:
    """Whether a user has set a derived parameter, also to the value that its rule gives.

    Parameters
    ----------
    tree : Any
        A set of parameters.
    path : str
        Dotted path of the parameter.

    Returns
    -------
    bool
        False where the tree keeps nothing of it.

    Examples
    --------
    >>> from macromicro import Settings
    >>> from macromicro.schema.par import changed, is_given
    >>> is_given(changed(Settings(), {"guard.motor": 5.0}), "controller.motor_limit")
    False
    """
    name, _, rest = path.partition(".")
    inner = getattr(tree, name)
    if rest and is_set(inner) and is_given(inner, rest):
        return True
    return path in getattr(tree, "given", ())


def _remembering(tree: Any, paths: Iterable[str]) -> Any:
    """A tree that keeps which of its derived parameters a user has set."""
    rules = {path for path, _ in getattr(tree, "derived", tuple)()}
    own = rules.intersection(paths)
    for name in {path.partition(".")[0] for path in own}:
        inner = getattr(tree, name)
        if hasattr(inner, "given"):
            start = f"{name}."
            inside = {path for path in own if path.startswith(start)}
            own -= inside
            kept = _remembering(inner, {path.removeprefix(start) for path in inside})
            tree = tree._replace(**{name: kept})
    if own and hasattr(tree, "given"):
        tree = tree._replace(given=Given(tree.given | own))
    return tree


def changed(tree: Any, changes: Mapping[str, Any]) -> Any:
    """A copy of a tree with other values, and with the values derived from them.

    A tree may have a method ``derived() -> tuple[(path, rule), ...]``; ``rule(tree)`` gives the
    value, and no rule depends on a later one. A value is derived again unless a user has set it,
    now or before (`is_given`), or it differs from what its rule gives.

    Parameters
    ----------
    tree : Any
        A set of parameters.
    changes : Mapping[str, Any]
        Dotted path to value in the stored unit; not checked.

    Returns
    -------
    Any
        Of the same class.

    Raises
    ------
    ProblemError
        A value cannot be derived from the others, for example because of a division by zero.

    Examples
    --------
    >>> from macromicro import Settings
    >>> from macromicro.schema.par import changed
    >>> changed(Settings(), {"guard.motor": 5.0}).controller.motor_limit  # V; it is derived
    5.0
    """
    new = tree
    for path, value in changes.items():
        new = replaced(new, path, value)
    new = _remembering(new, changes)
    for path, rule in getattr(tree, "derived", tuple)():
        if not is_given(new, path) and path not in changes and value_at(tree, path) == rule(tree):
            try:
                value = type(value_at(tree, path))(rule(new))
            except (ArithmeticError, ValueError) as error:
                raise ProblemError(
                    path, f"cannot be derived ({error})", "Choose other values."
                ) from None
            new = replaced(new, path, value)
    return new
