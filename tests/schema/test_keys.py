"""Keys and whole numbers of any TOML file, and seeds."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.schema import keys


@pytest.mark.parametrize("good", [0, 2**52])
def test_seeds_leave_room_for_trials_that_count_on(good: int) -> None:
    assert keys.seed(good, "--seed") == good
    assert float(good + 2**52) == good + 2**52  # exact in a table of floats


@pytest.mark.parametrize("bad", [-1, 2**52 + 1, True, 1.0])
def test_other_seeds_are_refused_with_what_is_accepted(bad: object) -> None:
    with pytest.raises(InputError, match=f"--seed.*from 0 to {2**52}"):
        keys.seed(bad, "--seed")  # type: ignore[arg-type]


@pytest.mark.parametrize("value", [12, np.int64(12), np.uint8(12)])
def test_whole_numbers_of_every_kind(value: object) -> None:
    found = keys.whole(value, 1, 64, "here")
    assert found == 12 and type(found) is int


@pytest.mark.parametrize("value", [0, 65, 12.0, np.float64(12), True, np.bool_(True), "12", None])
def test_what_is_no_whole_number(value: object) -> None:
    with pytest.raises(InputError, match="a whole number from 1 to 64"):
        keys.whole(value, 1, 64, "here")
