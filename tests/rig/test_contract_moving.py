"""``macromicro doctor --rig NAME --move VOLTS`` on a machine that outlives its program."""

from __future__ import annotations

import importlib
import math
import re
from pathlib import Path

import pytest

from macromicro.rig import contract
from macromicro.rig.opening import open_rig
from tests.systems import posix

MACHINE = Path(__file__).parent / "cards" / "far_machine.py"


@pytest.fixture(params=[math.inf, 0.03], ids=["held", "watched"])
def machine(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> float:
    """A machine whose amplifier has a watchdog of so many seconds; its rig can be imported."""
    cells = tmp_path / "cells"
    monkeypatch.setenv("FAR_MACHINE", str(cells))
    monkeypatch.setenv("PYTHONPATH", str(MACHINE.parent))
    monkeypatch.syspath_prepend(str(MACHINE.parent))
    importlib.import_module(MACHINE.stem).begin(cells, request.param)
    return float(request.param)


@posix
def test_a_killed_process_leaves_the_motor_on_unless_a_watchdog_drops_it(machine: float) -> None:
    seen = {e.what: e for e in contract.check_moving(open_rig("far_machine:bench"), 3.0)}
    assert list(seen) == ["direction", "coming to rest", "killed process"]
    assert seen["direction"].passed and seen["coming to rest"].passed
    last = seen["killed process"]
    told = re.search(r"(\S+) counts in .* SIGKILL, (\S+) after .* on for about (\S+) s", last.found)
    assert told
    gone, coasted, powered = map(float, told.groups())
    if machine < 1.0:
        assert last.passed
        assert 0 <= gone < 150, "the watchdog's 0.03 s, and once more where it was late"
    else:
        assert not last.passed
        assert gone >= 599, "2000 counts/s for 0.3 s, and on until it was opened again"
        assert "watchdog of its own" in last.remedy
        assert powered == pytest.approx((gone - coasted) / 2000.0, rel=0.1)


@pytest.mark.parametrize("machine", [math.inf], indirect=True)
def test_wrong_sense_and_too_little(machine: float) -> None:
    seen = list(contract.check_moving(open_rig("far_machine:turned"), 3.0))
    assert [e.what for e in seen] == ["direction"]
    assert "turn over one of the two" in seen[0].remedy
    seen = list(contract.check_moving(open_rig("far_machine:bench"), 0.9))
    assert "a higher --move" in seen[0].remedy
