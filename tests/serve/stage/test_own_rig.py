"""A rig of a user's with an encoder, served under the law, guard and travel of a machine's file."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted
from macromicro.errors import InputError
from macromicro.serve import settings
from macromicro.serve.station import Station

FILE = Path(__file__).parents[3] / "examples" / "machines" / "printer.toml"
RIG = f"""
from pathlib import Path
from macromicro.machines import machine, rig

def bench(seed):
    own, tree = machine.load(Path({str(FILE)!r}))
    return rig.CompiledTwin(own.kind, tree, seed)

def blind(seed):
    made = bench(seed)
    made.channels = ("laser",)
    return made
"""


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    name = f"stage{os.getpid()}"
    (tmp_path / f"{name}.py").write_text(RIG, encoding="utf-8")
    return name


def test_it_homes_and_moves_under_the_machines_law(lab: str, tmp_path: Path) -> None:
    found = settings.load(FILE)
    assert found is not None
    patient = found._replace(
        serve=found.serve._replace(miss_share=1.0, loop_timeout=5.0, parent_timeout=5.0)
    )
    with Station(f"{lab}:bench", settings=patient, state=tmp_path / "p.json") as station:
        station.acquire("a test")
        station.request("a test", m.Enable())
        for request in (m.Home(), m.MoveTo(0.02)):
            reply = station.request("a test", request)
            assert isinstance(reply, Accepted), reply
            end = station.finished(reply.id, 60.0)
            assert end is not None and end.outcome == m.DONE
        assert end.position == pytest.approx(0.02, abs=found.tree.arrival.tolerance)
    with pytest.raises(InputError, match=r"serving needs encoder.*measures laser"):
        Station(f"{lab}:blind", settings=patient, state=tmp_path / "p.json").start()
