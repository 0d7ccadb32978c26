"""Writes docs/settings.md: every key that a settings file of a machine may set.

python docs/make_settings.py
"""

from __future__ import annotations

import math
from itertools import groupby
from pathlib import Path
from typing import Any

from measured_page import table

from macromicro.machines import compositions
from macromicro.schema import figures
from macromicro.schema.par import Entry, entries
from macromicro.serve.settings import LiveSettings
from macromicro.units import shown

PAGE = Path(__file__).with_name("settings.md")
HEAD = """\
# Settings

Keys of settings files, with their defaults. `macromicro config show --machine NAME` prints the same
with the source of each value, `macromicro config show --config FILE` the values that follow from a
file. `docs/make_settings.py` generates this page.

A value is a text with a unit, such as `"12 mm"`; only numbers without a unit are written bare. A
*derived* value follows from the data sheets until a file sets it. Keys without a default are
figures of a hobby motor's sheet, from which others follow.
"""
AXIS, TWO_STAGE = "axis", "two_stage"
ABOUT = {
    AXIS: "One motor-driven axis.",
    "rotary": "What differs from `axis`. Lengths are angles, forces torques.",
    "piezo": "A piezo stage: what differs from `axis`.",
    "wire": "A shape-memory wire: what differs from `axis`.",
    "xy": "Two axes, `x` and `y`, each with all keys of `axis`, and in addition:",
    TWO_STAGE: "The thesis' machine: controllers, guard, server, and [the virtual "
    "bench](validation/bench.md) with its sensors.",
}


def render() -> str:
    """The page."""
    tree = _settings(AXIS)
    axis = {_key(e) for e in (*entries(tree), *figures.entries(tree).values())}
    parts = [HEAD]
    for name, about in ABOUT.items():
        tree = _settings(name)
        derived = {path for path, _ in tree.derived()}
        known = [*entries(tree), *figures.entries(tree).values()]
        every = [e for e in known if not e.path.startswith(("x.", "y."))]
        every.sort(key=lambda e: tree._fields.index(e.path.partition(".")[0]))
        own = [e for e in every if name in (AXIS, TWO_STAGE) or _key(e) not in axis]
        parts.append(f"## `{name}`\n\n{about}\n")
        parts += [listed(group, list(found), derived) for group, found in groupby(own, _group)]
    return "\n".join(parts)


def listed(group: str, found: list[Entry], derived: set[str]) -> str:
    """The keys of one table of a file."""
    head = f"`[{group}]`" if group else "At the head of the file"
    rows = [
        (f"`{e.path.rpartition('.')[2]}`", _default(e, derived), e.par.meaning.replace("|", "\\|"))
        for e in found
    ]
    return f"{head}\n\n{table(('key', 'default', 'meaning'), rows)}"


def _settings(name: str) -> Any:
    return LiveSettings() if name == TWO_STAGE else compositions.by_name(name, "machine").settings


def _key(entry: Entry) -> tuple[str, str]:
    return entry.path, entry.par.meaning


def _group(entry: Entry) -> str:
    return entry.path.rpartition(".")[0]


def _default(entry: Entry, derived: set[str]) -> str:
    if entry.path in derived:
        return "derived"
    par, value = entry.par, entry.value
    if isinstance(value, float) and math.isnan(value):
        return "-"
    if isinstance(value, str | bool):
        return str(value)
    several = value if isinstance(value, tuple) else (value,)
    return ", ".join(shown(each, par.unit, par.shown, 4) for each in several)


if __name__ == "__main__":
    PAGE.write_text(render(), encoding="utf-8")
