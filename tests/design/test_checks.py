"""Numbers that a design sheet can take, numpy's among them."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from macromicro import design
from macromicro.design._checks import positive
from macromicro.errors import InputError


@pytest.mark.parametrize("value", [2, 2.0, np.int64(2), np.float32(2), np.uint8(2), Fraction(2)])
def test_numbers_of_every_kind(value: Any) -> None:
    found = positive("here", value)
    assert found == 2.0 and type(found) is float


@pytest.mark.parametrize("value", [True, np.bool_(True), "2", 2 + 0j, None, [2.0], 10**400])
def test_what_is_no_number(value: Any) -> None:
    with pytest.raises(InputError, match=r"here: .*a number above 0 V"):
        positive("here", value, "V")


def test_a_sheet_takes_numpy_s_numbers() -> None:
    plain = design.budget(5.0, 12, 3.125e-3, 5000.0)
    assert design.budget(np.float32(5), np.int64(12), np.float64(3.125e-3), np.int64(5000)) == plain


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: design.suitable([("x", 700.0, (1.0, 1.0), 1.0)], design.Needs()), "Sensor(name, "),
        (lambda: design.judge(design.TABLE_3_2, (650.0, 3e-3, None)), "Needs(field, "),
        (lambda: design.ranking([("x", (0.0, 1.0), (1.0, 2.0))], 0.5), "Magnet(name, "),
        (lambda: design.compare(design.micro_stage(), [("x", 1.0)]), "Technology(name, "),
        (lambda: design.stiffness((70e9, 2e-3, 55e-3), 1e-3), "Beam(modulus, "),
    ],
)
def test_a_plain_tuple_is_no_data_sheet(call: Callable[[], object], says: str) -> None:
    with pytest.raises(InputError) as error:
        call()
    assert says in str(error.value)
