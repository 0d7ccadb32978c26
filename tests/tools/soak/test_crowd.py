"""Stops while hostile clients send what costs most: heard, always."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from soak.crowd import KINDS, PAGE, SCPI, stops
from soak.victim import Victim

HEARD_S = 1.0  # far beyond what it takes: benchmarks say how long, this says that it is heard


@pytest.mark.slow
def test_a_crowd_does_not_keep_a_stop_from_being_heard(tmp_path: Path) -> None:
    """Eight clients without control at once; the stops are of others that have none either."""
    victim = Victim(tmp_path, 1, page=True)
    try:
        victim.start()
        found = stops(victim, 10, len(KINDS))
    finally:
        victim.end()
    for name in (SCPI, PAGE):
        assert len(found[name]) == 10
        assert not any(math.isnan(t) or t > HEARD_S for t in found[name]), found
