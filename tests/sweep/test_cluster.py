"""A dask cluster in processes of its own: same results, and a worker may be lost."""

from __future__ import annotations

import socket
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from macromicro.errors import InputError
from macromicro.sweep import cluster, run
from macromicro.sweep.work import SweepError

distributed = pytest.importorskip("distributed")
FACTORY = "sweep_fake:job"
Make = Callable[..., Path]


@pytest.fixture(scope="module")
def workers() -> Iterator[Any]:
    """Two workers of one thread each."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as made:
        yield made


def swept(spec: Path, out: Path, address: str, **how: bool) -> run.Outcome:
    request = run.Request(spec, out, None, address, factory=FACTORY, **how)
    ready = run.check(request)
    return run.execute(ready, lambda *_: None, lambda *_: None, lambda: False)


def evaluated(log: Path) -> list[int]:
    lines = [line.split() for line in log.read_text().splitlines()]
    return [i for first, count in lines for i in range(int(first), int(first) + int(count))]


def test_the_same_file_as_local_workers(make: Make, tmp_path: Path, workers: Any) -> None:
    """Impossible variants included; nothing is computed twice."""
    log = tmp_path / "log"
    spec = make(90, block=4, log=str(log), least=5.0)
    swept(spec, tmp_path / "cluster", workers.scheduler_address)
    alive = evaluated(log)
    assert len(alive) == len(set(alive))
    request = run.Request(spec, tmp_path / "local", 1, factory=FACTORY)
    run.execute(run.check(request), lambda *_: None, lambda *_: None, lambda: False)
    first, second = (tmp_path / n / "results.parquet" for n in ("cluster", "local"))
    assert first.read_bytes() == second.read_bytes()
    assert pq.read_table(first)["error"].null_count == len(alive)


def test_a_lost_worker_s_chunks_go_to_others(make: Make, tmp_path: Path, workers: Any) -> None:
    spec = make(60, block=4, fatal=22, marks=str(tmp_path))
    outcome = swept(spec, tmp_path / "out", workers.scheduler_address)
    assert (tmp_path / "22").exists()
    assert outcome.done == 60
    table = pq.read_table(tmp_path / "out" / "results.parquet")
    assert table["index"].to_pylist() == list(range(60))


def test_a_bug_of_the_job_ends_it_and_keeps_what_is_finished(
    make: Make, tmp_path: Path, workers: Any
) -> None:
    """A sweep of several chunks; the others can be gone on with."""
    spec = make(60, block=4, worst=60.0)
    with pytest.raises(SweepError, match="ValueError: a bug of the job"):
        swept(spec, tmp_path / "out", workers.scheduler_address)
    assert (tmp_path / "out" / "journal").is_dir()


def test_gone_on_with_on_the_cluster(make: Make, tmp_path: Path, workers: Any) -> None:
    """What local workers finished is not computed again."""
    log = tmp_path / "log"
    spec = make(80, block=4, log=str(log), delay=0.01)
    done = 0

    def report(variants: int, impossible: int) -> None:
        nonlocal done
        done += variants

    request = run.Request(spec, tmp_path / "out", 2, factory=FACTORY)
    run.execute(run.check(request), lambda *_: None, report, lambda: done >= 20)
    outcome = swept(spec, tmp_path / "out", workers.scheduler_address, resume=True)
    assert 20 <= outcome.before < outcome.done == 80
    assert sorted(evaluated(log)) == list(range(80))


def test_unreachable(make: Make, tmp_path: Path) -> None:
    """Nothing listens there; the folder is not made."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    with pytest.raises(InputError, match=f"--scheduler {address}.*dask scheduler that is running"):
        swept(make(10), tmp_path / "out", address)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("address", ["nonsense", "tcp://", "", "xyz://a:1"])
def test_no_address(make: Make, tmp_path: Path, address: str) -> None:
    with pytest.raises(InputError, match="--scheduler"):
        swept(make(10), tmp_path / "out", address)


def test_no_workers(make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "_WORKERS", 0.3)
    with (
        distributed.LocalCluster(n_workers=0, processes=True, dashboard_address=":0") as empty,
        pytest.raises(InputError, match="scheduler without workers"),
    ):
        swept(make(10), tmp_path / "out", empty.scheduler_address)


def test_without_dask_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install 'macromicro\[cluster\]'"):
        cluster.connect("tcp://127.0.0.1:1")


def test_another_version_on_the_workers(workers: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "__version__", "9.9.9")
    with pytest.raises(InputError, match=r"macromicro 9\.9\.9 on every worker"):
        cluster.connect(workers.scheduler_address)
