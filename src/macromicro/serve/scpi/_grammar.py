from __future__ import annotations

import re

from macromicro.serve.door._first_line import Grammar

GRAMMAR = Grammar(
    name="SCPI",
    leading=re.compile(rb"[ \t\r\n;]*"),
    begins=re.compile(rb"[*:A-Za-z]"),
    # The form of a line's first command: a header, and behind white space the beginning of a
    # number, a string, a block, or a word that ends as words do.
    form=re.compile(
        rb"""(?:\*[A-Z]+|:?[A-Z]\w*(?::[A-Z]\w*)*)\??
        (?: [ \t\r]*(?:;|$) | [ \t\r]+ (?: [-+.0-9"'#(] | [A-Z]\w*[ \t\r]*(?:[,;]|$) ) )""",
        re.IGNORECASE | re.VERBOSE,
    ),
    end=re.compile(rb"\n"),
)
