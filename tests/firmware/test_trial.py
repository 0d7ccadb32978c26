"""A short trial of random orders: nothing unsafe, nothing unexplained."""

from __future__ import annotations

import pytest

from tests.firmware.built import elf, needs_avr

pytestmark = needs_avr


def _try(seed: int, periods: int) -> str:
    from boardtrial import orders, table
    from boardtrial.trial import Trial

    trial = Trial(elf(), seed)
    while trial.line.bench.tick < periods:
        trial.round(orders.ORDERS, orders.INJURIES)
    assert trial.judge.unsafe == []
    assert trial.unexplained == []
    return table.section(trial, seed, 60.0)


def test_four_seconds_of_random_orders() -> None:
    assert "| unsafe outputs | 0 |" in _try(5, 4_000)


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_two_minutes_of_random_orders() -> None:
    _try(11, 120_000)
