"""Python functions that C lacks, from helpers.c."""

from __future__ import annotations

import re
from importlib import resources

_DOUBLE = {
    "INTEGER_LOW": "-9223372036854775808.0",
    "INTEGER_HIGH": "9223372036854775808.0",
    "INTEGER_MIN": "INT64_MIN",
    "INTEGER_MAX": "INT64_MAX",
    "FMOD": "fmod",
    "COPYSIGN": "copysign",
    "FLOOR": "floor",
    "integer": "int64_t",
    "real": "double",
}
_SINGLE = {
    "INTEGER_LOW": "-2147483648.0f",
    "INTEGER_HIGH": "2147483648.0f",
    "INTEGER_MIN": "INT32_MIN",
    "INTEGER_MAX": "INT32_MAX",
    "FMOD": "fmodf",
    "COPYSIGN": "copysignf",
    "FLOOR": "floorf",
    "integer": "int32_t",
    "real": "float",
}


def lines(used: set[str], single: bool) -> list[str]:
    """The functions of the given names, in the file's order."""
    text = resources.files("macromicro.export").joinpath("helpers.c").read_text("utf-8")
    chosen = [
        block
        for block in text.split("\n\n")
        if any(re.search(rf"^static inline \w+ {name}\(", block, re.MULTILINE) for name in used)
    ]
    put = _SINGLE if single else _DOUBLE
    code = re.sub(rf"\b({'|'.join(put)})\b", lambda m: put[m.group()], "\n\n".join(chosen))
    return code.splitlines()
