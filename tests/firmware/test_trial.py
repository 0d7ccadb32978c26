"""A short trial of random orders: nothing unsafe, nothing unexplained."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.firmware.built import elf, needs_avr

pytestmark = needs_avr


def _tried(seed: int, periods: int, tmp_path: Path) -> str:
    from boardtrial import orders, table
    from boardtrial.trial import Trial

    trial = Trial(elf(), seed)
    while trial.line.bench.tick < periods:
        trial.round(orders.ORDERS, orders.INJURIES)
    assert trial.judge.unsafe == []
    assert trial.unexplained == []
    page = tmp_path / "page.md"
    page.write_text(f"before\n{table.BEGIN}\nold\n{table.END}\nbehind\n")
    table.write(page, table.section(trial, seed, 60.0))
    return page.read_text()


def test_four_seconds_of_random_orders(tmp_path: Path) -> None:
    text = _tried(5, 4_000, tmp_path)
    assert text.startswith("before") and text.endswith("behind\n") and "old" not in text
    assert "| unsafe outputs | 0 |" in text


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_two_minutes_of_random_orders(tmp_path: Path) -> None:
    _tried(11, 120_000, tmp_path)
