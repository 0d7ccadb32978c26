"""summary.json: valid JSON with the same figures as the page."""

from __future__ import annotations

import json
import math

import pytest

import macromicro
from macromicro.recorded import NAMES
from macromicro.report.run import as_json
from macromicro.report.two_stage import summary
from macromicro.runs.job import Ended

WHEN = "2026-01-02 03:04:05+00:00"
MOVE_KEYS = {
    "stage",
    "target",
    "unit",
    "start_s",
    "arrived_s",
    "settling_s",
    "band",
    "final_error",
    "overshoot",
}


def test_has_what_a_reader_counts_on(ended: Ended) -> None:
    found = json.loads(as_json(summary(ended, WHEN)))
    assert found["seed"] == 3 and found["cycles"] == 2 and found["fan"] is False
    assert found["version"] == macromicro.__version__
    assert found["programme"] == "Short <b>& quick</b>"
    assert found["finished"] is True and found["fault"] is None
    assert found["overrides"] == {"sensors.laser.noise": "0.5 um"}
    assert found["simulated_s"] == pytest.approx(len(ended.recording) * 1e-3)
    assert found["wall_s"] > 0.0
    assert [m["stage"] for m in found["moves"]] == 2 * ["macro", "micro", "micro", "macro", "micro"]
    for move in found["moves"]:
        assert set(move) >= MOVE_KEYS
        assert move["settling_s"] == pytest.approx(move["arrived_s"] - move["start_s"])
    first, second = found["moves"][:2]
    assert (first["target"], first["unit"], first["target_counts"]) == (40.0, "mm", 560.0)
    assert (second["target"], second["unit"], second["band"]) == (1500.0, "um", 10.0)
    assert len(found["vibration"]) <= 2  # those of the first cycle
    assert [c["cycle"] for c in found["extension"]] == [1, 2]


def test_final_error_is_the_lasers_over_the_last_half_second(ended: Ended) -> None:
    """Target minus the mean laser reading over the hold's last 0.5 s."""
    move = ended.moves[1]
    rows = ended.recording["move"] == move.move
    mean = ended.recording["laser"][rows][-500:].mean()
    assert move.final_error == pytest.approx(1500.0 - mean)
    assert abs(move.final_error) < 5.0


def test_same_seed_same_recording_bit_for_bit(ended: Ended) -> None:
    from macromicro import simulate

    blocks = []

    class Kept:
        def append(self, block: object) -> None:
            blocks.append(block)

    simulate.simulate(ended.job.settings, ended.job.programme, Kept(), seed=3)
    laser = [x for block in blocks for x in block[NAMES.index("laser")]]
    assert (ended.recording["laser"] == laser).all()


def test_nan_becomes_null() -> None:
    text = as_json({"a": [math.nan, (math.inf, 1.5)], "b": {"c": -math.inf}, "d": "NaN"})
    assert json.loads(text) == {"a": [None, [None, 1.5]], "b": {"c": None}, "d": "NaN"}
