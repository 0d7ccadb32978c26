"""A token bucket, with a clock of its own."""

from __future__ import annotations

import pytest

from macromicro.serve import bucket


def test_a_burst_passes_and_then_the_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(bucket.time, "monotonic", lambda: now[0])
    made = bucket.Bucket(10.0, 3.0)
    assert [made.spend() for _ in range(3)] == [0.0, 0.0, 0.0]
    assert made.spend() == pytest.approx(0.1)
    assert made.spend(2.0) == pytest.approx(0.3)
    now[0] += 0.3
    assert made.spend(0.0) == pytest.approx(0.0, abs=1e-9)
    now[0] += 100.0  # it never holds more than a burst
    assert made.spend(4.0) == pytest.approx(0.1)
