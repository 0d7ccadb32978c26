"""The columns of a recording follow from the type of a row."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import pytest

from macromicro.columns import COLUMNS, Quantity, Row, columns, named
from macromicro.recording_format import Column


class Small(NamedTuple):
    """Two columns."""

    t: Annotated[float, Quantity("s", "time")]
    on: Annotated[float, Quantity("1", "a switch", "i1")]


def test_fields_become_columns_in_their_order() -> None:
    assert columns(Small) == (Column("t", "s", "time"), Column("on", "1", "a switch", "i1"))
    assert tuple(c.name for c in COLUMNS) == Row._fields


def test_columns_by_name_in_the_order_asked_for() -> None:
    assert [c.name for c in named("motor", "t")] == ["motor", "t"]
    assert all(c in COLUMNS for c in named("motor", "t"))
    with pytest.raises(KeyError, match="speed"):
        named("t", "speed")
