"""One way to run a programme: whoever asks sees the same machine."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import macromicro
from macromicro import batch, programme, simulate
from macromicro.batch import Variants
from macromicro.errors import InputError
from macromicro.recording import Recording
from macromicro.runs import job, programmed
from macromicro.runs.sequence import micro_steps
from macromicro.schema.par import replaced
from macromicro.settings import Settings
from macromicro.thesis.procedure import Lab

# Another Hall sensor, which every way has to calibrate on the bench first.
OTHER = replaced(Settings(), "sensors.hall.gain", 2.5)
CONFIG = '[sensors.hall]\ngain = "2.5 V"\n'
WHAT = "staircase"


@pytest.fixture(scope="module")
def wanted() -> Recording:
    return macromicro.run(WHAT, seed=4, settings=OTHER)


def same(found: Recording, wanted: Recording) -> None:
    assert [c.name for c in found.columns] == [c.name for c in wanted.columns]
    for c in wanted.columns:
        assert found[c.name].tobytes() == wanted[c.name].tobytes(), c.name


def test_the_command_records_the_same(wanted: Recording, tmp_path: Path) -> None:
    config = tmp_path / "other.toml"
    config.write_text(CONFIG, encoding="utf-8")
    request = job.Request(programme=WHAT, out=tmp_path / "out", config=config, seed=4)
    found = job.execute(job.check(request)).recording
    same(found, wanted)
    told = {k: v for k, v in wanted.attributes.items() if k not in ("finished", "fault")}
    assert {k: found.attributes[k] for k in told} == told


def test_a_procedure_runs_the_same(wanted: Recording) -> None:
    what = programmed.load(programme.find(WHAT), OTHER)
    same(Lab().runner()(what, OTHER, 4, False), wanted)


def test_a_study_s_job_runs_the_same(wanted: Recording) -> None:
    """What it measures is what the recording shows."""
    made = batch.job("programme", programme=WHAT, seed=4, settings=OTHER)
    found = made.evaluate(Variants((), np.empty((1, 0))))[0]
    shown = made.setup(OTHER).measured(wanted, 0)
    assert np.array_equal(found, shown, equal_nan=True)


def test_the_shipped_table_would_be_another_machine(wanted: Recording) -> None:
    """What the ways share: without its own calibration this sensor moves the stage elsewhere."""
    assert not np.array_equal(wanted["ctrl"], macromicro.run(WHAT, seed=4)["ctrl"])


def test_the_recording_tells_what_ran_and_how_it_ended() -> None:
    done = programmed.record(micro_steps([1e-3], 0.5), OTHER, seed=2, fan=True, cycles=2)
    about = done.recording.attributes
    assert about["version"] == macromicro.__version__
    assert (about["seed"], about["cycles"], about["fan"], about["finished"]) == (2, 2, 1, 1)
    assert "sensors.hall.gain" in str(about["overrides"]) and "2.5 V" in str(about["settings"])
    assert done.outcome.finished and isinstance(done.outcome, simulate.Outcome)


def test_a_recording_is_replayed_by_the_same_function(wanted: Recording) -> None:
    """Beside what the controller asks for now stands what it did; the sensors are the same."""
    what = programmed.load(programme.find(WHAT), OTHER)
    found = programmed.record(what, OTHER, on=wanted).recording
    assert found["hall_voltage"].tobytes() == wanted["hall_voltage"][: len(found)].tobytes()
    assert np.abs(found["ctrl"] - found["recorded_ctrl"]).max() < 1e-9


def test_a_recording_without_sensors_is_refused(wanted: Recording) -> None:
    bare = Recording.from_arrays(wanted.columns[:1], [wanted["t"]], wanted.dt, {})
    with pytest.raises(InputError):
        programmed.record(micro_steps([1e-3], 0.5), Settings(), on=bare)
