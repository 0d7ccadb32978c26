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


def legal(name: str) -> str:
    """A Python name as a valid C name."""
    return f"{name}_" if name in RESERVED else name


def camel(name: str) -> str:
    """The name of a module as that of a type."""
    return "".join(part[:1].upper() + part[1:] for part in name.split("_"))


def snake(name: str) -> str:
    """The name of a type as that of a field."""
    return re.sub(r"(?<=[a-z0-9])([A-Z])", r"_\1", name).lower()


def identifiers(lines: list[str]) -> set[str]:
    """The names in lines of code, those in comments to the end of a line left out."""
    code = [line for line in lines if not line.lstrip().startswith("//")]
    return set(re.findall(r"\w+", "\n".join(code)))


def wrapped(lines: list[str]) -> list[str]:
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
