"""The columns of a recording follow from annotated types."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
import pytest

from macromicro.columns import Column, Quantity, layout, put, quantities, whole
from macromicro.errors import ProblemError
from macromicro.kernel import compiled
from macromicro.recorded import COLUMNS, columns_named
from macromicro.types import Command, Sample


class Small(NamedTuple):
    """Two columns, and a field that is not recorded."""

    t: Annotated[float, Quantity("s", "time")]
    hidden: float
    x: Annotated[float, Quantity("um", "place", "f4", column="place", scale=1e6)]


class Other(NamedTuple):
    """One more."""

    on: Annotated[float, Quantity("1", "a switch", "i1")]


def test_annotated_fields_become_columns_in_their_order() -> None:
    columns, parts = layout(Small, Other)
    assert columns == (
        Column("t", "s", "time"),
        Column("place", "um", "place", "f4"),
        Column("on", "1", "a switch", "i1"),
    )
    assert [p.rows.tolist() for p in parts] == [[0, -1, 1], [2]]
    assert [p.scales.tolist() for p in parts] == [[1.0, 1.0, 1e6], [1.0]]


@pytest.mark.parametrize("write", [put, compiled(put)])
def test_values_go_to_their_rows_in_their_units(write: object) -> None:
    _, (small, other) = layout(Small, Other)
    block = np.full((3, 2), np.nan)
    write(block, 1, Small(0.5, 7.0, 2e-6), small.rows, small.scales)  # type: ignore[operator]
    write(block, 1, Other(1.0), other.rows, other.scales)  # type: ignore[operator]
    assert block[:, 1].tolist() == [0.5, 2.0, 1.0]
    assert np.isnan(block[:, 0]).all()


def test_one_column_of_two_fields_is_refused() -> None:
    with pytest.raises(ProblemError, match="two fields have t"):
        layout(Small, Sample)


def test_a_run_records_every_field_of_a_sample_and_no_flag_of_a_command() -> None:
    units = {c.name: c.unit for c in COLUMNS}
    assert units["macro_position"] == "count"
    assert units["laser"] == "um"
    columns, (sample, command) = layout(Sample, Command)
    assert (sample.rows >= 0).all()
    assert [n for n, r in zip(Command._fields, command.rows, strict=True) if r < 0] == [
        "macro_active",
        "micro_active",
    ]
    assert columns == COLUMNS[: len(columns)]


def test_columns_by_name_in_the_order_asked_for() -> None:
    assert [c.name for c in columns_named("motor", "t")] == ["motor", "t"]
    assert all(c in COLUMNS for c in columns_named("motor", "t"))
    with pytest.raises(KeyError, match="speed"):
        columns_named("t", "speed")


def test_what_is_no_number_is_minus_one_in_columns_of_whole_numbers() -> None:
    columns, _ = layout(Small, Other)
    block = np.array([[np.nan, 0.0], [np.inf, 1.0], [np.nan, 1.0]])
    done = whole(block, columns)
    assert done[2].tolist() == [-1.0, 1.0]
    assert np.isnan(done[0, 0]) and np.isinf(done[1, 0])


def test_annotations_know_the_column_that_they_make() -> None:
    found = quantities(Small)
    assert list(found) == ["t", "x"]
    assert (found["t"].column, found["x"].column) == ("t", "place")
