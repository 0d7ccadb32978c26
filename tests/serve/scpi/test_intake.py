"""What a client sends is read in slices, each paid for, whatever it is."""

from __future__ import annotations

import asyncio

import pytest

from macromicro.serve.door._connection import Bounds
from macromicro.serve.scpi import _intake
from macromicro.serve.scpi._intake import PIECE, Intake
from macromicro.serve.scpi._message import MOST_UNITS, SLICE, Message, reading
from macromicro.serve.scpi.tree import TREE


class Purse:
    """Notes what is paid, and when."""

    def __init__(self, rate: float, burst: float) -> None:
        self.paid: list[float] = []

    async def take(self, cost: float) -> None:
        self.paid.append(cost)


def read(data: bytes, price: float = 1.0) -> tuple[list[Message], list[float]]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_intake, "Bucket", Purse)
        made = Intake(Bounds(), lambda: price)

    async def messages() -> list[Message]:
        return [message async for message, _ in made.messages(data)]

    found = asyncio.run(messages())
    purse = made._bucket
    assert isinstance(purse, Purse)
    return found, purse.paid


@pytest.mark.parametrize("unit", [b"\xff;", b"NON:SENSE;", b"*IDN?;", b"*ESE 1,2,3;"])
def test_no_slice_reads_more_than_a_few_units(unit: bytes) -> None:
    slices, told = reading(TREE, unit * 20_000), []
    with pytest.raises(StopIteration) as end:
        while True:
            told.append(next(slices))
    assert told == [SLICE] * (MOST_UNITS // SLICE)
    assert end.value.value.error.number == -363 or unit != b"*IDN?;"


def test_all_of_it_is_paid_for_as_it_is_read() -> None:
    (line,), paid = read(b"*IDN?;" * 400 + b"\n")
    assert line.size == 400
    assert sum(paid) == pytest.approx(0.25 * (400 + 3) + 0.02)
    assert max(paid) <= 0.25 * SLICE + 0.02 * PIECE
    _, dearer = read(b"*IDN?;" * 400 + b"\n", price=3.0)
    assert sum(dearer) == pytest.approx(3.0 * sum(paid))


@pytest.mark.parametrize("data", [b"'" * 10_000, b"\n" * 10_000, b"#" * 10_000])
def test_marks_cost(data: bytes) -> None:
    _, paid = read(data)
    assert sum(paid) >= 0.02 * len(data)
    assert len(paid) >= len(data) / PIECE
