"""Parts of other packages by their names: found, checked, refused."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import pytest

from macromicro.errors import InputError
from macromicro.plant import own_part
from macromicro.plant.rubbing import FrictionPart
from macromicro.schema.par import Par
from tests.plant.test_rubbing import WALL, Wall

HERE = "tests.plant.test_own_part"
_force = WALL.force


class Bare(NamedTuple):
    level: float = 1.0


class Needy(NamedTuple):
    level: Annotated[float, Par("N", "level", "a test")]


class Worded(NamedTuple):
    level: Annotated[str, Par("", "level", "a test")] = "much"


other = FrictionPart("other", Wall, WALL.force)
bare, needy = FrictionPart("bare", Bare, _force), FrictionPart("needy", Needy, _force)
worded = FrictionPart("worded", Worded, _force)
dull: Any = FrictionPart("dull", Wall, _force, after=None)  # type: ignore[arg-type]
no_set: Any = FrictionPart("no set", float, _force)
something = 3


def test_a_part_is_found_once_and_compiles() -> None:
    found = own_part.find("tests.plant.test_rubbing:WALL", "here")
    assert found is WALL and own_part.compiles(found)
    assert not own_part.compiles(FrictionPart("plain", Wall, lambda p, s, x, v, h: (0.0, 0.0)))
    assert len(own_part.digest("tests.plant.test_rubbing:WALL")) == 16


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("something", r"here: '?.*something, int'?; accepted: a macromicro.plant.rubbing"),
        ("othr", "here: no othr in .*such as other"),
        ("bare", "settings of .*bare: 'Bare'.*each annotated with a Par"),
        ("needy", "settings of .*needy: 'Needy'.*with defaults"),
        ("worded", "settings of .*worded: 'Worded'.*floats"),
        ("no_set", "settings of .*no_set.*a NamedTuple of floats"),
        ("dull", "after of .*dull: 'None'; accepted: a function"),
        (
            "other",
            "has the settings of another, Wall.*Give each part a type of settings of its own",
        ),
    ],
)
def test_what_is_no_part_is_refused(name: str, said: str) -> None:
    own_part.find("tests.plant.test_rubbing:WALL", "here")
    with pytest.raises(InputError, match=said):
        own_part.find(f"{HERE}:{name}", "here")


def test_a_slip_names_the_nearest() -> None:
    with pytest.raises(InputError, match=r"here: 'bristels'; .*bristles.*docs/own-parts.md"):
        own_part.find("bristels", "here")
