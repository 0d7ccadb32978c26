"""What clients send is a number, or it is not; and it can be shown."""

from __future__ import annotations

import numpy as np

from macromicro.control.live.plain import among, list_names, show


def test_what_is_shown_is_short() -> None:
    class Odd:
        def __repr__(self) -> str:
            raise RuntimeError

    assert show("a") == "'a'"
    assert show(10**5000) == "<int>" and show(Odd()) == "<Odd>"
    assert len(show("a" * 1000)) == 80 and show("a" * 1000, 10).endswith("...")


def test_only_words_are_among_words() -> None:
    words = ("macro", "micro")
    assert among("macro", words) and among(np.str_("micro"), words)
    assert not among(np.array(["macro", "micro"]), words) and not among("", words)


def test_names_are_listed_in_quotes() -> None:
    assert list_names(["a"]) == '"a"'
    assert list_names(["a", "b"]) == '"a" or "b"'
    assert list_names(["a", "b", "c", "d"], "and") == '"a", "b", "c" and "d"'
