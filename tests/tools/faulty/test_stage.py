"""Faulty stages: without a fault the twin, and each fault as its words say."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

import faulty
from faulty import inject, possible
from faulty import stage as stages
from faulty.stage import FaultyStage
from macromicro.errors import InputError
from macromicro.machines import machine as machines
from macromicro.machines.rig import CompiledTwin
from macromicro.types import SAFE

EXAMPLES = Path(__file__).parents[3] / "examples" / "machines"
SWITCHED = '\n[switches]\nlimits = "both"\nhome = "below"\n'
PUSH = SAFE._replace(motor=5.0)


def loaded(folder: Path, name: str, more: str = "") -> tuple[Any, Any]:
    file = folder / name
    file.write_text((EXAMPLES / name).read_text() + more)
    return machines.load(file)


def run(rig: CompiledTwin, periods: int, outputs: Any = PUSH) -> list[Any]:
    shown = []
    for _ in range(periods):
        shown.append(rig.read())
        rig.write(outputs)
        rig.clock.wait(rig.dt)
    return shown


@pytest.fixture
def slide(tmp_path: Path) -> FaultyStage:
    return FaultyStage(*loaded(tmp_path, "printer.toml"), 3)


def test_without_a_fault_it_is_the_twin(slide: FaultyStage, tmp_path: Path) -> None:
    machine, tree = loaded(tmp_path, "printer.toml")
    assert run(slide, 200) == run(CompiledTwin(machine.kind, tree, 3), 200)


@pytest.mark.parametrize(
    ("name", "share"),
    [("encoder-frozen", 0.0), ("encoder-reversed", -1.0), ("encoder-skipping", 0.9)],
)
def test_counts_of_motion_are_changed(name: str, share: float, slide: FaultyStage) -> None:
    before = run(slide, 60)[-1].encoder
    inject(slide.cells, name)
    last = run(slide, 60)[-1].encoder
    true = round(slide.cells[faulty.CARRIAGE] / slide.pitch)
    assert true - before > 50
    assert last - before == pytest.approx(share * (true - before), abs=3.0)


def test_a_jump_comes_once_and_a_dither_is_one_count(slide: FaultyStage) -> None:
    inject(slide.cells, "encoder-jump")
    assert {s.encoder for s in run(slide, 20, SAFE)} == {500.0}
    inject(slide.cells, "encoder-dither")
    shown = [s.encoder for s in run(slide, 500, SAFE)]
    assert {*shown} == {500.0, 501.0}
    assert 20 < shown.count(501.0) < 90


def test_a_dead_motor_and_a_reversed_one(slide: FaultyStage) -> None:
    inject(slide.cells, "motor-dead")
    assert run(slide, 100)[-1].encoder == 0.0
    assert slide.cells[faulty.MOTOR] == 5.0
    inject(slide.cells, "motor-reversed")
    assert run(slide, 60)[-1].encoder < -10.0


def test_a_jammed_stage_stands(slide: FaultyStage) -> None:
    run(slide, 60)
    inject(slide.cells, "carriage-stuck")
    assert len({s.encoder for s in run(slide, 60)}) == 1


def test_a_sensor_is_silent_and_noisy(slide: FaultyStage) -> None:
    inject(slide.cells, "encoder-silent")
    assert all(math.isnan(s.encoder) for s in run(slide, 5))
    inject(slide.cells, "encoder-noisy")
    shown = [s.encoder for s in run(slide, 200, SAFE)]
    assert max(shown) - min(shown) > 300.0


def test_an_absolute_sensor_jumps_by_a_quarter_of_its_travel(tmp_path: Path) -> None:
    machine, tree = loaded(tmp_path, "piezo-100um.toml")
    rig = FaultyStage(machine, tree, 0)
    before = run(rig, 5, SAFE)[-1].encoder
    inject(rig.cells, "encoder-jump")
    leap = (run(rig, 1, SAFE)[-1].encoder - before) * rig.pitch
    assert leap == pytest.approx(0.25 * (tree.travel.high - tree.travel.low), abs=5e-9)
    inject(rig.cells, faulty.NONE)
    assert abs(run(rig, 1, SAFE)[-1].encoder - before) * rig.pitch < 5e-9


def test_switches(tmp_path: Path) -> None:
    rig = FaultyStage(*loaded(tmp_path, "screw.toml", SWITCHED), 0)
    free = run(rig, 1, SAFE)[0]
    inject(rig.cells, "limit-on")
    assert run(rig, 3, SAFE)[-1].limit_low == 1.0
    inject(rig.cells, "limits-off")
    seen = run(rig, 3, SAFE)[-1]
    assert (seen.limit_low, seen.limit_high) == (0.0, 0.0)
    inject(rig.cells, "limit-cut")  # closed while free: a cut wire trips
    assert run(rig, 3, SAFE)[-1].limit_low == 1.0
    inject(rig.cells, "home-glitch")
    inject(rig.cells, faulty.NONE)
    assert run(rig, 1, SAFE)[0].home == free.home
    inject(rig.cells, "limits-swapped")
    seen = run(rig, 1, SAFE)[0]
    assert (seen.limit_low, seen.limit_high) == (free.limit_high, free.limit_low)


def test_a_glitch_lasts_one_millisecond(tmp_path: Path) -> None:
    rig = FaultyStage(*loaded(tmp_path, "screw.toml", '\n[switches]\nlimits = "both"\n'), 0)
    rig.injected["limit_high"] = 0.0
    inject(rig.cells, "limit-glitch")
    period = rig.dt
    shown = [s.limit_low for s in run(rig, 12, SAFE)]
    assert shown[: round(1e-3 / period)] == [1.0] * round(1e-3 / period)


def test_a_rig_can_have_the_faults_of_what_it_has(slide: FaultyStage, tmp_path: Path) -> None:
    switched = FaultyStage(*loaded(tmp_path, "screw.toml", SWITCHED), 0)
    assert {*possible(switched)} - {*possible(slide)} == {
        name for name in faulty.NAMES if name.startswith(("limit", "home"))
    }
    assert not [
        name for name in possible(slide) if name.startswith(("hall", "laser", "fan", "wire"))
    ]


def test_the_board_says_when_outputs_were_safe(slide: FaultyStage) -> None:
    run(slide, 10)
    assert math.isnan(slide.cells[faulty.SAFE_AT])
    slide.stop()
    assert slide.cells[faulty.SAFE_AT] == pytest.approx(0.01)
    slide.write(SAFE._replace(motor=11.0))
    assert slide.cells[faulty.ILLEGAL] == 1.0


def test_factories_need_a_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(stages.MACHINE, raising=False)
    monkeypatch.delenv(faulty.BOARD, raising=False)
    with pytest.raises(InputError, match=stages.MACHINE):
        stages.stage(0)
    monkeypatch.setenv(stages.MACHINE, str(EXAMPLES / "disc.toml"))
    assert stages.stage(0).channels == ("encoder",)
    monkeypatch.setenv(stages.MACHINE, str(EXAMPLES / "xy-plotter.toml"))
    assert stages.x(0).pitch == stages.y(0).pitch
