"""Settings files: a TOML file that overrides some parameters of a tree, with units.

A tree is a parameter set of `macromicro.parameters`: nested NamedTuples, each leaf
annotated with a `Par`. Tables of the file are sets of the tree, keys are parameters:

    [bench.friction]
    coulomb = "11 N"
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, TypeVar

from macromicro.errors import InputError
from macromicro.parameters import Entry, Par, changed, entries, is_set
from macromicro.textfile import printable, read_toml
from macromicro.units import quantity, remedy, shown

Tree = TypeVar("Tree")

WHAT = "a settings file (.toml)"
_LIST = "`macromicro config show` lists all"
_NO_UNIT = ("", "1", "-")


def load_overrides(path: Path, tree: Tree) -> Tree:
    """A copy of `tree` with the values of the TOML file at `path`, and what derives from them.

    Raises `InputError` that names file and key: an unknown key, a missing or wrong unit,
    a value out of its bounds, a file that sets nothing; and for the first of the
    `problems()` that the new tree or one of its sets finds in itself.
    """
    path = Path(path)
    file = printable(path, 300)
    if path.suffix.lower() != ".toml" and not path.is_dir():  # reading says what a directory is
        found = f"suffix {printable(path.suffix)}" if path.suffix else "no suffix"
        raise InputError(file, found, WHAT)
    known = {entry.path: entry for entry in entries(tree)}
    changes = {
        key: _value(value, known[key], f"{file}, {key}")
        for key, value in _leaves(read_toml(path, WHAT), "", known, file)
    }
    if not changes:
        raise InputError(file, "sets nothing", f"one parameter or more ({_LIST})")
    tree = changed(tree, changes)
    check(tree, file)
    return tree


def check(tree: Any, where: str, prefix: str = "", *, together: bool = True) -> None:
    """Raise the first of the `problems()` of the tree's sets, inner sets first.

    A set may have a method ``problems() -> list[tuple[path, value, accepted]]`` for what
    bounds cannot say (a stop beyond the stroke); paths count from that set. A path in
    braces within `accepted` becomes that parameter's full path and value. Without `together`
    the tree's method `together()` is not asked: like `problems()`, but about parts that are
    possible each, and do not work with one another.
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
    """The `problems()` that one set finds in itself, in words for a person: (path with
    `prefix`, value with its unit, what is accepted with the other parameter's value)."""
    found = list(getattr(tree, "problems", list)())
    if together:
        found += getattr(tree, "together", list)()
    for path, value, accepted in found:
        mine = {e.path: e for e in entries(tree)}
        spoken = _spoken(mine[path].par, value) if path in mine else value
        words = accepted
        for e in mine.values():
            words = words.replace(f"{{{e.path}}}", f"{prefix}{e.path} ({_spoken(e.par, e.value)})")
        yield f"{prefix}{path}", spoken, words


def _spoken(par: Par, value: Any) -> Any:
    """A number in the unit that a person reads; anything else as it is."""
    number = isinstance(value, float) and math.isfinite(value)
    return shown(value, par.unit, par.shown, 6) if number else value


def as_toml(tree: Any, only: str | None = None) -> str:
    """The tree as TOML that `load_overrides` reads back to the same values, bit for bit.

    Every line ends with the parameter's meaning and source. `only`: one set
    ("bench.friction") or one parameter by its dotted path. A value that is not a finite
    number (not set) stands in a comment.
    """
    chosen = list(entries(tree))
    if only is not None:
        chosen = [e for e in chosen if f"{e.path}.".startswith(f"{only}.")]
        if not only or not chosen:
            accepted = _nearest(only, [e.path for e in entries(tree)])
            raise InputError(printable(only) or "key", "unknown key", accepted)
    lines = []
    for entry in chosen:
        table, _, name = entry.path.rpartition(".")
        text = _text(entry.par, entry.value)
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
    """What `tree` sets otherwise than `default`: dotted path to text with unit."""
    found = {}
    for new, old in zip(entries(tree), entries(default), strict=True):
        texts = [_text(e.par, e.value) or str(e.value) for e in (new, old)]
        if texts[0] != texts[1]:
            found[new.path] = texts[0]
    return found


def changed_toml(tree: Any, default: Any) -> str:
    """What `tree` sets otherwise than `default`, as TOML for `load_overrides`; with its meaning
    and its default behind each line."""
    own = {e.path: e for e in entries(default)}
    lines = []
    for path, text in difference(tree, default).items():
        table, _, name = path.rpartition(".")
        par, was = own[path].par, own[path].value
        words = printable(f"{par.meaning}; default {_text(par, was) or was}", 1000)
        lines.append((table, f"{name} = {text}  # {words}"))
    return _in_tables(lines) or "# nothing differs from the defaults\n"


def _leaves(
    table: dict[str, Any], prefix: str, known: dict[str, Entry], file: str
) -> Iterator[tuple[str, object]]:
    """Dotted paths and raw values of the file, every path known."""
    for key, value in table.items():
        path = f"{prefix}{key}"
        where = f"{file}, {printable(path)}"
        if "." in key or not (path in known or any(p.startswith(f"{path}.") for p in known)):
            raise InputError(where, "unknown key", _nearest(path, list(known)))
        if path in known:
            yield path, value
        elif isinstance(value, dict):
            yield from _leaves(value, f"{path}.", known, file)
        else:
            inside = list(
                dict.fromkeys(
                    p[len(path) + 1 :].partition(".")[0] for p in known if p.startswith(f"{path}.")
                )
            )
            accepted = f"a table [{path}] with {', '.join(inside)}"
            raise InputError(where, printable(value), accepted)


def _nearest(path: str, known: list[str]) -> str:
    """The known key most like `path`, and how to list them all."""
    sets = {p.rpartition(".")[0] for p in known} - {""}
    names = [*known, *sorted(sets)]
    near = difflib.get_close_matches(path, names, 1, 0.6)
    if not near:  # right name, wrong or no table
        last = path.rpartition(".")[2]
        match = difflib.get_close_matches(last, [n.rpartition(".")[2] for n in names], 1, 0.6)
        near = [n for n in names if match and n.rpartition(".")[2] == match[0]][:1]
    return f"a known key, such as {near[0]} ({_LIST})" if near else f"a known key ({_LIST})"


def _value(raw: object, entry: Entry, where: str) -> Any:
    """The value of a parameter from what TOML gave; as the default's type."""
    par, default = entry.par, entry.value
    if isinstance(default, tuple):
        example = _text(par, default) or "a list"
        if not isinstance(raw, list) or len(raw) < 2:
            accepted = f"a list of two values or more, such as {printable(example)}"
            raise InputError(where, printable(raw), accepted)
        places = (f"{where}, item {i}" for i in range(1, len(raw) + 1))
        return tuple(_scalar(x, par, default[0], p) for x, p in zip(raw, places, strict=True))
    return _scalar(raw, par, default, where)


def _scalar(raw: object, par: Par, default: object, where: str) -> Any:
    if isinstance(default, bool):
        if not isinstance(raw, bool):
            raise InputError(where, printable(raw), "true or false")
        return raw
    if isinstance(default, str):
        return _word(raw, par, where)
    if isinstance(raw, bool) or not isinstance(raw, int | float | str):
        raise InputError(where, printable(raw), remedy(par.unit))
    written = raw if isinstance(raw, str) else printable(raw)
    value: float = quantity(written, par.unit, where)
    if isinstance(default, int):
        if not value.is_integer():
            raise InputError(where, written, "a whole number")
        value = raw if isinstance(raw, int) else int(value)
    _check_bounds(value, par, where, written)
    return value


def _word(raw: object, par: Par, where: str) -> str:
    if par.choices:
        if raw not in par.choices:
            raise InputError(where, printable(raw), " or ".join(map(repr, par.choices)))
        return str(raw)
    if not isinstance(raw, str) or len(raw) > 100 or not raw.isprintable():
        raise InputError(where, printable(raw), "text of at most 100 characters")
    return raw


def _check_bounds(value: float, par: Par, where: str, written: str) -> None:
    if par.lo <= value <= par.hi and (value > 0.0 or not par.positive):
        return
    lo, hi = (shown(x, par.unit, par.shown, 10) for x in (par.lo, par.hi))
    words = []
    if par.positive and par.lo <= 0.0:
        words.append("above zero")
    elif par.lo > -math.inf:
        words.append(f"{lo} or more" if par.hi == math.inf else f"from {lo}")
    if par.hi < math.inf:
        words.append(f"to {hi}" if words and words[0].startswith("from") else f"at most {hi}")
    raise InputError(where, written, ", ".join(words).replace(", to ", " to "))


def _text(par: Par, value: object) -> str | None:
    """A parameter's value as TOML; None if it cannot be written (NaN: not set)."""
    if isinstance(value, tuple):
        items = [_text(par, item) for item in value]
        return None if None in items else f"[{', '.join(str(item) for item in items)}]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return _quoted(value)
    if not isinstance(value, int | float) or not math.isfinite(value):
        return None
    whole = isinstance(value, int) and (par.shown or par.unit) in _NO_UNIT
    text = str(value) if whole else shown(value, par.unit, par.shown)
    return text if (par.shown or par.unit) in _NO_UNIT else _quoted(text)


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
