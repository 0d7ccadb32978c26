"""Programmes on the whole bench: the numbers that a recording of the same run shows."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from macromicro import batch, simulate
from macromicro.batch import Variants
from macromicro.batch.programme_job import ProgrammeJob
from macromicro.batch.programme_metrics import METRICS, directions
from macromicro.design.response import moves
from macromicro.errors import InputError
from macromicro.loop import PERIOD
from macromicro.recorded import COLUMNS
from macromicro.recording import Recording
from macromicro.rig import codes
from macromicro.schema.par import replaced
from macromicro.settings import Settings

SHORT = """
[[moves]]
macro = ["20 mm", "5 mm"]
micro = ["1 mm", "0.3 mm", "2 mm"]
hold = "1 s"
"""
PATHS = ("bench.friction.coulomb", "sensors.laser.noise", "seed")
VALUES = np.array([[10.485, 0.43e-6, 0.0], [10.0, 0.6e-6, 7.0]])
ONE = Variants((), np.empty((1, 0)))


@pytest.fixture(name="short", scope="module")
def _short(tmp_path_factory: pytest.TempPathFactory) -> str:
    place = tmp_path_factory.mktemp("programme") / "short.toml"
    place.write_text(SHORT, encoding="utf-8")
    return str(place)


class Sink:
    def __init__(self) -> None:
        self.blocks: list[np.ndarray] = []

    def append(self, block: np.ndarray) -> None:
        self.blocks.append(block)


def recorded(job: ProgrammeJob, settings: Settings, seed: int) -> Recording:
    """The run of `simulate` with all its columns."""
    sink = Sink()
    simulate.simulate(settings, job.setup(settings).programme, sink, seed=seed)
    return Recording.from_arrays(COLUMNS, np.concatenate(sink.blocks, axis=1), PERIOD, {})


def named(row: np.ndarray) -> dict[str, float]:
    return dict(zip((m.name for m in METRICS), row.tolist(), strict=True))


def test_threads_and_what_ran_before_change_nothing(short: str) -> None:
    job = ProgrammeJob(programme=short)
    values = np.tile(VALUES, (2, 1))
    whole = job.evaluate(Variants(PATHS, values))
    assert np.array_equal(whole[:2], whole[2:])
    several = np.concatenate([m for _, m in batch.run(job, Variants(PATHS, values), 3)])
    assert np.array_equal(several, whole)


def test_seed_of_the_job_and_of_a_variant(short: str) -> None:
    of_variant = ProgrammeJob(programme=short).evaluate(Variants(("seed",), np.array([[5.0]])))
    of_job = ProgrammeJob(programme=short, seed=5).evaluate(ONE)
    other = ProgrammeJob(programme=short, seed=6).evaluate(ONE)
    assert np.array_equal(of_variant, of_job)
    assert not np.array_equal(of_job, other)


def test_a_run_that_the_guard_stops(short: str) -> None:
    """Nothing is known of it but the fault, what is missing, and the heat."""
    row = ProgrammeJob(programme=short).evaluate(
        Variants(("bench.friction.coulomb",), np.array([[60.0]]))
    )[0]
    by_name = named(row)
    assert by_name["fault"] == 1.0 and by_name["fault_code"] == codes.MACRO_LOST
    assert by_name["macro_missed"] == 2.0 and by_name["micro_missed"] == 6.0
    assert math.isfinite(by_name["hottest"])
    assert math.isnan(by_name["macro_settling"]) and math.isnan(by_name["vibration"])


@pytest.mark.slow
def test_a_variant_with_another_hall_sensor_is_calibrated(short: str) -> None:
    """By the shipped table it would miss its targets by more than 20 um."""
    job = ProgrammeJob(programme=short)
    other = Variants(("sensors.hall.gain",), np.array([[3.0]]))
    assert named(job.evaluate(other)[0])["micro_error"] < 10.0


def test_cycles_and_fan(short: str) -> None:
    twice = ProgrammeJob(programme=short, cycles=2)
    assert len(twice.setup(Settings()).programme.target) == 16
    one, fan = (ProgrammeJob(programme=short, fan=on).evaluate(ONE) for on in (False, True))
    assert not np.array_equal(one, fan)


def test_an_encoder_of_another_pitch_moves_as_far(short: str) -> None:
    settings = replaced(Settings(), "sensors.encoder.pitch", 0.1e-3)
    targets = ProgrammeJob(programme=short).setup(settings).programme.target
    assert targets[0] == pytest.approx(200.0)


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("bench.wire.stop", 5e-3, "variant 2, bench.wire.stop"),
        ("bench.thermal.ambient", 200.0, "variant 2, bench.thermal.ambient"),
        ("seed", 0.5, "variant 2, seed"),
        ("guard.motor", -9.0, "variant 2, guard.motor"),
    ],
)
def test_impossible_values(short: str, path: str, value: float, said: str) -> None:
    with pytest.raises(InputError, match=said):
        ProgrammeJob(programme=short).evaluate(Variants((path,), np.array([[value]])), 2)


def test_impossible_options(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="programme"):
        ProgrammeJob(programme=str(tmp_path / "none.toml"))
    with pytest.raises(InputError, match="cycles"):
        ProgrammeJob(cycles=0)
    with pytest.raises(InputError, match="seed"):
        ProgrammeJob(seed=-1)


def test_directions_start_anew_after_a_macro_move(short: str) -> None:
    job = ProgrammeJob(programme=short)
    done = moves(recorded(job, Settings(), 0), job.setup(Settings()).programme)
    up, down = directions(done)
    assert [m.move for m in up] == [1, 3, 5, 7]
    assert [m.move for m in down] == [2, 6]
