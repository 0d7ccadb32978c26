"""The text of exported C: names, remarks about numbers, line breaks, Python's functions."""

from __future__ import annotations

import re
import textwrap
from functools import cache
from importlib import resources
from string import Template
from typing import Any

from macromicro.columns import Meaning, meaning
from macromicro.export.kinds import hints_of

LONGEST = 100
# What C's words and libm's functions would hide, or be hidden by.
RESERVED = frozenset(
    """
    auto break case char const continue default do double else enum extern float for goto if inline
    int long register restrict return short signed sizeof static struct switch typedef union
    unsigned void volatile while bool true false whole main index
    y0 y1 yn j0 j1 jn gamma exp log sin cos tan sqrt floor ceil fabs pow fmod
    """.split()  # noqa: SIM905 - words
)


def legal(name: str) -> str:
    """A Python name as a valid C name."""
    return f"{name}_" if name in RESERVED else name


def camel(name: str) -> str:
    """The name of a module as that of a type."""
    return "".join(part[:1].upper() + part[1:] for part in name.split("_"))


def snake(name: str) -> str:
    """The name of a type as that of a field."""
    return re.sub(r"(?<=[a-z0-9])([A-Z])", r"_\1", name).lower()


@cache
def notes_of(kind: Any) -> dict[str, Meaning]:
    """Meanings of the fields of a ``NamedTuple`` class; units as stored."""
    hints = hints_of(kind, noted=True)
    return {name: meaning(hints.get(name)) for name in kind._fields}


def remark(note: Meaning) -> str:
    """Meaning and unit in words."""
    unit = "" if note.unit in ("1", "-") else note.unit
    return plain(", ".join(filter(None, (note.meaning, unit))))


def plain(words: str) -> str:
    """Text without mark-up that ends no C comment."""
    return words.replace("`", "").replace("*/", "* /").strip().rstrip(".")


def identifiers(lines: list[str]) -> set[str]:
    """The names in lines of code, those in comments to the end of a line left out."""
    code = [line for line in lines if not line.lstrip().startswith("//")]
    return set(re.findall(r"\w+", "\n".join(code)))


def wrap(lines: list[str]) -> list[str]:
    """Code no wider than `LONGEST`, broken behind commas and operators.

    Comments to the end of a line stay whole.
    """
    found = []
    for line in lines:
        if len(line) <= LONGEST or line.lstrip().startswith("//"):
            found.append(line)
            continue
        code = line.lstrip()
        pad = " " * (len(line) - len(code))
        if "/*" not in code:
            code = re.sub(r"(?<![-,|&?:+*/]) ", "\0", code)  # blanks without a break
        parts = textwrap.wrap(
            code, LONGEST, initial_indent=pad, subsequent_indent=f"{pad}        ",
            break_long_words=False, break_on_hyphens=False,
        )  # fmt: skip
        found += [part.replace("\0", " ") for part in parts]
    return found


def helpers(used: set[str], single: bool) -> list[str]:
    """Those functions of helpers.c, in the file's order, for numbers of one precision."""
    text = template("helpers.c")
    chosen = [
        block
        for block in text.split("\n\n")
        if any(re.search(rf"^static inline \w+ {name}\(", block, re.MULTILINE) for name in used)
    ]
    suffix, bits = ("f", 32) if single else ("", 64)
    meant = {
        "real": "float" if single else "double",
        "integer": f"int{bits}_t",
        "INTEGER_MIN": f"INT{bits}_MIN",
        "INTEGER_MAX": f"INT{bits}_MAX",
        "INTEGER_LIMIT": f"{2.0 ** (bits - 1)}{suffix}",
        "FMOD": f"fmod{suffix}",
        "COPYSIGN": f"copysign{suffix}",
        "FLOOR": f"floor{suffix}",
    }
    code = re.sub(rf"\b({'|'.join(meant)})\b", lambda m: meant[m.group()], "\n\n".join(chosen))
    return code.splitlines()


def template(name: str) -> str:
    return resources.files("macromicro.export").joinpath("templates", name).read_text("utf-8")


def fill(file: str, /, **places: str) -> str:
    """A template; places that hold nothing leave no line."""
    text = template(file)
    for place in [each for each, value in places.items() if not value]:
        text = text.replace(f"${place}\n", "")
    return re.sub(r"\n{3,}", "\n\n", Template(text).substitute(places).rstrip()) + "\n"
