"""What clients send is a number, or it is not; and it can be shown."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from macromicro.control.live.plain import among, finite, shown


@pytest.mark.parametrize("value", [0, -3, 1.5, np.float64(2.0), 10**300])
def test_plain_numbers(value: Any) -> None:
    assert finite(value)


@pytest.mark.parametrize("value", [
    math.nan, math.inf, -math.inf, 10**400, True, None, "1", 1j, [1.0], np.array(1.0),
    np.array([1.0]), np.float32(1.0), np.float64(math.nan),
])  # fmt: skip
def test_anything_else(value: Any) -> None:
    assert not finite(value)


def test_what_is_shown_is_short() -> None:
    class Odd:
        def __repr__(self) -> str:
            raise RuntimeError

    assert shown("a") == "'a'"
    assert shown(10**5000) == "<int>" and shown(Odd()) == "<Odd>"
    assert len(shown("a" * 1000)) == 80 and shown("a" * 1000, 10).endswith("...")


def test_only_words_are_among_words() -> None:
    words = ("macro", "micro")
    assert among("macro", words) and among(np.str_("micro"), words)
    assert not among(np.array(["macro", "micro"]), words) and not among("", words)
