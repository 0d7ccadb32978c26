"""The one loop: interpreted on a guarded twin, and compiled, give the same recording."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from macromicro import loop
from macromicro.control import supervisor
from macromicro.design.response import moves
from macromicro.kernel import compiled
from macromicro.plant import bench
from macromicro.programme import MACRO, MICRO, Programme
from macromicro.recorded import COLUMNS, NAMES
from macromicro.recording import Recording
from macromicro.rig import codes, guard
from macromicro.rig.guarded import Guarded
from macromicro.rig.twin import Twin
from macromicro.settings import Settings
from macromicro.simulate import Rolled, prepare, simulate

Block = npt.NDArray[np.float64]


def programme(*moves: tuple[int, float, float]) -> Programme:
    """A sequenced programme of (stage, target, hold)."""
    stage, target, hold = zip(*moves, strict=True)
    return Programme(
        "test",
        np.full(len(moves), np.nan),
        np.array(stage, dtype=np.int64),
        np.array(target, dtype=float),
        np.array(hold, dtype=float),
        float("nan"),
        "test",
    )


SHORT = programme((MACRO, 40.0, 0.0), (MICRO, 0.4e-3, 0.5), (MACRO, 10.0, 0.0))
QUICK = Settings()._replace(
    controller=Settings().controller._replace(
        sequence=Settings().controller.sequence._replace(wait=0.1, dwell=0.05)
    )
)


class Blocks(list[Block]):
    """A sink in memory."""

    def joined(self) -> Block:
        """All rows (columns, periods)."""
        return np.concatenate(self, axis=1)


def rolled(settings: Settings, what: Programme, seed: int, fan: bool = False) -> Block:
    """The compiled run's recording."""
    blocks = Blocks()
    simulate(settings, what, blocks, seed=seed, fan=fan)
    return blocks.joined()


def looped(
    parts: Rolled, seed: int, fast: bool = False, watch: guard.Watch | None = None
) -> tuple[Block, Guarded]:
    """The same run by ``loop.run`` on a guarded twin, interpreted or with compiled steps."""
    blocks = Blocks()
    if fast:
        twin = Twin(
            parts.plant, seed, measure=compiled(bench.measure), advance=compiled(bench.advance)
        )
    else:
        twin = Twin(parts.plant, seed)
    rig = Guarded(twin, parts.watchdog, loop.PERIOD)
    loop.run(
        rig, parts.control, parts.plan, loop.PERIOD, parts.run.progress,
        lambda row, progress: blocks.append(row),
    )  # fmt: skip
    return blocks.joined(), rig


@pytest.mark.parametrize("fast", [False, True], ids=["interpreted", "compiled steps"])
def test_loop_and_rollout_give_equal_recordings(fast: bool) -> None:
    """Section 6.1: macro, wait, laser reset, micro, macro; guard and supervisor included."""
    one = rolled(QUICK, SHORT, seed=3)
    two, rig = looped(prepare(QUICK, SHORT), seed=3, fast=fast)
    assert one.shape == two.shape
    assert one.shape[1] > 900
    assert set(one[NAMES.index("phase")]) == {1.0, 2.0, 3.0, 4.0}
    np.testing.assert_allclose(two, one, rtol=1e-12, atol=0.0)
    assert not rig.tripped


@pytest.mark.slow
def test_laws_with_models_of_their_own_give_equal_recordings() -> None:
    """`terminal` and `inverse`, whose models run on while the other stage has its turn."""
    control = QUICK.controller.joined("terminal,inverse", "test")
    settings = QUICK._replace(controller=control)
    one = rolled(settings, SHORT, seed=3)
    two, _ = looped(prepare(settings, SHORT), seed=3)
    assert one.shape[0] > len(NAMES)
    np.testing.assert_allclose(two, one, rtol=1e-9, atol=1e-12)


def test_the_chunk_length_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    one = rolled(QUICK, SHORT, seed=5)
    monkeypatch.setattr("macromicro.simulate.CHUNK", 137)
    np.testing.assert_array_equal(rolled(QUICK, SHORT, seed=5), one)


def test_same_seed_same_bits_other_seed_other_noise() -> None:
    one, two = rolled(QUICK, SHORT, seed=1), rolled(QUICK, SHORT, seed=1)
    assert one.tobytes() == two.tobytes()
    other = rolled(QUICK, SHORT, seed=2)
    noisy = NAMES.index("hall_voltage")
    assert not np.array_equal(other[noisy, :300], one[noisy, :300])


def test_a_fault_ends_both_runs_at_the_same_period_with_safe_outputs() -> None:
    """A carriage that cannot move: friction far above what the motor gives."""
    bench_ = Settings().bench
    stuck = QUICK._replace(bench=bench_._replace(friction=bench_.friction._replace(coulomb=60.0)))
    far = programme((MACRO, 1500.0, 0.0))
    one = rolled(stuck, far, seed=0)
    two, rig = looped(prepare(stuck, far), seed=0, fast=True)
    np.testing.assert_allclose(two, one, rtol=1e-12, atol=0.0)
    assert rig.watch.fault == codes.STUCK
    assert one[NAMES.index("motor"), -1] == 0.0 and one[NAMES.index("ctrl"), -1] == 0.0
    assert one[NAMES.index("phase"), -1] == supervisor.FAULT
    limit = stuck.guard.stuck
    assert one[0, -1] == pytest.approx(limit, abs=0.01)


def test_a_schedule_overtakes_fine_moves_that_the_carriage_delays() -> None:
    """A new macro target every 50 ms: the fine target between them waits for the last one."""
    start = np.repeat(np.arange(0.0, 1.0, 0.05), 2)
    stage = np.tile([MACRO, MICRO], 20).astype(np.int64)
    coarse = 20.0 + 40.0 * np.arange(20)
    target = np.column_stack([coarse, np.full(20, 0.5e-3)]).ravel()
    what = Programme("", start, stage, target, np.full(40, 0.05), 4.0, "")
    data = rolled(QUICK, what, seed=0)
    assert data[NAMES.index("t"), -1] == pytest.approx(4.0)
    assert data[NAMES.index("macro_position"), -1] == pytest.approx(780.0, abs=2.0)
    assert data[NAMES.index("true_micro"), -500:].mean() == pytest.approx(0.5, abs=5e-3)
    recording = Recording.from_arrays(COLUMNS, data, loop.PERIOD, {})
    done = moves(recording, what)
    assert [m.stage for m in done] == ["macro"] * 20 + ["micro"]
    # Followed, not restarted: the carriage never stands still on the way.
    position = data[NAMES.index("macro_position")]
    on_the_way = position[(position > 60.0) & (position < 700.0)]
    assert len(on_the_way) < 1500


def test_a_run_ended_from_outside_ends_with_its_outputs_off() -> None:
    """Ctrl-C in the middle of a micro step: the recording's last row shows the safe outputs."""
    long = programme((MICRO, 3.0e-3, 60.0))
    blocks, plain = Blocks(), Blocks()

    def stop(t: float, move: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(QUICK, long, blocks, fan=True, progress=stop)
    simulate(QUICK, long, plain, fan=True)
    rows = np.concatenate(blocks, axis=1)
    outputs = [NAMES.index(n) for n in ("motor", "ctrl", "fan", "laser_reset")]
    assert rows[NAMES.index("ctrl"), -2] > 1.0 and rows[NAMES.index("fan"), -2] == 1.0
    assert not rows[outputs, -1].any()
    # Everything that was measured then is what the run would have measured.
    measured = [NAMES.index(n) for n in ("t", "macro_position", "true_micro", "true_wire")]
    then = np.concatenate(plain, axis=1)[measured, rows.shape[1] - 1]
    np.testing.assert_allclose(rows[measured, -1], then, rtol=1e-12)


def test_many_holds_between_two_periods_are_all_worked_off() -> None:
    """6000 holds of 1.1 ms take 2 ms each; the bound on the run's length must allow for that."""
    many = programme(*[(MICRO, 0.0, 1.1e-3)] * 6000)
    assert simulate(QUICK, many, Blocks()).finished
