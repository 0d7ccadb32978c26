"""Sweeps by real worker processes: their results, and whatever may end them."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
import sweep_fake
from sweep_fake import FACTORY, Make, evaluated, swept
from tests.systems import posix

from macromicro import __version__
from macromicro.errors import InputError
from macromicro.sweeps import run
from macromicro.sweeps._evaluate import CRASHES, SweepError
from macromicro.sweeps._folder import part_size
from macromicro.sweeps._provenance import provenance
from macromicro.sweeps._sampling import Sampler
from macromicro.sweeps._spec import load

SCRIPT = Path(sweep_fake.__file__)


def finished(out: Path) -> list[int]:
    """Indices of the variants in the parts of an unfinished sweep, as pandas reads them."""
    return pd.read_parquet(out / "parts")["index"].to_list() if list(out.glob("parts/p*")) else []


def started(spec: Path, out: Path, *options: str) -> subprocess.Popen[str]:
    """The command in a process group of its own."""
    line = [sys.executable, str(SCRIPT), str(spec), str(out), *options]
    pipe = subprocess.PIPE
    return subprocess.Popen(line, stderr=pipe, stdout=pipe, text=True, start_new_session=True)


def wait_for(out: Path, parts: int) -> None:
    end = time.monotonic() + 60.0
    while len(list(out.glob("parts/p*"))) < parts:
        assert time.monotonic() < end, "no worker computes"
        time.sleep(0.01)


def files(out: Path) -> dict[str, bytes]:
    return {str(p.relative_to(out)): p.read_bytes() for p in out.rglob("*") if p.is_file()}


def test_the_results_are_the_job_s_own_for_any_number_of_workers(
    make: Make, tmp_path: Path
) -> None:
    """In order, each variant computed once; infeasible ones are marked and cost no others."""
    log = tmp_path / "log"
    spec = make(1030, log=str(log), least=10.0)
    outcome = swept(spec, tmp_path / "1", 1)
    assert sorted(evaluated(log)) == sorted(set(evaluated(log)))
    swept(spec, tmp_path / "3", 3)
    one, three = ((tmp_path / n / "results.parquet").read_bytes() for n in "13")
    assert one == three
    table = pd.read_parquet(tmp_path / "1" / "results.parquet")
    plan = load(spec, sweep_fake.job)[0]
    values = Sampler(plan).values(0, 1030)
    assert table["index"].to_list() == list(range(1030))
    assert np.array_equal(table[["gain", "part.mass"]], values)
    expected = sweep_fake.Fake().evaluate(Sampler(plan).variants(0, 1030))
    infeasible = values[:, 0] < 10.0
    expected[infeasible] = np.nan
    assert np.array_equal(table[list(plan.metrics)], expected, equal_nan=True)
    words = table["error"][infeasible]
    assert words.str.contains("accepted: 10.0 or more").all() and len(words)
    assert table["error"].notna().sum() == len(words)
    assert outcome.summary is not None and outcome.summary.infeasible == len(words)


@pytest.mark.parametrize("variants", [1, 100, 4096, 10**6, 10**9, 10**10])
def test_parts_are_small_and_not_too_many(variants: int) -> None:
    size = part_size(variants)
    assert size == 1 or size <= variants / 128
    assert variants / size <= 131_072


def test_a_killed_worker_costs_the_parts_in_hand(make: Make, tmp_path: Path) -> None:
    log = tmp_path / "log"
    spec = make(120, log=str(log), fatal=50, marks=str(tmp_path))
    outcome = swept(spec, tmp_path / "out", 2)
    assert outcome.done == 120 and (tmp_path / "50").exists()
    assert set(evaluated(log)) == set(range(120)) and len(evaluated(log)) <= 120 + 4
    assert pq.read_table(tmp_path / "out" / "results.parquet").num_rows == 120


def test_a_variant_that_always_kills_is_named(make: Make, tmp_path: Path) -> None:
    """Only it: those that were in hand at the same time are finished."""
    words = rf"variants 20 to 20 crashed their worker {CRASHES} times.*--resume"
    with pytest.raises(SweepError, match=words):
        swept(make(40, fatal=20), tmp_path / "out", 2)
    assert set(finished(tmp_path / "out")) >= set(range(20))


def test_a_defect_of_the_job_is_told_with_its_variants(make: Make, tmp_path: Path) -> None:
    with pytest.raises(SweepError, match=r"variants \d+ to \d+: ValueError: a bug of the job"):
        swept(make(40, worst=2.0), tmp_path / "out")


@pytest.mark.slow
def test_a_script_that_workers_cannot_import(make: Make, tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "from pathlib import Path\nfrom sweep_fake import swept\n"
        f"swept(Path({str(make(2))!r}), Path({str(tmp_path / 'out')!r}))\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, sys.path))}
    done = subprocess.run(
        [sys.executable, str(script)], env=environment, capture_output=True, text=True, check=False
    )
    assert 'must do so under `if __name__ == "__main__":`' in done.stderr.splitlines()[-1]


def test_workers_with_other_sources_end_it(make: Make, tmp_path: Path) -> None:
    """They start when files may have changed since the sweep was checked."""
    ready = run.check(run.Request(make(5), tmp_path / "out", 1, factory=FACTORY))
    ready = ready._replace(provenance=provenance()._replace(sources="abc"))
    with pytest.raises(SweepError, match=r"a worker has macromicro .*, the sweep .*abc"):
        run.execute(ready, lambda *_: None, lambda *_: None, lambda: False)


@pytest.mark.slow
def test_stopped_and_resumed(make: Make, tmp_path: Path) -> None:
    """The same file as without a stop; damaged parts are computed again, all others not."""
    log, out = tmp_path / "log", tmp_path / "out"
    spec = make(300, log=str(log), delay=0.005)
    outcome = swept(spec, out, stop=40)
    assert outcome.summary is None and 40 <= outcome.done < 300
    assert sorted(finished(out)) == list(range(outcome.done))
    assert sorted(p.name for p in out.iterdir()) == ["parts", "study.json", "sweep.toml"]
    damaged = out / "parts" / "part-000003.parquet"
    damaged.write_bytes(damaged.read_bytes()[:-100])
    log.unlink()
    again = swept(spec, out, resume=True)
    assert again.before == outcome.done - 2 and again.done == 300
    assert sorted(evaluated(log)) == [6, 7, *range(outcome.done, 300)]
    log.unlink()
    third = swept(spec, out, resume=True)
    assert (third.before, third.summary) == (300, again.summary) and not log.exists()
    whole = swept(spec, tmp_path / "whole")
    assert whole.summary == again.summary
    assert files(out)["results.parquet"] == files(tmp_path / "whole")["results.parquet"]


def test_a_stop_while_the_results_are_written(make: Make, tmp_path: Path) -> None:
    spec, out = make(20), tmp_path / "out"
    outcome = swept(spec, out, stop=20)
    assert (outcome.done, outcome.summary) == (20, None)
    assert sorted(p.name for p in out.iterdir()) == ["parts", "study.json", "sweep.toml"]
    assert swept(spec, out, resume=True).before == 20


@posix
@pytest.mark.parametrize(
    "everything",
    [pytest.param(True, marks=pytest.mark.slow), False],
    ids=["all processes", "the parent"],
)
def test_a_killed_run_is_resumed(make: Make, tmp_path: Path, everything: bool) -> None:
    """Its workers end with it, and it leaves no lock."""
    log, out = tmp_path / "log", tmp_path / "out"
    spec = make(60, log=str(log), delay=0.02)
    process = started(spec, out)
    wait_for(out, 6)
    os.killpg(process.pid, signal.SIGKILL) if everything else process.kill()
    process.communicate(timeout=10)  # its pipes close when the last worker has ended
    kept = finished(out)
    assert 6 <= len(kept) < 60
    log.unlink()
    assert swept(spec, out, resume=True).before == len(kept)
    assert sorted([*evaluated(log), *kept]) == list(range(60))


@posix
@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)]
)
def test_a_signal_keeps_what_is_finished_and_says_how_to_go_on(
    make: Make, tmp_path: Path, number: signal.Signals
) -> None:
    out = tmp_path / "out"
    process = started(make(400, delay=0.02), out)
    wait_for(out, 4)
    if number == signal.SIGINT:  # as a terminal does it: the whole group
        os.killpg(process.pid, number)
    else:
        process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 128 + number, said
    assert f"{len(finished(out))} of 400 variants are finished" in said
    assert f"--out {out} --resume" in said and "Traceback" not in said
    assert sorted(p.name for p in out.iterdir()) == ["parts", "study.json", "sweep.toml"]


@pytest.mark.slow
def test_two_runs_in_one_folder(make: Make, tmp_path: Path) -> None:
    spec, out = make(80, delay=0.02), tmp_path / "out"
    process = started(spec, out)
    wait_for(out, 2)
    for how in ({"resume": True}, {"overwrite": True}):
        with pytest.raises(InputError, match=rf"in use by process {process.pid} "):
            swept(spec, out, **how)
    process.terminate()
    process.communicate(timeout=60)
    assert swept(spec, out, resume=True).before >= 2


@posix
def test_a_full_disk_ends_it_and_it_is_resumed(make: Make, tmp_path: Path) -> None:
    """A limit of the size of files does what a full disk does."""
    import resource

    spec, out, before = make(40), tmp_path / "out", resource.getrlimit(resource.RLIMIT_FSIZE)
    ready = run.check(run.Request(spec, out, 1, factory=FACTORY))

    def report(*_: int) -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (500, before[1]))

    try:
        with pytest.raises(SweepError, match=r"out: .*File too large.*--resume"):
            run.execute(ready, lambda *_: None, report, lambda: False)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert len(finished(out)) == 1
    assert swept(spec, out, resume=True).before == 1


def test_space_is_needed_for_what_is_missing(
    make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec, out = make(40, delay=0.02), tmp_path / "out"
    usage = shutil.disk_usage("/")
    monkeypatch.setattr(shutil, "disk_usage", lambda place: usage._replace(free=5_080_000))
    with pytest.raises(InputError, match="MB free"):
        swept(spec, tmp_path / "new", resume=True)
    assert not (tmp_path / "new").exists()
    monkeypatch.undo()
    before = swept(spec, out, stop=30).done
    monkeypatch.setattr(shutil, "disk_usage", lambda place: usage._replace(free=5_080_000))
    assert 30 <= swept(spec, out, resume=True).before == before < 40


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished sweep of 10 variants beside its spec."""
    place = tmp_path_factory.mktemp("done")
    (place / "spec.toml").write_text(
        'job = "fake"  # a word\nmethod = "lhs"\nsamples = 10\nmetrics = ["often", "product"]\n'
        "[options]\nleast = 3\n[parameters]\ngain = { low = 1, high = 5 }\n"
        'part.force = ["1 mN", "2 mN"]\n',
        encoding="utf-8",
    )
    swept(place / "spec.toml", place / "out")
    return place


def test_what_the_folder_says(done: Path) -> None:
    study = json.loads((done / "out" / "study.json").read_text())
    assert (study["state"], study["version"]) == ("complete", __version__)
    assert study["sources"] == provenance().sources and study["software"] == {"a": "b"}
    assert study["spec"]["parameters.gain"] == [1.0, 5.0, "linear"]
    found = study["results"]
    assert (found["rows"], found["infeasible"]) == (10, 5)
    assert found["first_infeasible"].startswith("variant ")
    assert found["metrics"]["product"]["unit"] == "kg" and found["metrics"]["often"]["finite"] >= 4
    assert (done / "out" / "sweep.toml").read_bytes() == (done / "spec.toml").read_bytes()
    schema = pq.read_schema(done / "out" / "results.parquet")
    assert schema.names == ["index", "gain", "part.force", "often", "product", "error"]
    assert schema.field("part.force").metadata[b"unit"] == b"N"
    meaning = {b"unit": b"kg", b"meaning": b"all parameters multiplied"}
    assert schema.field("product").metadata == meaning
    assert json.loads(schema.metadata[b"macromicro.sweep"]) == study["spec"]
    assert schema.metadata[b"macromicro.sources"].decode() == provenance().sources


CHANGES = {
    "parameters.gain": ("high = 5", "high = 6"),
    "samples": ("samples = 10", "samples = 11"),
    "method": ('"lhs"', '"sobol"'),
    "options.least": ("least = 3", "least = 4"),
    "seed": ("samples = 10", "samples = 10\nseed = 3"),
    "parameters.part.mass": ("part.force", "part.mass = '1 kg'\npart.force"),
    "metrics": ('"often", ', ""),
}


@pytest.mark.parametrize("key", CHANGES)
def test_another_spec_is_not_resumed(done: Path, tmp_path: Path, key: str) -> None:
    """The message names the key."""
    before = files(done / "out")
    other = tmp_path / "other.toml"
    other.write_text((done / "spec.toml").read_text().replace(*CHANGES[key]))
    with pytest.raises(InputError) as caught:
        swept(other, done / "out", resume=True)
    assert caught.value.where == f"--out {done / 'out'}, {key}"
    assert "--overwrite" in caught.value.accepted and files(done / "out") == before


@pytest.mark.parametrize("key", ["version", "sources", "sampler"])
def test_other_code_is_not_resumed(make: Make, tmp_path: Path, key: str) -> None:
    """Results of two codes never stand in one file."""
    spec, out = make(5), tmp_path / "out"
    swept(spec, out, stop=1)
    study = json.loads((out / "study.json").read_text())
    (out / "study.json").write_text(json.dumps({**study, key: "another"}))
    words = rf"{key}: '?{study[key]} now, but the folder was begun with another.*--overwrite"
    with pytest.raises(InputError, match=words):
        swept(spec, out, resume=True)
    swept(spec, out, overwrite=True)
    assert json.loads((out / "study.json").read_text())[key] == study[key]


def test_folders_that_are_taken(done: Path, make: Make, tmp_path: Path) -> None:
    before, out = files(done / "out"), tmp_path / "out"
    with pytest.raises(InputError, match=r"already exists.*--resume or --overwrite"):
        swept(done / "spec.toml", done / "out")
    assert swept(done / "spec.toml", done / "out", resume=True).before == 10
    assert files(done / "out") == before
    assert swept(make(6), out, resume=True).done == 6  # one command for each attempt
    (out / "mine.txt").write_text("kept")
    swept(make(9, "other.toml"), out, overwrite=True)
    assert pq.read_table(out / "results.parquet").num_rows == 9
    assert (out / "mine.txt").read_text() == "kept"
    (out / "study.json").write_text("{}")
    with pytest.raises(InputError, match="not part of a sweep"):
        swept(make(5), out, resume=True)
    (out / "study.json").unlink()
    with pytest.raises(InputError, match="already exists"):
        swept(make(5), out, resume=True)
    (out / "parts").write_text("a file")
    with pytest.raises(InputError, match="not part of a sweep"):
        swept(make(5), out, overwrite=True)


@pytest.mark.parametrize(
    "how, words",
    [
        ({"resume": True, "overwrite": True}, "--resume: not allowed with --overwrite"),
        ({"workers": 2, "scheduler": "tcp://a:1"}, "--workers: not allowed with --scheduler"),
        ({"workers": 0}, "--workers: 0; accepted: a whole number from 1"),
        ({"out": "file"}, "this is a file"),
        ({"out": "a\0b"}, "not a valid"),
        ({"samples": 10**10}, "MB free"),
    ],
)
def test_what_cannot_be(make: Make, tmp_path: Path, how: dict[str, object], words: str) -> None:
    (tmp_path / "file").write_text("x")
    spec = make(int(how.pop("samples", 5)))  # type: ignore[call-overload]
    with pytest.raises(InputError, match=words):
        swept(spec, tmp_path / str(how.pop("out", "out")), **how)  # type: ignore[arg-type]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "spec.toml"]


def test_without_pyarrow_the_extra_is_named(
    make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [n for n in sys.modules if n.startswith("pyarrow")]:
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(InputError, match=r"pyarrow is not installed.*'macromicro\[sweep\]'"):
        swept(make(5), tmp_path / "out")
    assert not (tmp_path / "out").exists()
