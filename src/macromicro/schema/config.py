"""Settings files: a TOML file that overrides some parameters of a tree, with units.

A tree is a parameter set of `macromicro.schema.par`: nested NamedTuples, each leaf
annotated with a `Par`. Tables of the file are sets of the tree, keys are parameters:

    [bench.friction]
    coulomb = "11 N"
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from macromicro.errors import InputError, ProblemError
from macromicro.schema import figures
from macromicro.schema.keys import leaves, nearest
from macromicro.schema.par import FOLLOWS, Entry, changed, entries, is_given, is_set
from macromicro.schema.text import printable, read_toml

Tree = TypeVar("Tree")

WHAT = "a settings file (.toml)"
INCLUDE = "include"  # key of files that a file includes
MACHINE = "machine"  # key that names the machine that a file is for
_LIST = "`macromicro config show` lists all"


def table(path: Path) -> dict[str, Any]:
    """A settings file as nested tables, with those of the files that it includes.

    ``include = "calibration.toml"`` names a file beside it, or a list of them. What the file says
    itself goes before what it includes.
    """
    path = Path(path)
    found, file = read_toml(path, WHAT), printable(path, 300)
    names = found.pop(INCLUDE, [])
    for name in [names] if isinstance(names, str) else names:
        if not isinstance(name, str) or not name:
            raise InputError(f"{file}, {INCLUDE}", printable(name), "a file, or a list of files")
        beside = path.parent / name
        if not beside.is_file():
            raise ProblemError(
                f"{file}, {INCLUDE}", f"no file {printable(name)}", "Paths count from this file."
            )
        found = _merge(read_toml(beside, WHAT), found)
    return found


@contextmanager
def named_by_file(path: Path) -> Iterator[None]:
    """Errors of a key that an included file has name that file."""
    try:
        yield
    except InputError as error:
        raise error.at(_with_file(Path(path), error.where)) from None


def _with_file(path: Path, where: str) -> str:
    """A place in a file, or in the one of those it includes that says most of the key."""
    start = f"{printable(path, 300)}, "
    if not where.startswith(start):
        return where
    own = read_toml(path, WHAT)
    names, whole = own.get(INCLUDE, []), where.removeprefix(start)
    keys = whole.partition(",")[0].split(".")
    best, depth = path, _depth(own, keys)
    for name in [names] if isinstance(names, str) else names:
        beside = path.parent / name
        there = _depth(read_toml(beside, WHAT), keys)
        if there > depth:
            best, depth = beside, there
    return f"{printable(best, 300)}, {whole}"


def _depth(table: object, keys: list[str]) -> int:
    """How many of the keys, one inside the other, a table has."""
    if not keys or not isinstance(table, dict) or keys[0] not in table:
        return 0
    return 1 + _depth(table[keys[0]], keys[1:])


def _merge(first: dict[str, Any], second: dict[str, Any]) -> dict[str, Any]:
    """Nested tables of which the second goes before the first."""
    made = dict(first)
    for key, value in second.items():
        own = made.get(key)
        both = isinstance(own, dict) and isinstance(value, dict)
        made[key] = _merge(own, value) if both else value  # type: ignore[arg-type]
    return made


def load_overrides(path: Path, tree: Tree, machine: str = "") -> Tree:
    """A tree with the values of a TOML file, and with what derives from them."""
    path = Path(path)
    file = printable(path, 300)
    content = table(path)
    named, machine = content.get(MACHINE), machine or getattr(tree, "machine", str)()
    if machine and named is not None:
        if content.pop(MACHINE) != machine:
            raise InputError(f"{file}, {MACHINE}", printable(named), f'"{machine}" here')
        if not content:
            return tree
    with named_by_file(path):
        tree = _extend(tree, content, file)
        if not leaves(content, _entries_of(tree), f"{file}, ", _LIST):
            raise ProblemError(file, "the file sets no parameter", f"Set one or more ({_LIST}).")
        return overridden(tree, content, file)


def overridden(tree: Tree, table: Mapping[str, object], where: str) -> Tree:
    """A tree with the values of a table, and with what derives from them."""
    tree = _extend(tree, table, where)
    known = _entries_of(tree)
    read = {
        key: known[key].read(value, f"{where}, {key}")
        for key, value in leaves(dict(table), known, f"{where}, ", _LIST).items()
    }
    changes = figures.resolve_figures(tree, read, where)
    try:
        made: Tree = changed(tree, changes)
    except InputError as error:
        raise error.at(f"{where}, {error.where}") from None
    try:
        check(made, where)
    except (ArithmeticError, ValueError) as error:  # of a machine that cannot be
        _follow(made, changes, where)
        keys = printable(", ".join(changes), 200)
        raise ProblemError(
            f"{where}, {keys}", f"the machine cannot work ({error})", "Use other values."
        ) from None
    _follow(made, changes, where)
    return made


def _entries_of(tree: Any) -> dict[str, Entry]:
    """Every key that a file may set."""
    return {entry.path: entry for entry in entries(tree)} | figures.entries(tree)


def _follow(tree: Any, changes: Mapping[str, Any], where: str) -> None:
    """Raise InputError for a derived value that is beyond its parameter's bounds."""
    known = {entry.path: entry for entry in entries(tree)}
    for path, _ in getattr(tree, "derived", tuple)():
        entry = known[path]
        if (
            path in changes
            or not entry.number
            or math.isnan(entry.value)
            or entry.admits(entry.value)
        ):
            continue
        found = f"{entry.par.spoken(entry.value)} follows from other values, but is not "
        raise ProblemError(f"{where}, {path}", f"{found}{entry.accepted}", f"Give {FOLLOWS}.")


def _extend(tree: Tree, table: Mapping[str, object], where: str) -> Tree:
    """A tree with the sets that the table's own words call for: its method `grown`, if any."""
    grow = getattr(tree, "grown", None)
    grown: Tree = tree if grow is None else grow(table, where)
    return grown


def check(tree: Any, where: str, prefix: str = "", *, together: bool = True) -> None:
    """Raise the first of the `problems()` of the tree's sets, inner sets first.

    A set may have a method ``problems() -> list[tuple[path, value, accepted]]`` for what bounds
    cannot say (a stop beyond the stroke); paths count from that set. A path in braces within
    `accepted` becomes that parameter's full path and value.
    """
    for name in tree._fields:
        value = getattr(tree, name)
        if is_set(value):
            check(value, where, f"{prefix}{name}.")
    for path, found, accepted in problems(tree, prefix, together=together):
        raise InputError(f"{where}, {path}", found, accepted)


def problems(
    tree: Any, prefix: str = "", *, together: bool = True
) -> Iterator[tuple[str, Any, str]]:
    """The `problems()` that one set finds in itself, in words for a person."""
    found = list(getattr(tree, "problems", list)())
    if together:
        found += getattr(tree, "together", list)()
    for path, value, accepted in found:
        mine = {e.path: e for e in entries(tree)}
        spoken = mine[path].par.spoken(value) if path in mine else value
        words = accepted
        for e in mine.values():
            words = words.replace(f"{{{e.path}}}", f"{prefix}{e.path} ({e.par.spoken(e.value)})")
        yield f"{prefix}{path}", spoken, words


def as_toml(tree: Any, only: str | None = None) -> str:
    """The tree as TOML that `load_overrides` reads back to the same values, bit for bit.

    Every line ends with the parameter's meaning and source. A value that is not a finite number
    (not set) stands in a comment.
    """
    chosen = list(entries(tree))
    if only is not None:
        chosen = [e for e in chosen if f"{e.path}.".startswith(f"{only}.")]
        if not only or not chosen:
            accepted = nearest(only, [e.path for e in entries(tree)], f" ({_LIST})")
            raise ProblemError(printable(only) or "key", "unknown key", f"Accepted: {accepted}.")
    lines = []
    for entry in chosen:
        table, _, name = entry.path.rpartition(".")
        text = entry.text
        comment = printable(f"{entry.par.meaning} ({entry.par.source})", 1000)
        mark = "# not set: " if text is None else ""
        lines.append((table, f"{mark}{name} = {text or entry.value}  # {comment}"))
    return _in_tables(lines)


def _in_tables(lines: Iterable[tuple[str, str]]) -> str:
    """TOML of (table, line) in any order; "" is the root, whose own keys must come first."""
    tables: dict[str, list[str]] = {}
    for table, line in lines:
        tables.setdefault(table, []).append(line)
    parts = []
    for table in sorted(tables, key=bool):
        head = [f"[{table}]"] if table else []
        parts.append("\n".join([*head, *tables[table]]) + "\n")
    return "\n".join(parts)


def difference(tree: Any, default: Any) -> dict[str, str]:
    """What one tree sets otherwise than another."""
    own = {e.path: e.text or str(e.value) for e in entries(default)}
    new = {e.path: e.text or str(e.value) for e in entries(tree)}
    return {path: text for path, text in new.items() if text != own.get(path)}


def changed_toml(tree: Any, default: Any, also: Iterable[str] = ()) -> str:
    """What one tree sets otherwise than another, as TOML for `load_overrides`."""
    own = {e.path: e for e in entries(default)}
    given = {path for path, _ in getattr(tree, "derived", tuple)() if is_given(tree, path)}
    shown = {*difference(tree, default), *given, *also}
    lines = []
    for entry in entries(tree):
        if entry.path not in shown:
            continue
        table, _, name = entry.path.rpartition(".")
        was, text = own.get(entry.path), entry.text or entry.value
        default_words = "" if was is None else f"; default {was.text or was.value}"
        words = printable(f"{entry.par.meaning}{default_words}", 1000)
        lines.append((table, f"{name} = {text}  # {words}"))
    return _in_tables(lines) or "# nothing differs from the defaults\n"
