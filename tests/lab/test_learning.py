"""Learning a repeated trajectory: what a run missed is given beyond the next one's target."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from macromicro.errors import InputError, MacromicroError
from macromicro.lab import learning
from macromicro.programme import MICRO, Programme, load, travel
from macromicro.programme.moves import Limits
from macromicro.recording import Recording
from macromicro.runs import programmed
from macromicro.settings import Settings

LIMITS = Limits(0.0, 4000.0, 0.0, 4e-3, 1.0 / 42e-6)
DT = 1e-3


def wave(folder: Path, seconds: float = 4.0, text: str = "") -> Programme:
    t = np.arange(0.0, seconds, 2e-3)
    x = 1500.0 + 300.0 * (1.0 - np.cos(2.0 * np.pi * np.maximum(t - 1.0, 0.0)))
    rows = [f"{u:.3f},{v:.3f}" for u, v in zip(t, x, strict=True)]
    path = folder / "wave.csv"
    path.write_text(text or "t_s,micro_um\n" + "\n".join([*rows, f"{seconds},{x[-1]:.3f}"]) + "\n")
    return load(path, LIMITS)


class Stage:
    """Follows its set point late, at a scale, with noise; the sensor lags behind it."""

    def __init__(self, lag: float, noise: float = 0.0, scale: float = 0.97) -> None:
        self.lag, self.noise, self.scale, self.asked = lag, noise, scale, [0][:0]

    def __call__(self, programme: Programme, k: int) -> Recording:
        self.asked.append(k)
        t = np.arange(0.0, programme.end, DT)
        move = np.searchsorted(programme.start, t + 1e-9, side="right") - 1
        place = self.scale * programme.set_points[move]
        shown = np.empty_like(place)
        shown[0] = place[0]
        share = math.exp(-DT / self.lag) if self.lag else 0.0
        for i in range(1, len(t)):
            shown[i] = place[i] + (shown[i - 1] - place[i]) * share
        shown += self.noise * np.random.default_rng(k).standard_normal(len(t))
        columns = {
            "t": t,
            "move": move,
            "phase": np.full(len(t), 3),
            "micro_reference": 1e3 * programme.target[move],
            "hall_position": 1e3 * shown,
            "true": 1e3 * place,
        }
        return Fake(columns)


class Fake(dict[str, np.ndarray]):
    """As much of a recording as learning looks at."""

    attributes: dict[str, object]

    def __init__(self, columns: dict[str, np.ndarray], finished: int = 1) -> None:
        super().__init__(columns)
        self.attributes = {"finished": finished, "fault": "it was hot"}


def missed(stage: Stage, found: learning.Learned) -> float:
    """RMS of the true place off the target, in the trajectory."""
    run = stage(found.programme, 99)
    error = run["true"] - run["micro_reference"]
    return 1e-3 * float(np.sqrt(np.mean(error[2000:3900] ** 2)))


def test_a_systematic_error_is_learned_and_the_sensor_s_lag_is_not(tmp_path: Path) -> None:
    stage, what = Stage(lag=5e-3), wave(tmp_path)
    found = learning.learn(what, stage, 5e-3, LIMITS, repeats=15)
    assert missed(Stage(5e-3), learning.Learned(what, [], 0, *[None] * 2)) > 40e-6  # type: ignore[arg-type]
    assert missed(stage, found) < 1e-6
    assert found.repetitions[-1].rms < 0.03 * found.repetitions[0].rms
    assert stage.asked[:3] == [0, 1, 2], "each run has noise of its own"
    wrong = learning.learn(what, stage, 0.0, LIMITS, repeats=15)
    assert missed(stage, wrong) > 5e-6, "unknown, the lag is led by"


def test_noise_is_not_learned(tmp_path: Path) -> None:
    stage = Stage(lag=0.0, noise=20e-6, scale=1.0)
    found = learning.learn(wave(tmp_path), stage, 0.0, LIMITS)
    assert found.programme.correction.std() < 5e-6
    assert missed(stage, found) < 5e-6


def test_the_best_run_s_correction_is_kept_and_learning_goes_on_from_it(tmp_path: Path) -> None:
    what = wave(tmp_path)

    class Worse(Stage):
        def __call__(self, programme: Programme, k: int) -> Recording:
            self.scale = 0.97 if k < 4 else 1.2
            return super().__call__(programme, k)

    found = learning.learn(what, Worse(0.0), 0.0, LIMITS, repeats=7)
    assert found.best == 3
    again = learning.learn(found.programme, Stage(0.0), 0.0, LIMITS, repeats=2)
    assert again.repetitions[0].rms == pytest.approx(found.repetitions[3].rms)


def test_the_sum_stays_within_the_travel(tmp_path: Path) -> None:
    narrow = LIMITS._replace(micro_hi=2.1e-3 + 5e-6)
    found = learning.learn(wave(tmp_path), Stage(0.0), 0.0, narrow, repeats=8)
    assert found.programme.set_points.max() <= narrow.micro_hi
    assert found.programme.correction.max() > 20e-6


def test_what_is_no_trajectory(tmp_path: Path) -> None:
    moves = tmp_path / "moves.csv"
    moves.write_text("t_s,micro_um\n0,100\n1,200\n2,200\n")
    with pytest.raises(InputError, match="no trajectory of the micro-stage"):
        learning.learn(load(moves, LIMITS), Stage(0.0), 0.0, LIMITS)
    t = np.arange(0.0, 2.0, 0.01)
    rows = [f"{u:.2f},{100 + k},{10 if k < 90 else 20}" for k, u in enumerate(t)]
    moves.write_text("t_s,micro_um,macro_mm\n" + "\n".join([*rows, "2.5,299,20"]))
    with pytest.raises(InputError, match="macro moves between its micro targets"):
        learning.learn(load(moves, LIMITS), Stage(0.0), 0.0, LIMITS)


def test_a_first_run_that_is_best_has_no_correction(tmp_path: Path) -> None:
    def worse(programme: Programme, k: int) -> Recording:
        return Stage(0.0, scale=0.97 - 0.1 * k)(programme, k)

    found = learning.learn(wave(tmp_path), worse, 0.0, LIMITS, repeats=3)
    assert found.best == 0 and len(found.repetitions) == 3
    assert not found.programme.correction.any()
    assert found.first is found.last


def test_a_run_that_ended_early_is_not_learned_from(tmp_path: Path) -> None:
    what, stage = wave(tmp_path), Stage(0.0)
    with pytest.raises(MacromicroError, match="ended early: it was hot"):
        learning.learn(what, lambda p, k: Fake(stage(p, k), finished=0), 0.0, LIMITS)


@pytest.mark.slow
def test_on_the_bench_the_laser_shows_less_error_too(tmp_path: Path) -> None:
    settings = Settings()
    settings = settings._replace(controller=settings.controller.joined("inverse", "law"))
    limits = travel.limits(settings.travel, settings.sensors.encoder.pitch)
    what = wave(tmp_path)

    def run(programme: Programme, k: int) -> Recording:
        return programmed.record(programme, settings, seed=k).recording

    found = learning.learn(what, run, learning.sensor_lag(settings), limits, repeats=4)
    first, best = found.repetitions[0], found.repetitions[found.best]
    assert best.rms < 0.5 * first.rms
    assert best.true < 0.5 * first.true
    recording = run(found.programme, 7)
    fine = found.programme.stage == MICRO
    assert 1e3 * found.programme.target[fine].max() == pytest.approx(
        recording["micro_reference"].max()
    ), "recorded is what is wanted, not what the law is given"
