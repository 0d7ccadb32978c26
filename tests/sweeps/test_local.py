"""Real worker processes: what is finished is kept, whoever is killed, and nothing is repeated."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import sweep_fake

from macromicro.errors import InputError
from macromicro.sweeps import folder, run
from macromicro.sweeps._local import GIVE_UP, work
from macromicro.sweeps._sampling import Sampler
from macromicro.sweeps._spec import load
from macromicro.sweeps.work import SweepError

FACTORY = "sweep_fake:job"
SCRIPT = Path(sweep_fake.__file__)
Make = Callable[..., Path]


def swept(
    spec: Path, out: Path, workers: int = 2, stop: int | None = None, **how: bool
) -> run.Outcome:
    """A whole sweep in this process; `stop`: end after so many variants."""
    done = 0

    def report(variants: int, impossible: int) -> None:
        nonlocal done
        done += variants

    request = run.Request(spec, out, workers, factory=FACTORY, **how)
    ready = run.check(request)
    return run.execute(
        ready, lambda count, before: None, report, lambda: stop is not None and done >= stop
    )


def evaluated(log: Path) -> list[int]:
    """Every index that was computed, as often as it was."""
    lines = [line.split() for line in log.read_text().splitlines()] if log.exists() else []
    return [i for first, count in lines for i in range(int(first), int(first) + int(count))]


def journaled(spec: Path, out: Path) -> set[int]:
    found = folder.spans(folder.journals(out), load(spec, sweep_fake.job)[0])
    return {i for low, high in found for i in range(low, high)}


def started(spec: Path, out: Path, *options: str) -> subprocess.Popen[str]:
    """The command in a process of its own."""
    return subprocess.Popen(
        [sys.executable, str(SCRIPT), str(spec), str(out), *options],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def wait_for(log: Path, lines: int) -> None:
    end = time.monotonic() + 60.0
    while not log.exists() or len(log.read_text().splitlines()) < lines:
        assert time.monotonic() < end, "no worker computes"
        time.sleep(0.01)


def test_results_are_the_jobs_own_in_order(make: Make, tmp_path: Path) -> None:
    """Index, parameters and metrics as one evaluation of everything gives them."""
    log = tmp_path / "log"
    spec = make(103, block=8, log=str(log))
    outcome = swept(spec, tmp_path / "out")
    assert (outcome.done, outcome.before) == (103, 0)
    assert sorted(evaluated(log)) == list(range(103))
    table = pq.read_table(tmp_path / "out" / "results.parquet")
    plan = load(spec, sweep_fake.job)[0]
    sampler = Sampler(plan)
    expected = sweep_fake.Fake().evaluate(sampler.variants(0, 103), 0)
    assert table["index"].to_pylist() == list(range(103))
    for k, axis in enumerate(plan.axes):
        assert np.array_equal(table[axis.path].to_numpy(), sampler.values(0, 103)[:, k])
    for k, name in enumerate(plan.metrics):
        assert np.array_equal(table[name].to_numpy(), expected[:, k], equal_nan=True)
    assert table["error"].null_count == 103
    assert not (tmp_path / "out" / "journal").exists()


def test_any_number_of_workers_gives_the_same_file(make: Make, tmp_path: Path) -> None:
    """Bit for bit, more workers than blocks included."""
    spec = make(6, block=4)
    files = []
    for workers in (1, 3):
        swept(spec, tmp_path / str(workers), workers)
        files.append((tmp_path / str(workers) / "results.parquet").read_bytes())
    assert files[0] == files[1]


def test_impossible_variants_are_marked_and_cost_no_others(make: Make, tmp_path: Path) -> None:
    spec = make(64, block=16, least=10.0)
    outcome = swept(spec, tmp_path / "out")
    table = pq.read_table(tmp_path / "out" / "results.parquet")
    gain, words = table["gain"].to_numpy(), table["error"].to_pylist()
    assert [w is not None for w in words] == (gain < 10.0).tolist()
    assert np.isnan(table["product"].to_numpy()).tolist() == (gain < 10.0).tolist()
    assert all("accepted: 10.0 or more" in w for w in words if w)
    assert outcome.written is not None
    assert outcome.written.impossible == int((gain < 10.0).sum()) > 0


def test_a_killed_worker_s_finished_blocks_are_kept(make: Make, tmp_path: Path) -> None:
    """SIGKILL within a chunk: another worker does the rest, no block twice."""
    log = tmp_path / "log"
    spec = make(120, block=4, log=str(log), fatal=50, marks=str(tmp_path))
    outcome = swept(spec, tmp_path / "out")
    assert outcome.done == 120 and (tmp_path / "50").exists()
    assert sorted(evaluated(log)) == list(range(120))


@pytest.mark.slow
def test_a_variant_that_always_kills_ends_the_sweep_with_its_name(
    make: Make, tmp_path: Path
) -> None:
    """All other chunks that were finished are kept, and --resume goes on."""
    spec = make(40, block=4, fatal=20)
    with pytest.raises(SweepError, match=f"ended {GIVE_UP} workers .*SIGKILL.*--resume") as caught:
        swept(spec, tmp_path / "out", 1)
    assert "variants 20 to" in str(caught.value)
    assert journaled(spec, tmp_path / "out") >= set(range(20))


def test_a_bug_of_the_job_ends_the_sweep_with_its_words(make: Make, tmp_path: Path) -> None:
    spec = make(40, block=4, worst=2.0)
    with pytest.raises(SweepError, match="a worker failed: ValueError: a bug of the job"):
        swept(spec, tmp_path / "out")


def test_stopped_and_gone_on_with(make: Make, tmp_path: Path) -> None:
    """Every variant once, the same file as without a stop; a third time nothing is computed."""
    log = tmp_path / "log"
    spec = make(200, block=4, log=str(log), delay=0.005)
    outcome = swept(spec, tmp_path / "out", stop=40)
    assert outcome.written is None and 40 <= outcome.done < 200
    assert not (tmp_path / "out" / "results.parquet").exists()
    assert sorted(evaluated(log)) == sorted(journaled(spec, tmp_path / "out"))
    again = swept(spec, tmp_path / "out", resume=True)
    assert again.before == outcome.done and again.done == 200
    assert sorted(evaluated(log)) == list(range(200))
    third = swept(spec, tmp_path / "out", 1, resume=True)
    assert third.before == 200 and third.written == again.written
    assert len(evaluated(log)) == 200
    whole = swept(spec, tmp_path / "whole", 1)
    assert whole.written == again.written
    first, second = (tmp_path / n / "results.parquet" for n in ("out", "whole"))
    assert first.read_bytes() == second.read_bytes()


def test_the_whole_run_killed_then_gone_on_with(make: Make, tmp_path: Path) -> None:
    """kill -9 of everything: what the journal has is not computed again, the rest once."""
    log = tmp_path / "log"
    spec = make(120, block=4, log=str(log), delay=0.01)
    out = tmp_path / "out"
    process = started(spec, out)
    wait_for(log, 6)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    before = len(evaluated(log))
    kept = journaled(spec, out)
    assert 0 < len(kept) < 120
    done = started(spec, out, "--resume")
    _, said = done.communicate(timeout=60)
    assert done.returncode == 0, said
    after = evaluated(log)[before:]
    assert sorted([*after, *kept]) == list(range(120))
    table = pq.read_table(out / "results.parquet")
    expected = sweep_fake.Fake().evaluate(
        Sampler(load(spec, sweep_fake.job)[0]).variants(0, 120), 0
    )
    assert table["product"].to_pylist() == expected[:, 0].tolist()


def test_only_the_parent_killed(make: Make, tmp_path: Path) -> None:
    """Its workers end by themselves, and only then another run goes on in the folder."""
    log = tmp_path / "log"
    spec = make(160, block=4, log=str(log), delay=0.02)
    process = started(spec, tmp_path / "out")
    wait_for(log, 4)
    process.kill()
    process.wait()
    outcome = swept(spec, tmp_path / "out", resume=True)
    assert 0 < outcome.before < outcome.done == 160
    assert sorted(evaluated(log)) == list(range(160))


def test_a_worker_whose_run_was_killed_makes_no_journal(make: Make, tmp_path: Path) -> None:
    """It may get its share of the folder only when the next run has counted the journals."""
    request = run.Request(make(8), tmp_path / "out", 1, factory=FACTORY)
    task = run.check(request).task
    path = tmp_path / "out" / folder.JOURNAL / "000001.journal"
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    here.send(None)  # were it to begin, it would be told to end at once
    process = context.Process(target=work, args=(there, task, path, os.getpid() + 1))
    process.start()
    process.join(60)
    assert process.exitcode == 1
    assert not path.exists()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_keeps_what_is_finished_and_says_how_to_go_on(
    make: Make, tmp_path: Path, number: signal.Signals
) -> None:
    log = tmp_path / "log"
    spec = make(400, block=4, log=str(log), delay=0.02)
    out = tmp_path / "out"
    process = started(spec, out)
    wait_for(log, 4)
    if number == signal.SIGINT:  # as a terminal does it: the whole group
        os.killpg(process.pid, number)
    else:
        process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 128 + number, said
    assert "--resume" in said and f"{len(journaled(spec, out))} of 400 variants" in said
    assert "Traceback" not in said
    assert sorted(evaluated(log)) == sorted(journaled(spec, out))
    assert sorted(p.name for p in out.iterdir()) == ["journal", "sweep.json", "sweep.toml"]


@pytest.mark.slow
def test_two_runs_in_one_folder(
    make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The second one is refused, the first one goes on."""
    log = tmp_path / "log"
    spec = make(80, block=4, log=str(log), delay=0.05)
    process = started(spec, tmp_path / "out", "--workers", "1")
    wait_for(log, 2)
    monkeypatch.setattr(folder, "_PATIENCE", 0.2)
    with pytest.raises(InputError, match="another sweep or command uses the folder"):
        swept(spec, tmp_path / "out", resume=True)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 0, said
    assert sorted(evaluated(log)) == list(range(80))


@pytest.mark.slow
def test_a_corrupt_journal_costs_its_block_only(make: Make, tmp_path: Path) -> None:
    log = tmp_path / "log"
    spec = make(60, block=4, log=str(log), delay=0.02)
    swept(spec, tmp_path / "out", 1, stop=20)
    path = folder.journals(tmp_path / "out")[0]
    raw = bytearray(path.read_bytes())
    raw[200] ^= 1
    path.write_bytes(bytes(raw))
    outcome = swept(spec, tmp_path / "out", 1, resume=True)
    assert outcome.done == 60 and outcome.before > 0
    assert len(evaluated(log)) == 64
    swept(spec, tmp_path / "whole", 1)
    first, second = (tmp_path / n / "results.parquet" for n in ("out", "whole"))
    assert first.read_bytes() == second.read_bytes()
