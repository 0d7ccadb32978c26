"""``macromicro doctor --rig NAME --move VOLTS`` on a machine that is a process of its own."""

from __future__ import annotations

import math
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from macromicro.rig import contract_moving
from macromicro.rig.opening import open_rig

MACHINE = Path(__file__).parent / "cards" / "far_machine.py"


@pytest.fixture(params=[math.inf, 0.03], ids=["held", "watched"])
def machine(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[float]:
    """A machine whose amplifier has a watchdog of so many seconds; its rig can be imported."""
    cells = tmp_path / "cells"
    cells.write_bytes(struct.pack("ddd", 0.0, 500.0, 0.0))
    monkeypatch.setenv("FAR_MACHINE", str(cells))
    monkeypatch.setenv("PYTHONPATH", str(MACHINE.parent))
    monkeypatch.syspath_prepend(str(MACHINE.parent))
    process = subprocess.Popen([sys.executable, MACHINE, cells, f"{request.param}"])
    yield request.param
    cells.write_bytes(struct.pack("ddd", math.nan, 0.0, 0.0))
    process.wait(5.0)


def test_a_killed_process_leaves_the_motor_on_unless_a_watchdog_drops_it(machine: float) -> None:
    seen = {e.what: e for e in contract_moving.check(open_rig("far_machine:bench"), 3.0)}
    assert list(seen) == ["direction", "coming to rest", "killed process"]
    assert seen["direction"].passed and seen["coming to rest"].passed
    last = seen["killed process"]
    gone = int(last.found.split()[0])
    if machine < 1.0:
        assert last.passed
        assert 0 <= gone < 150, "the watchdog's 0.03 s"
    else:
        assert not last.passed
        assert gone > 400, "2000 counts/s for 0.3 s, and on until it was opened again"
        assert "watchdog of its own" in last.remedy
        assert "stayed on for about 0.3" in last.found or "about 0.4" in last.found


@pytest.mark.parametrize("machine", [math.inf], indirect=True)
def test_wrong_sense_and_too_little(machine: float) -> None:
    seen = list(contract_moving.check(open_rig("far_machine:turned"), 3.0))
    assert [e.what for e in seen] == ["direction"]
    assert "turn over one of the two" in seen[0].remedy
    seen = list(contract_moving.check(open_rig("far_machine:bench"), 0.9))
    assert "a higher --move" in seen[0].remedy
