"""Targets that change all the time are a trajectory: errors on the way and a lag, no moves."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import macromicro
from macromicro.design.tracking import lagging
from macromicro.report import _figures, two_stage
from macromicro.report.run import as_json
from macromicro.report.two_stage import summary
from macromicro.runs import job as experiment


def sine(folder: Path, column: str, middle: float, size: float, seconds: float = 10.0) -> Path:
    """A sine of 10 s in steps of 10 ms."""
    rows = [f"t_s,{column}"]
    for k in range(round(100 * seconds) + 1):
        rows.append(f"{0.01 * k:.2f},{middle - size * math.cos(0.2 * math.pi * 0.01 * k):.5f}")
    rows.append(f"{seconds + 0.01:.2f},{rows[-1].split(',')[1]}")
    path = folder / "sine.csv"
    path.write_text("\n".join(rows))
    return path


@pytest.mark.parametrize("lag", [0.0, 0.0137, 0.25])
def test_a_known_lag_is_found(lag: float) -> None:
    t = np.arange(0.0, 20.0, 1e-3)
    noise = np.random.default_rng(0).normal(0.0, 0.01, len(t))
    found, left = lagging(np.sin(t), np.sin(t - lag) + noise, 1e-3)
    assert found == pytest.approx(lag, abs=2e-3)
    assert left == pytest.approx(0.01, rel=0.1)


def test_what_stands_still_has_no_lag() -> None:
    assert lagging(np.ones(1000), np.ones(1000), 1e-3) == (None, None)


@pytest.mark.parametrize(
    ("column", "middle", "size", "stage", "unit"),
    [("macro_mm", 60.0, 50.0, "macro", "mm"), ("micro_mm", 1.5, 1.0, "micro", "um")],
)
def test_a_sine_is_followed(
    tmp_path: Path, column: str, middle: float, size: float, stage: str, unit: str
) -> None:
    """RMS and peak agree with the recording; the summary stays small, and nothing is a move."""
    path = sine(tmp_path, column, middle, size)
    run = macromicro.run(path, seed=1)
    assert macromicro.moves(run) == []
    (found,) = macromicro.tracking(run)
    assert (found.stage, found.unit) == (stage, unit)
    assert found.targets > 500
    if stage == "macro":
        pitch = 1e3 * macromicro.Settings().sensors.encoder.pitch
        error = (run["macro_reference"] - run["macro_position"]) * pitch
        error = error[np.searchsorted(run["move"], 0) :]
        assert found.rms_error == pytest.approx(math.sqrt(np.mean(error**2)), rel=1e-6)
        assert found.peak_error == pytest.approx(np.abs(error).max())
    assert found.rms_error < found.peak_error
    assert found.lag_s is not None and 0.0 < found.lag_s < 0.2

    job = experiment.check(experiment.Request(str(path), out=tmp_path / "out", seed=1))
    ended = experiment.execute(job)
    assert ended.tracking == [found] and ended.moves == []
    content = as_json(summary(ended, ""))
    assert len(content) < 2000
    assert json.loads(content)["moves_begun"] > 500
    assert two_stage.problems(ended) == []
    assert f"{stage}-stage" in dict(two_stage.remarks(ended))
    names = [drawn.name for drawn in _figures.draw(ended)]
    assert "tracking" in names and "response" not in names


def test_few_or_slow_targets_are_moves() -> None:
    run = macromicro.run("staircase")
    assert macromicro.tracking(run) == [] and len(macromicro.moves(run)) > 3


def test_a_run_of_one_stage_speaks_of_one(tmp_path: Path) -> None:
    path = tmp_path / "one.toml"
    path.write_text('[[moves]]\nmacro = "50 mm"\nhold = "1 s"\n')
    job = experiment.check(experiment.Request(str(path), out=tmp_path / "out"))
    drawn = {d.name: d for d in _figures.draw(experiment.execute(job))}
    assert drawn["response"].title == "Response of the macro-stage"
    assert "micro" not in " ".join(d.caption for n, d in drawn.items() if n != "vibration")
    assert "temperatures" not in drawn
    assert len(drawn["efforts"].figure.axes) == 1
