"""Keys of TOML tables, and suggestions for unknown ones."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator
from numbers import Integral
from typing import Any

from macromicro.errors import InputError, ProblemError
from macromicro.schema.par import Entry
from macromicro.schema.text import printable

_FEW = 12
EXACT = 2**53  # up to here a table of floats and JSON hold every whole number
MAX_SEED = EXACT // 2  # trials may count on from it


def nearest(name: str, known: Iterable[str], hint: str = "") -> str:
    known = tuple(known)
    near = difflib.get_close_matches(name, known, 3, 0.6)
    if not near:  # the right name in a wrong table, or in none
        lasts = [k.rpartition(".")[2] for k in known]
        last = difflib.get_close_matches(name.rpartition(".")[2], lasts, 1, 0.6)
        near = [k for k, end in zip(known, lasts, strict=True) if end in last][:3]
    if near:
        return f"a known one, such as {' or '.join(near)}{hint}"
    return f"one of {', '.join(known)}" if len(known) <= _FEW else f"a known one{hint}"


def show_value(raw: object) -> str:
    return "nothing" if raw is None else printable(raw)


def unknown(table: dict[str, Any], keys: Iterable[str], prefix: str, hint: str = "") -> None:
    keys = tuple(keys)
    for key in table:
        if key not in keys:
            raise ProblemError(
                f"{prefix}{printable(key)}", "unknown key", f"Accepted: {nearest(key, keys, hint)}."
            )


def only(table: dict[str, Any], keys: tuple[str, ...], where: str) -> None:
    """Refuse a known key that does not go with the others."""
    for key in table:
        if key not in keys:
            raise ProblemError(f"{where}.{printable(key)}", f"not allowed with {', '.join(keys)}")


def whole(raw: object, low: int, high: int, where: str) -> int:
    known = isinstance(raw, Integral) and not isinstance(raw, bool)
    if not known or not low <= int(raw) <= high:  # type: ignore[call-overload]
        raise InputError(where, show_value(raw), f"a whole number from {low} to {high}")
    return int(raw)  # type: ignore[call-overload,no-any-return]


def seed(value: int, where: str) -> int:
    """A seed that is small enough for trials to count on from it."""
    return whole(value, 0, MAX_SEED, where)


def leaves(
    table: dict[str, Any], known: dict[str, Entry], where: str, hint: str
) -> dict[str, object]:
    """Dotted paths and raw values of tables that are sets, in the file's order."""
    raw: dict[str, object] = {}
    for path, value in _walk(table, known, where, hint, ""):
        if path in raw:
            raise ProblemError(f"{where}{path}", "set twice", "Set each parameter once.")
        raw[path] = value
    return raw


def _walk(
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
            raise ProblemError(f"{where}{printable(path)}", "unknown key", f"Accepted: {accepted}.")
        elif isinstance(value, dict):
            yield from _walk(value, known, where, hint, f"{path}.")
        else:
            names = dict.fromkeys(name.partition(".")[0] for name in inside)
            accepted = f"a table [{path}] with {', '.join(names)}"
            raise InputError(f"{where}{printable(path)}", printable(value), accepted)
