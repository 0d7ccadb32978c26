"""The twin with faults: the twin without one, and each fault as its words say."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import faulty.bench
from faulty import inject
from faulty.__main__ import main
from faulty.bench import Faulty
from macromicro.errors import InputError
from macromicro.kernel import compiled
from macromicro.plant import bench
from macromicro.plant.bench import Bench, Sensors
from macromicro.rig.twin import Twin
from macromicro.types import SAFE, Outputs, Sample

PUSH = Outputs(4.0, 1.6, 1.0, 0.0)


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> Faulty:
    monkeypatch.delenv(faulty.BOARD, raising=False)
    return faulty.bench.twin(3)


def run(rig: Twin, periods: int, outputs: Outputs = PUSH) -> list[Sample]:
    samples = []
    for _ in range(periods):
        samples.append(rig.read())
        rig.write(outputs)
        rig.clock.wait(1e-3)
    return samples


def true(rig: Faulty) -> float:
    return math.floor(rig.state.macro.x / rig.plant.encoder.pitch)


def test_without_a_fault_it_is_the_twin(rig: Faulty) -> None:
    plant = bench.prepare(Bench(), Sensors())
    plain = Twin(plant, 3, measure=compiled(bench.measure), advance=compiled(bench.advance))
    assert run(rig, 300) == run(plain, 300)
    assert rig.truth() == plain.truth()


@pytest.mark.parametrize(
    ("name", "step"),
    [("encoder-frozen", 0.0), ("encoder-reversed", -1.0), ("encoder-skipping", 0.9)],
)
def test_counts_that_a_fault_changes_stay_changed(name: str, step: float, rig: Faulty) -> None:
    run(rig, 100)
    at = true(rig)
    inject(rig.cells, name)
    run(rig, 100)
    gone = true(rig) - at
    assert gone > 100
    inject(rig.cells, "none")
    shown, rest = run(rig, 50)[-1].encoder, true(rig) - at - gone
    assert shown == pytest.approx(at + step * gone + rest, abs=10.0)


def test_a_jump_comes_once(rig: Faulty) -> None:
    run(rig, 5, SAFE)
    inject(rig.cells, "encoder-jump")
    assert {s.encoder for s in run(rig, 20, SAFE)} == {500.0}


def test_the_hall_sensor_fails_in_five_ways(rig: Faulty) -> None:
    last = run(rig, 50, SAFE)[-1].hall
    spread = {}
    for name in ("hall-stuck", "hall-range", "hall-low", "hall-noisy"):
        inject(rig.cells, name)
        values = [s.hall for s in run(rig, 200, SAFE)]
        spread[name] = (float(np.mean(values)), float(np.std(values)))
    assert spread["hall-stuck"][1] == 0.0 and spread["hall-stuck"][0] == pytest.approx(
        last, abs=0.01
    )
    assert spread["hall-range"] == (pytest.approx(4.9988), pytest.approx(0.0, abs=1e-12))
    assert spread["hall-low"] == (0.0, 0.0)
    assert spread["hall-noisy"][1] == pytest.approx(0.1, rel=0.3)
    inject(rig.cells, "hall-silent")
    assert math.isnan(rig.read().hall)


@pytest.mark.parametrize(
    ("name", "stays"),
    [("motor-dead", "carriage"), ("carriage-stuck", "carriage"), ("wire-broken", "wire")],
)
def test_what_is_cut_or_jammed_does_not_move(name: str, stays: str, rig: Faulty) -> None:
    inject(rig.cells, name)
    before = rig.truth()
    run(rig, 500)
    after = rig.truth()
    held = abs(after.carriage - before.carriage) < 1e-6
    cold = after.wire - before.wire < 1.0
    assert (held, cold) == (stays == "carriage", stays == "wire")


def test_a_fan_that_does_not_turn_cools_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(faulty.BOARD, raising=False)
    temperatures = []
    for name in ("none", "fan-lost"):
        rig = faulty.bench.twin(0)
        inject(rig.cells, name)
        run(rig, 3000)
        temperatures.append(rig.truth().plates)
    assert temperatures[1] > temperatures[0]


def test_the_clock_jumps_and_the_rig_fails(rig: Faulty) -> None:
    run(rig, 3, SAFE)
    for name, later in (("clock-ahead", 3600.0), ("clock-back", -10.0)):
        inject(rig.cells, name)
        assert rig.read().t == pytest.approx(3e-3 + later)
    inject(rig.cells, "unplugged")
    with pytest.raises(OSError, match="unplugged"):
        rig.read()


def test_the_board_shows_truth_outputs_and_when_they_were_safe(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(faulty.BOARD, str(tmp_path / "board"))
    rig = faulty.bench.twin(0)
    cells = faulty.board(tmp_path / "board")
    run(rig, 10)
    assert math.isnan(cells[faulty.SAFE_AT])
    assert cells[[faulty.MOTOR, faulty.CTRL, faulty.FAN]].tolist() == [4.0, 1.6, 1.0]
    assert cells[faulty.CARRIAGE] == rig.truth().carriage
    rig.stop()
    assert cells[faulty.SAFE_AT] == pytest.approx(0.01)
    rig.write(Outputs(math.nan, 0.0, 0.0, 0.0))
    assert cells[faulty.ILLEGAL] == 1


def test_a_person_switches_faults_on_and_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(faulty.BOARD, str(tmp_path / "board"))
    assert main(["hall-stuck"]) == 2  # nothing runs there
    rig = faulty.bench.twin(0)
    assert main(["hall-stuck"]) == 0
    assert len({s.hall for s in run(rig, 50, SAFE)}) == 1
    assert main(["none"]) == 0
    assert len({s.hall for s in run(rig, 50, SAFE)}) > 1
    capsys.readouterr()
    for wrong in ([], ["nonsense"], ["none", "none"]):
        assert main(wrong) == 2
        listed = capsys.readouterr().out
        assert all(name in listed for name in faulty.NAMES)
    with pytest.raises(InputError, match="encoder-frozen"):
        inject(faulty.board(), "nonsense")
