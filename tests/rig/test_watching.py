"""The guard's state as a row of numbers: every field has a place of its own."""

from __future__ import annotations

from typing import Any

from macromicro.rig import guard, guarded
from macromicro.rig.guard import Watch


def flat(value: Any) -> list[float]:
    """The numbers of nested tuples, in the order of their fields."""
    if isinstance(value, tuple):
        return [number for part in value for number in flat(part)]
    return [value]


def filled(shape: Any, numbers: list[float]) -> Any:
    """A tuple of the same kind with these numbers in the order of its fields."""
    if isinstance(shape, tuple):
        return type(shape)(*(filled(part, numbers) for part in shape))
    return numbers.pop(0)


def test_the_row_holds_the_fields_in_their_order() -> None:
    numbers = [float(k) for k in range(1, guarded.FIELDS + 1)]
    watch: Watch = filled(guard.fresh(), [1, *numbers[1:]])
    row = [0.0] * guarded.FIELDS
    guarded.store(watch, row)
    assert row == numbers
    assert flat(guarded.restored(row)) == numbers
    assert type(guarded.restored(row).fault) is int
