"""What runs while a machine is driven has run before the first period: of both kinds of machine."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from macromicro import hall_table
from macromicro.control.live import messages as m
from macromicro.control.live.messages import STAGES
from macromicro.rig import guard
from macromicro.serve import health, live, loop_process, warming
from macromicro.serve._launching import LIVE, Spec
from macromicro.serve.settings import LiveSettings, load
from macromicro.serve.stage._machine import Led
from macromicro.serve.warming import warm

EXAMPLES = Path(__file__).parents[2] / "examples" / "machines"


@pytest.fixture
def driven(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, str]]:
    """Mode and kind of motion of every period that any live machine is driven."""
    seen: list[tuple[int, str]] = []

    def watched(step: Callable[..., object]) -> Callable[..., object]:
        def stepped(self: live.Live, *given: object) -> object:
            found = step(self, *given)
            motion = self._s.motion
            seen.append((self._s.mode, "" if motion is None else motion.kind))
            return found

        return stepped

    for kind in (live.Live, Led):
        monkeypatch.setattr(kind, "step", watched(kind.step))
    return seen


def rehearsed(stages: tuple[str, ...]) -> None:
    settings = LiveSettings()
    table = hall_table.of_bench(settings)
    limits = guard.prepare(settings.guard, table)
    warm(live.make(settings, table, stages), limits, settings)


def test_the_two_stage_machine_homes_jogs_moves_and_holds(driven: list[tuple[int, str]]) -> None:
    rehearsed(STAGES)
    motions = {
        (m.HOMING, "home"),
        (m.MOVING_MACRO, "jog macro"),
        (m.MOVING_MICRO, "jog micro"),
        (m.MOVING_MACRO, "move macro"),
        (m.SETTLING, "move macro"),
        (m.MOVING_MICRO, "move micro"),
        (m.MOVING_MACRO, "move to"),
        (m.STOPPED, "home"),
        (m.STOPPED, "jog macro"),
    }
    rests = {(mode, "") for mode in (m.DISABLED, m.READY, m.HOLDING, m.STOPPED)}
    assert motions | rests <= set(driven)
    assert m.FAULT not in {mode for mode, _ in driven}
    assert len(driven) < 3000  # a start takes no longer than these


@pytest.mark.parametrize(("stage", "mode"), [(m.MACRO, m.HOMING), (m.MICRO, m.MOVING_MICRO)])
def test_a_machine_without_the_other_stage_moves_too(
    driven: list[tuple[int, str]], stage: str, mode: int
) -> None:
    rehearsed((stage,))
    assert mode in {mode for mode, _ in driven}


@pytest.mark.parametrize("name", ["screw", "piezo-100um"])
def test_a_machine_of_one_stage_moves_jogs_and_homes(
    driven: list[tuple[int, str]], name: str
) -> None:
    settings = load(EXAMPLES / f"{name}.toml")
    loop_process.open_machine(Spec("twin", 0, settings, "none", LIVE, 0)).warm()
    found = set(driven)
    kinds = {kind for mode, kind in found if mode in m.MOVING}
    assert kinds == {"move to", "jog macro"} | ({"home"} if name == "screw" else set())
    assert {(m.DISABLED, ""), (m.READY, ""), (m.STOPPED, "jog macro"), (m.STOPPED, "")} <= found
    assert m.FAULT not in {mode for mode, _ in driven}
    assert len(driven) < 2000


def test_a_warm_machine_is_known_as_compiled() -> None:
    rehearsed(STAGES)
    assert warming.is_compiled()
    assert health.compiler_cache().state == health.OK


@pytest.mark.slow
def test_another_process_compiles_all_but_the_bench(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MACROMICRO_CACHE", str(tmp_path))
    with warming.others_beside():
        assert not warming.is_compiled()
    made = {place.name.partition("-")[0] for place in tmp_path.rglob("*.nbi")}
    assert made == {"guarded._guard", "surveying._survey"}
