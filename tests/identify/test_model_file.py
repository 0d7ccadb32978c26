"""The texts of model.toml, letter by letter."""

from __future__ import annotations

import math

import pytest

from macromicro.errors import InputError
from macromicro.identify import model_file


def test_plain_writes_each_kind_of_value_with_its_comment() -> None:
    text = model_file.plain(
        "Two\nlines",
        {
            "one": {"whole": (3, "a"), "half": (0.5, "b"), "text": ('a"b\\c', "c")},
            "two": {"list": ([1, 2.5, math.nan], "d"), "words": (["x", "y"], "e")},
        },
    )
    assert text == (
        "# Two\n# lines\n\n"
        '[one]\nwhole = 3  # a\nhalf = 0.5  # b\ntext = "a\\"b\\\\c"  # c\n\n'
        '[two]\nlist = [1.0, 2.5, nan]  # d\nwords = ["x", "y"]  # e\n'
    )


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2.0, "2.0"),
        (-7.0, "-7.0"),
        (0.123456789123, "0.123456789"),
        (1e9, "1.000000000e+09"),
        (-2e12, "-2.000000000e+12"),
        (999999999.0, "999999999.0"),
        (1e-12, "1e-12"),
        (math.inf, "inf"),
        (-math.inf, "-inf"),
        (math.nan, "nan"),
    ],
)
def test_numbers_are_toml_floats(value: float, text: str) -> None:
    assert model_file.plain("", {"t": {"v": (value, "c")}}) == f"\n[t]\nv = {text}  # c\n"


def test_settings_are_rounded_shown_in_their_unit_and_gathered_by_table() -> None:
    values = {
        "controller.dead_zone": (2.87654321, "found"),
        "bench.friction.coulomb": (4.0, "c"),
        "bench.friction.viscous": (7.0, "v"),
    }
    text = model_file.settings("Head", values)
    assert text == (
        '# Head\n\n[controller]\ndead_zone = "2.87654 V"  # found\n\n'
        '[bench.friction]\ncoulomb = "4 N"  # c\nviscous = "7 N*s/m"  # v\n'
    )


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("controller.dead_zone", -0.5, "'-0.5 V'; accepted: from 0 V to 1000 V"),
        ("bench.carriage.mass", -1.0, "'-1000 g'; accepted: above zero"),
        ("bench.carriage.mass", math.nan, "nan"),
        # One by one they would do: a carriage that the motor cannot move.
        ("bench.friction.coulomb", 400.0, "friction that the motor can break"),
    ],
)
def test_settings_that_a_run_would_refuse_are_refused(path: str, value: float, said: str) -> None:
    with pytest.raises(InputError, match=f"^model.toml, {path}: .*{said}"):
        model_file.settings("", {path: (value, "found")})
