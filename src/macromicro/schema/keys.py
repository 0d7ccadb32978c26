"""Tables of a TOML file: their keys, and what is near a key that is not known."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator
from numbers import Integral
from typing import Any

from macromicro.errors import InputError
from macromicro.schema.par import Entry
from macromicro.schema.text import printable

_FEW = 12
EXACT = 2**53  # up to here a table of floats and JSON hold every whole number
MAX_SEED = EXACT // 2  # trials may count on from it


def nearest(name: str, known: Iterable[str], hint: str = "") -> str:
    """What is accepted instead of an unknown name.

    Parameters
    ----------
    name : str
        What was written.
    known : Iterable[str]
        The names there are.
    hint : str, optional
        Appended, to say where all are listed.

    Returns
    -------
    str
        The most alike of `known`, or all if they are few.
    """
    known = tuple(known)
    near = difflib.get_close_matches(name, known, 3, 0.6)
    if not near:  # the right name in a wrong table, or in none
        lasts = [k.rpartition(".")[2] for k in known]
        last = difflib.get_close_matches(name.rpartition(".")[2], lasts, 1, 0.6)
        near = [k for k, end in zip(known, lasts, strict=True) if end in last][:3]
    if near:
        return f"a known one, such as {' or '.join(near)}{hint}"
    return f"one of {', '.join(known)}" if len(known) <= _FEW else f"a known one{hint}"


def found(raw: object) -> str:
    """What stands at a key.

    Parameters
    ----------
    raw : object
        Its value, None if there is none.

    Returns
    -------
    str
        On one line; "nothing" for None.
    """
    return "nothing" if raw is None else printable(raw)


def unknown(table: dict[str, Any], keys: Iterable[str], prefix: str, hint: str = "") -> None:
    """Refuse a key that is not known.

    Parameters
    ----------
    table : dict[str, Any]
        A table of a TOML file.
    keys : Iterable[str]
        Those that it may have.
    prefix : str
        What stands before the key in the message.
    hint : str, optional
        Appended, to say where all are listed.

    Raises
    ------
    InputError
        For the first key that is none of `keys`, with the nearest.
    """
    keys = tuple(keys)
    for key in table:
        if key not in keys:
            raise InputError(f"{prefix}{printable(key)}", "unknown key", nearest(key, keys, hint))


def only(table: dict[str, Any], keys: tuple[str, ...], where: str) -> None:
    """Refuse a key that is known, but not beside the others.

    Parameters
    ----------
    table : dict[str, Any]
        A table of a TOML file, all keys known.
    keys : tuple[str, ...]
        Those that it may have.
    where : str
        The table, for the message.

    Raises
    ------
    InputError
        For the first key that is none of `keys`.
    """
    for key, value in table.items():
        if key not in keys:
            accepted = f"nothing beside {', '.join(keys)} here"
            raise InputError(f"{where}.{printable(key)}", printable(value), accepted)


def whole(raw: object, low: int, high: int, where: str) -> int:
    """A whole number within bounds.

    Parameters
    ----------
    raw : object
        What the file gave; numbers of numpy count, truth values do not.
    low, high : int
        Inclusive bounds.
    where : str
        File and key, for the message.

    Returns
    -------
    int
        `raw`.

    Raises
    ------
    InputError
        Anything else than a whole number, or one out of the bounds.
    """
    known = isinstance(raw, Integral) and not isinstance(raw, bool)
    if not known or not low <= int(raw) <= high:  # type: ignore[call-overload]
        raise InputError(where, found(raw), f"a whole number from {low} to {high}")
    return int(raw)  # type: ignore[call-overload,no-any-return]


def seed(value: int, where: str) -> int:
    """A seed, from which trials may count on.

    Parameters
    ----------
    value : int
        The seed.
    where : str
        File and key, or option, for the message.

    Returns
    -------
    int
        `value`.

    Raises
    ------
    InputError
        Below 0, or beyond 2^52.
    """
    return whole(value, 0, MAX_SEED, where)


def leaves(
    table: dict[str, Any], known: dict[str, Entry], where: str, hint: str
) -> dict[str, object]:
    """Dotted paths and raw values of tables that are sets, in the file's order.

    Parameters
    ----------
    table : dict[str, Any]
        Table of a TOML file; a path may be dotted or nested.
    known : dict[str, Entry]
        The parameters, by path.
    where : str
        What stands before a path in an error.
    hint : str
        Appended to an error, to say where all are listed.

    Returns
    -------
    dict[str, object]
        Raw values by dotted path.

    Raises
    ------
    InputError
        A path is not known (with the nearest) or stands twice, or a value stands in a set's place.
    """
    raw: dict[str, object] = {}
    for path, value in _walked(table, known, where, hint, ""):
        if path in raw:
            raise InputError(f"{where}{path}", "stands twice", "each parameter once")
        raw[path] = value
    return raw


def _walked(
    table: dict[str, Any], known: dict[str, Entry], where: str, hint: str, prefix: str
) -> Iterator[tuple[str, object]]:
    for key, value in table.items():
        path = f"{prefix}{key}"
        inside = [p[len(path) + 1 :] for p in known if p.startswith(f"{path}.")]
        if path in known:
            yield path, value
        elif not inside:
            sets = {p.rpartition(".")[0] for p in known} - {""}
            accepted = nearest(path, (*known, *sorted(sets)), f" ({hint})")
            raise InputError(f"{where}{printable(path)}", "unknown key", accepted)
        elif isinstance(value, dict):
            yield from _walked(value, known, where, hint, f"{path}.")
        else:
            names = dict.fromkeys(name.partition(".")[0] for name in inside)
            accepted = f"a table [{path}] with {', '.join(names)}"
            raise InputError(f"{where}{printable(path)}", printable(value), accepted)
