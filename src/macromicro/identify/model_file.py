"""model.toml: settings for ``macromicro run --config``, or plain notes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

Value = float | int | str | Sequence[float] | Sequence[str]


def settings(head: str, values: Mapping[str, tuple[float, str]], law: str = "") -> str:
    from macromicro.schema import config
    from macromicro.schema.par import entries
    from macromicro.settings import Settings
    from macromicro.units import shown

    tree, first = Settings(), ""
    if law:
        tree = tree._replace(controller=tree.controller.joined(law, "law"))
        first = f'[controller]\nmacro_law = "{law}"\n'
    pars = {e.path: e.par for e in entries(tree)}
    tables: dict[str, list[str]] = {}
    texts: dict[str, str] = {}
    for path, (value, comment) in values.items():
        table, _, name = path.rpartition(".")
        texts[path] = shown(value, pars[path].unit, pars[path].shown, 6)
        tables.setdefault(table, []).append(line(name, f'"{texts[path]}"', comment))
    config.overridden(tree, texts, "model.toml")
    return as_toml(head, first, tables)


def gains(head: str, name: str, found: Any, law: str) -> str:
    """A settings file with all gains of a law."""
    from macromicro.schema import config
    from macromicro.schema.par import entries
    from macromicro.settings import Settings

    control = Settings().controller.joined(law, "law")
    config.check(found, "model.toml", f"controller.{name}.")
    key = "micro_law" if control.micro_law == law else "macro_law"
    rounded = type(found)(*[_round(value) for value in found])
    lines = [
        line(entry.path, str(entry.text), entry.par.meaning)
        for entry in entries(rounded)
        if entry.text is not None
    ]
    first = f'[controller]\n{key} = "{law}"\n'
    return as_toml(head, first, {f"controller.{name}": lines})


def _round(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(map(_round, value))
    return float(f"{value:.6g}")


def plain(head: str, tables: Mapping[str, Mapping[str, tuple[Value, str]]]) -> str:
    rows = {
        table: [line(name, _toml(value), comment) for name, (value, comment) in values.items()]
        for table, values in tables.items()
    }
    return as_toml(head, "", rows)


def as_toml(head: str, first: str, tables: Mapping[str, Sequence[str]]) -> str:
    """A file of a head in comments, first lines, and tables of lines."""
    comment = "".join(f"# {text}".rstrip() + "\n" for text in head.splitlines())
    body = [f"[{table}]\n" + "\n".join(lines) + "\n" for table, lines in tables.items()]
    return "\n".join([comment, *([first] if first else []), *body])


def line(name: str, value: str, comment: str) -> str:
    return f"{name} = {value}  # {comment}" if comment else f"{name} = {value}"


def _toml(value: Any) -> str:
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        return f'"{escaped}"'
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            return str(value)
        if value % 1.0:
            return f"{value:.9g}"
        return f"{value:.9e}" if abs(value) >= 1e9 else f"{value:.1f}"
    return "[" + ", ".join(_toml(v if isinstance(v, str) else float(v)) for v in value) + "]"
