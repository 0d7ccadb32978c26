"""Names in C, and line breaks."""

from __future__ import annotations

import re
import textwrap

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
# Where a long line is best broken, the best first; each with where the break is within it.
_BREAKS = ((", ", 2), (" || ", 1), (" && ", 1), (" ? ", 1), (" : ", 1), (" + ", 1), (" - ", 1),
           (" * ", 1), (" / ", 1), (" ", 1))  # fmt: skip


def legal(name: str) -> str:
    """A Python name as a valid C name."""
    return f"{name}_" if name in RESERVED else name


def camel(name: str) -> str:
    """The name of a module as that of a type."""
    return "".join(part[:1].upper() + part[1:] for part in name.split("_"))


def snake(name: str) -> str:
    """The name of a type as that of a field."""
    return re.sub(r"(?<=[a-z0-9])([A-Z])", r"_\1", name).lower()


def wrapped(lines: list[str]) -> list[str]:
    """Lines of code no longer than `LONGEST`, broken at operators and commas."""
    return [part for line in lines for part in _broken(line)]


def _broken(line: str) -> list[str]:
    pad = line[: len(line) - len(line.lstrip())]
    code, mark, note = line.partition(" /* ")
    if len(line) > LONGEST and mark and code.strip():
        width = LONGEST - len(pad) - 6
        first, *rest = textwrap.wrap(note.removesuffix(" */"), width)
        told = [f"{pad}/* {first}", *(f"{pad} * {each}" for each in rest)]
        told[-1] += " */"
        return [*told, *_broken(code)]
    remark = line.lstrip().startswith("//")
    found, deeper = [], f"{pad}// " if remark else f"{pad}        "
    while len(line) > LONGEST:
        place = _place(line, len(deeper) + 20, remark)
        if place is None:
            break
        found.append(line[:place].rstrip())
        line = deeper + line[place:].lstrip()
    return [*found, line]


def _place(line: str, least: int, remark: bool) -> int | None:
    for text, within in _BREAKS[-1:] if remark else _BREAKS:
        place = line.rfind(text, least, LONGEST - 1)
        if place > 0 and (text != ", " or place > LONGEST // 2):
            return place + within
    return None
