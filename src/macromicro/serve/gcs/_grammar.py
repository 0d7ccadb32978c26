from __future__ import annotations

import re

from macromicro.serve.door._first_line import Grammar

SINGLE = {5: "#5", 7: "#7", 24: "#24"}  # commands of one byte, which need no line's end
_BYTES = re.escape(bytes(SINGLE))

GRAMMAR = Grammar(
    name="GCS",
    leading=re.compile(rb"[ \t\r\n]*"),
    begins=re.compile(rb"[*A-Za-z" + _BYTES + rb"]"),
    # A single byte, or a command of three letters with its first argument: an axis, a number
    # or a word. No path and no address of a request is one.
    form=re.compile(
        rb"$|\*?[A-Z]{3}\?? (?: [ \t]*$ | [ \t]+ [-+.]? \w [-+.\w]* (?: [ \t]|$ ) )",
        re.IGNORECASE | re.VERBOSE,
    ),
    end=re.compile(rb"[\r\n" + _BYTES + rb"]"),
)
