"""The metrics of a run are what its table of moves says."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from macromicro.batch import SEED, Variants
from macromicro.batch.programme_job import ProgrammeJob
from macromicro.batch.programme_metrics import METRICS, NAMES
from macromicro.runs import job as run

# Up, down, up and down again; and once more from zero.
PROGRAMME = """
[[moves]]
macro = ["20 mm", "10 mm"]
micro = ["1 mm", "0.5 mm", "1.5 mm"]
hold = "1.5 s"
"""
COULOMB = "bench.friction.coulomb"


@pytest.fixture(scope="module")
def programme(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("metrics") / "steps.toml"
    path.write_text(PROGRAMME)
    return str(path)


def metrics(job: ProgrammeJob, coulomb: float, seed: int = 4) -> dict[str, float]:
    rows = job.evaluate(Variants((COULOMB, SEED), np.array([[coulomb, float(seed)]])))
    assert rows.shape == (1, len(METRICS))
    return dict(zip(NAMES, map(float, rows[0]), strict=True))


def test_as_in_the_table_of_a_run(programme: str, tmp_path: Path) -> None:
    ended = run.execute(run.check(run.Request(programme, tmp_path / "out", seed=4)))
    coulomb = ended.job.settings.bench.friction.coulomb
    found = metrics(ProgrammeJob(programme), coulomb)
    macro = [m for m in ended.moves if m.stage == "macro"]
    micro = [m for m in ended.moves if m.stage == "micro"]
    assert [m.target for m in micro] == [1000.0, 500.0, 1500.0] * 2
    up, down = [micro[k] for k in (0, 2, 3, 5)], [micro[k] for k in (1, 4)]
    assert found["macro_settling"] == max(m.settling_s or math.inf for m in macro)
    assert found["contraction"] == pytest.approx(np.mean([m.settling_s for m in up]))
    assert found["extension"] == pytest.approx(np.mean([m.settling_s for m in down]))
    assert found["micro_error"] == max(abs(m.final_error or 0.0) for m in micro)
    assert found["true_micro_error"] == max(abs(m.true_error or 0.0) for m in micro)
    assert found["micro_overshoot"] == max(m.overshoot or 0.0 for m in micro)
    assert found["vibration"] == max(v.amplitude_um for v in ended.vibration)
    assert found["hottest"] == ended.recording["true_wire"].max()
    assert (found["fault"], found["macro_missed"], found["micro_missed"]) == (0.0, 0.0, 0.0)


def test_of_a_stopped_run_little_is_known(programme: str) -> None:
    """Friction of 60 N: the motor pushes and the carriage never moves."""
    found = metrics(ProgrammeJob(programme), 60.0)
    known = {name for name, value in found.items() if not math.isnan(value)}
    assert known == {"fault", "fault_code", "macro_missed", "micro_missed", "hottest"}
    assert found["fault"] == 1.0
    assert found["fault_code"] > 0.0
    assert (found["macro_missed"], found["micro_missed"]) == (2.0, 6.0)


def test_a_move_that_does_not_arrive_is_never(programme: str, tmp_path: Path) -> None:
    """A little too much friction for the dead-zone inverse: no stop, and no arrival."""
    far = tmp_path / "far.toml"
    far.write_text(PROGRAMME.replace("20 mm", "190 mm"))
    found = metrics(ProgrammeJob(str(far)), 12.3)
    assert found["fault"] == 0.0
    assert found["macro_missed"] > 0.0
    assert found["macro_settling"] == math.inf
    assert not math.isnan(found["micro_error"])
