"""The whole positioner: impossible benches, repeatability, and the step of integration."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from macromicro.plant import bench
from macromicro.plant._steps import Steps
from macromicro.plant.bench import Bench, Sensors
from macromicro.programme import MACRO, MICRO
from macromicro.recorded import COLUMNS
from macromicro.schema.par import entries, replaced
from macromicro.settings import Settings
from macromicro.simulate import simulate
from macromicro.types import Outputs

from ..test_loop import Blocks, programme
from .drives import COUNT, PLANT, drive

IMPOSSIBLE: list[tuple[str, Any, str]] = [
    ("wire.stop", 4.5e-3, "wire.stop"),
    ("driver.contract_on", 3.99e-3, "driver.contract_on"),
    ("driver.contract_off", 3.9795e-3, "driver.contract_off"),
    ("carriage.stop_low", 0.3, "carriage.stop_low"),
    ("driver.map_heat", (0.0, 1.0), "driver.map_heat"),
    ("driver.map_ctrl", (1.3, 1.25, *Bench().driver.map_ctrl[2:]), "driver.map_ctrl"),
    ("friction.ripple", 11.0, "friction.ripple"),
    ("carriage.stop_low", 0.01, "carriage.stop_low"),
    ("carriage.stop_high", -5e-3, "carriage.stop_high"),
    ("amplifier.bits", 12.5, "amplifier.bits"),
    ("driver.map_heat", (1.0, *Bench().driver.map_heat[1:]), "driver.map_heat"),
    ("phase.heat_start", 109.5, "phase.heat_start"),
    ("phase.heat_end", 121.0, "phase.heat_end"),
    ("phase.cool_end", 42.0, "phase.cool_end"),
]


def test_default_bench_is_possible() -> None:
    assert Bench().problems() == []


@pytest.mark.parametrize(("path", "value", "named"), IMPOSSIBLE)
def test_each_impossible_bench_is_found_and_named(path: str, value: Any, named: str) -> None:
    """A stop beyond the stroke and its like: parameter, value, and what would be right."""
    found = replaced(Bench(), path, value).problems()
    assert [name for name, _, _ in found] == [named]
    assert all(accepted for _, _, accepted in found)


@pytest.mark.parametrize("path", ["encoder.bits", "converter.bits"])
def test_half_a_bit_is_found_and_named(path: str) -> None:
    """Section 3.2.3, 3.3: a counter and a converter have whole bits."""
    assert Sensors().problems() == []
    found = replaced(Sensors(), path, 12.5).problems()
    assert [name for name, _, _ in found] == [path]


def test_every_default_lies_within_its_bounds() -> None:
    """The bounds that settings files are held to must admit the bench itself."""
    for tree in (Bench(), Sensors()):
        for entry in entries(tree):
            values = entry.value if isinstance(entry.value, tuple) else (entry.value,)
            for value in values:
                assert entry.par.lo <= value <= entry.par.hi, entry.path
                assert value > 0.0 or not entry.par.positive, entry.path
            assert entry.par.source, entry.path
            assert entry.par.meaning, entry.path


@pytest.mark.slow
def test_same_seed_same_bits_other_seed_other_noise() -> None:
    motor, ctrl = np.full(1500, 3.5), np.full(1500, 1.6)
    one, two, other = (drive(motor, ctrl, seed) for seed in (1, 1, 2))
    assert one.tobytes() == two.tobytes()
    assert not np.array_equal(one[1], other[1])
    np.testing.assert_array_equal(one[0], other[0])  # the encoder has no noise


def test_outputs_reach_the_machine_one_period_late() -> None:
    """The D/A board latches: the chatter of Figure 4.20 depends on it."""
    s = bench.initial(PLANT)
    push = Outputs(5.0, 5.0, 0.0, 0.0)
    first = bench.advance(PLANT, s, push, bench.Noise(), 1e-3)
    assert first.macro.i == 0.0 and first.micro.power == 0.0
    second = bench.advance(PLANT, first, push, bench.Noise(), 1e-3)
    assert second.macro.i > 0.1 and second.micro.power > 0.1


def test_ctrl_has_no_negative_side_and_is_rounded_to_a_code() -> None:
    """Sections 3.2.1, 3.3: CTRL is 0-5 V."""
    s = bench.advance(
        PLANT, bench.initial(PLANT), Outputs(-9.0, -2.0, 0.0, 0.0), bench.Noise(), 1e-3
    )
    assert s.ctrl == 0.0
    assert s.motor == -5.0
    s = bench.advance(
        PLANT, bench.initial(PLANT), Outputs(0.0, 1.5001, 0.0, 0.0), bench.Noise(), 1e-3
    )
    assert s.ctrl == pytest.approx(1.5, abs=5.0 / 4096.0)
    assert s.ctrl * 4096.0 / 10.0 == round(s.ctrl * 4096.0 / 10.0)


def test_a_carriage_at_rest_shows_its_place_and_does_not_move() -> None:
    """The machine starts in the middle of a count, cold, extended."""
    s = bench.initial(PLANT, 0.1)
    m = bench.measure(PLANT, s, 0.0, bench.Noise())
    assert (m.encoder, m.extend, m.contract) == (1400.0, 1.0, 0.0)
    assert m.laser == 0.0
    for _ in range(50):
        s = bench.advance(PLANT, s, Outputs(0.0, 0.0, 0.0, 0.0), bench.Noise(), 1e-3)
    assert s.macro.x == pytest.approx(0.1 + COUNT / 2, abs=1e-12)
    assert abs(s.micro.wire.x) < 1e-15


def test_an_accelerating_carriage_pulls_on_the_micro_stage() -> None:
    """The platform's mass loads the wires while the carriage gathers speed."""
    s = bench.initial(PLANT)
    before = bench.stage(PLANT, s) - s.macro.x
    for _ in range(4):
        s = bench.advance(PLANT, s, Outputs(5.0, 0.0, 0.0, 0.0), bench.Noise(), 1e-3)
    assert s.macro.accel > 1.0
    assert abs(s.micro.wire.x - before) > 1e-7


@cache
def recorded(
    fine: bool, exact: bool, seed: int, moves: tuple[tuple[int, float, float], ...]
) -> Any:
    """Columns of a run; `fine`: both steps halved; `exact`: no noise, no rounding of volts."""
    settings = Settings()
    if fine:
        steps = settings.bench.steps
        halved = Steps(2 * steps.macro, 2 * steps.micro)
        settings = replaced(settings, "bench.steps", halved)
    if exact:
        for path, value in (
            ("sensors.hall.noise", 0.0),
            ("sensors.converter.bits", 24.0),
            ("bench.amplifier.bits", 24.0),
            ("guard.frozen", 1e6),  # a Hall sensor without noise looks frozen
        ):
            settings = replaced(settings, path, value)
    blocks = Blocks()
    outcome = simulate(settings, programme(*moves), blocks, seed=seed)
    assert outcome.finished
    data = blocks.joined()
    return {c.name: data[i] for i, c in enumerate(COLUMNS)}


def holds(data: Any, move: int) -> np.ndarray:
    """True micro position [um] over the last 0.5 s of a move's hold."""
    return 1e3 * data["true_micro"][np.flatnonzero(data["move"] == move)[-500:]]


def micro_moves(*targets: float) -> tuple[tuple[int, float, float], ...]:
    """Micro moves [mm] of 2 s."""
    return tuple((MICRO, target * 1e-3, 2.0) for target in targets)


STEPS = [
    micro_moves(1.5, 3.0, 1.5, 0.3),
    micro_moves(2.0, 3.0, 2.0, 0.3),
    micro_moves(1.0, 2.0, 3.0, 2.5, 0.6),
]


@pytest.mark.parametrize("moves", STEPS)
def test_halving_the_steps_leaves_settled_micro_positions(
    moves: tuple[tuple[int, float, float], ...],
) -> None:
    """Within 0.1 um, as far as the step decides: exact voltages, no noise.

    The 12-bit converters decide by single codes where the stage comes to rest: with them,
    a microkelvin more in the room moves a rest by up to 0.7 um, as another seed does, and
    no step of integration is fine enough (see the next test). Settled: the stage stands
    still in the hold's last half second.
    """
    one, two = recorded(False, True, 0, moves), recorded(True, True, 0, moves)
    settled = 0
    for k in range(len(moves)):
        a, b = holds(one, k), holds(two, k)
        if max(np.ptp(a), np.ptp(b)) < 0.1:
            settled += 1
            assert abs(a.mean() - b.mean()) <= 0.1
    assert settled >= len(moves) - 1


def test_with_the_real_converters_the_step_matters_no_more_than_the_noise() -> None:
    """Halving both steps moves the rests as another seed does: by a Hall code, about 1 um."""
    by_step, by_seed = [], []
    for moves in STEPS:
        one, two = recorded(False, False, 0, moves), recorded(True, False, 0, moves)
        other = recorded(False, False, 1, moves)
        for k in range(len(moves)):
            by_step.append(abs(holds(one, k).mean() - holds(two, k).mean()))
            by_seed.append(abs(holds(one, k).mean() - holds(other, k).mean()))
    assert np.mean(by_step) <= 2.0 * np.mean(by_seed) + 0.1
    assert max(by_step) <= 5.0


def test_halving_the_steps_leaves_macro_arrivals() -> None:
    """Section 4.3: no arrival moves by more than one count, whatever the distance."""
    targets = (2660.0, 140.0, 2380.0, 420.0, 700.0, 690.0, 2800.0, 0.0)
    moves = tuple((MACRO, target, 0.0) for target in targets)
    one, two = recorded(False, False, 0, moves), recorded(True, False, 0, moves)
    for k, target in enumerate(targets):
        ends = [d["macro_position"][np.flatnonzero(d["move"] == k)[-1]] for d in (one, two)]
        assert abs(ends[0] - ends[1]) <= 1.0
        assert abs(ends[0] - target) <= 2.0
