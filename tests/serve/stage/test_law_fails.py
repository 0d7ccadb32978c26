"""A law that raises is the law's fault: its rig is not opened again, of any machine."""

from __future__ import annotations

import itertools
import logging
import os
import sys
import time
from pathlib import Path

import pytest

from macromicro.control.live import messages as m
from macromicro.recording import Recording
from macromicro.serve import faults
from macromicro.serve.settings import load as chosen
from macromicro.serve.station import Station

MINE = """
from pathlib import Path
from typing import Annotated, NamedTuple
from macromicro.control.stage_law import StageLaw
from macromicro.machines import compositions, rig
from macromicro.schema.par import Par

GIVE_UP = Path(__file__).with_name("give-up")

class Gains(NamedTuple):
    limit: Annotated[float, Par("V", "maximum effort", "mine", positive=True)] = 10.0

class Memory(NamedTuple):
    periods: float

def start(gains, sample):
    return Memory(0.0)

def step(gains, memory, target, sample, dt):
    if GIVE_UP.exists():
        raise RuntimeError("the law gave up")
    return Memory(memory.periods + 1.0), 0.0

law = StageLaw("mine", Gains, Memory, start, step)

def bench(seed, k=0):
    _, own, tree = compositions.each(Path(__file__).with_name("m.toml"))[k]
    return rig.CompiledTwin(own.kind, tree._replace(law="cascade"), seed)

def x(seed):
    return bench(seed, 0)

def y(seed):
    return bench(seed, 1)

def pulled(seed):
    made, n = bench(seed), [0]
    read = made.read
    def broken():
        n[0] += 1
        if n[0] > 500:
            raise OSError("no such device")
        return read()
    made.read = broken
    return made
"""
NUMBERS = itertools.count()
ONE, TWO = "machine = 'axis'\nlaw = '{0}:law'\n", "machine = 'xy'\ny.law = '{0}:law'\n"


def failed(folder: Path, text: str, rig: str, monkeypatch: pytest.MonkeyPatch) -> Station:
    """A station whose loop has ended with an error, its recording in the folder."""
    name = f"lawless{os.getpid()}_{next(NUMBERS)}"  # what is imported once is known by its name
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "path", list(sys.path))
    (folder / f"{name}.py").write_text(MINE, encoding="utf-8")
    (folder / "m.toml").write_text(text.format(name), encoding="utf-8")
    found = chosen(folder / "m.toml")
    patient = found.serve._replace(miss_share=1.0, loop_timeout=5.0, parent_timeout=5.0)
    return Station(
        rig.format(name), settings=found._replace(serve=patient), state=folder / "p.json"
    )


def ended(station: Station, folder: Path) -> faults.Trouble:
    station.start()
    station.acquire("a test")
    station.record(folder / "r.h5", client="a test")
    station.request("a test", m.Enable())
    station.request("a test", m.Home())
    (folder / "give-up").touch()
    end = time.monotonic() + 60.0
    while station.snapshot().running:
        assert time.monotonic() < end
        time.sleep(0.02)
    while "stop" not in station.snapshot().fault.evidence:  # type: ignore[union-attr]
        assert time.monotonic() < end
        time.sleep(0.02)
    found = station.snapshot().fault
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("text", "rig"),
    [
        pytest.param(ONE, "{0}:bench", marks=pytest.mark.slow),
        (ONE, "twin"),
        pytest.param(TWO, "{0}:x+{0}:y", marks=pytest.mark.slow),
        pytest.param(TWO, "twin", marks=pytest.mark.slow),
    ],
)
def test_its_traceback_is_in_the_log_and_the_rig_is_not_opened_again(
    text: str,
    rig: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    monkeypatch.setattr("macromicro.serve.station.REOPEN_S", 0.1)  # between two tries
    with caplog.at_level(logging.ERROR):
        station = failed(tmp_path, text, rig, monkeypatch)
        found = ended(station, tmp_path)
        try:
            assert found.code == faults.CONTROL_FAILED, found
            assert "RuntimeError: the law gave up" in found.evidence and "law" in found.remedy
            assert (
                'raise RuntimeError("the law gave up")' in caplog.text and "in step" in caplog.text
            )
            time.sleep(1.0)  # a rig would be tried again
            assert not station.snapshot().running
        finally:
            station.stop()
    recording = Recording.load(tmp_path / "r.h5")
    assert recording.attributes["finished"] == 0 and len(recording) > 0
    assert "the law gave up" in str(recording.attributes["fault"])


def test_a_rig_that_raises_while_the_law_runs_is_the_rigs_fault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    station = failed(tmp_path, "machine = 'axis'\n", "{0}:pulled", monkeypatch)
    found = ended(station, tmp_path)
    station.stop()
    assert found.code == faults.RIG_FAILED and "no such device" in found.evidence
