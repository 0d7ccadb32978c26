"""Keys and whole numbers of any TOML file, and seeds."""

from __future__ import annotations

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
