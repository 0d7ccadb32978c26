"""A sweep by the workers of a dask cluster within this process."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from sweep_fake import FACTORY, Make, evaluated, swept

from macromicro.errors import InputError
from macromicro.sweeps import _cluster, run
from macromicro.sweeps._evaluate import SweepError
from macromicro.sweeps._provenance import provenance

distributed = pytest.importorskip("distributed")


def cluster(workers: int) -> Any:
    return distributed.LocalCluster(
        n_workers=workers, threads_per_worker=1, processes=False, protocol="tcp",
        dashboard_address=":0",
    )  # fmt: skip


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """Of the scheduler of two workers."""
    with cluster(2) as made:
        yield made.scheduler_address


def test_the_same_file_as_by_processes(make: Make, tmp_path: Path, address: str) -> None:
    """Infeasible variants included; what was finished before is not computed again."""
    log = tmp_path / "log"
    spec = make(300, log=str(log), least=5.0)
    swept(spec, tmp_path / "local")
    once = evaluated(log)
    before = swept(spec, tmp_path / "cluster", stop=100).done
    log.unlink()
    outcome = swept(spec, tmp_path / "cluster", None, scheduler=address, resume=True)
    assert outcome.before == before < outcome.done == 300
    assert sorted(evaluated(log)) == [i for i in sorted(once) if i >= before]
    first, second = (tmp_path / n / "results.parquet" for n in ("cluster", "local"))
    assert first.read_bytes() == second.read_bytes()
    assert json.loads((tmp_path / "cluster/study.json").read_text())["workers"] == "cluster"


def test_a_defect_of_the_job_ends_it(make: Make, tmp_path: Path, address: str) -> None:
    spec, out = make(60, worst=60.0), tmp_path / "out"
    with pytest.raises(SweepError, match=r"variants .*ValueError: a bug of the job.*--resume"):
        swept(spec, out, None, scheduler=address)
    assert (out / "parts").is_dir()


@pytest.mark.slow
def test_a_lost_scheduler_ends_it(make: Make, tmp_path: Path) -> None:
    spec, out = make(200, delay=0.02), tmp_path / "out"
    with cluster(1) as made:
        request = run.Request(spec, out, None, made.scheduler_address, factory=FACTORY)

        def report(*_: int) -> None:
            if len(list(out.glob("parts/*"))) == 3:
                made.close()

        with pytest.raises(SweepError, match=r"the scheduler was lost.*--resume"):
            run.execute(run.check(request), lambda *_: None, report, lambda: False)
    assert swept(spec, out, resume=True).before >= 3


@pytest.mark.parametrize("key", ["version", "sources", "sampler"])
def test_other_code_on_the_workers(address: str, key: str) -> None:
    other = provenance()._replace(**{key: "9.9.9"})
    with pytest.raises(InputError, match=r"macromicro .*9\.9\.9.* on every worker"):
        _cluster.connect(address, other)


def test_a_worker_of_other_code_that_joins_later(make: Make, tmp_path: Path, address: str) -> None:
    """Each looks at the sweep's code before it computes."""
    ready = run.check(run.Request(make(20), tmp_path / "out", None, address, factory=FACTORY))
    ready = ready._replace(provenance=provenance()._replace(sources="abc"))
    with pytest.raises(SweepError, match=r"a worker has macromicro .*, the sweep .*abc"):
        run.execute(ready, *[lambda *_: None] * 2, lambda: False)


def test_no_workers(make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_cluster, "_WORKERS", 0.3)
    with cluster(0) as empty, pytest.raises(InputError, match="the scheduler has no workers"):
        swept(make(10), tmp_path / "out", None, scheduler=empty.scheduler_address)
    assert not (tmp_path / "out").exists()


def test_without_dask_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"'macromicro\[cluster\]'"):
        _cluster.connect("tcp://127.0.0.1:1", provenance())


NO_ADDRESS = ("nonsense", "", "tcp://", "tcp://:8786", "tcp://a:b", "tcp://a:1/b", "tcp://a b:1",
              "tcp://a\n:1", "tcp://me@a:1", "xyz://a:1")  # fmt: skip


@pytest.mark.parametrize("address", NO_ADDRESS)
def test_no_address(make: Make, tmp_path: Path, address: str) -> None:
    with pytest.raises(InputError, match=r"running dask scheduler, such as tcp") as caught:
        swept(make(10), tmp_path / "out", None, scheduler=address)
    assert caught.value.where.startswith("--scheduler") and "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("kind", ["not dask", "unreachable"])
def test_a_scheduler_that_is_none_is_one_line(kind: str) -> None:
    """To the end of the process: no client is left that complains then."""
    script = (
        "import sys\nfrom macromicro.errors import InputError\n"
        "from macromicro.sweeps import _cluster\n_cluster._CONNECT = 0.5\n"
        "try:\n    _cluster.connect(sys.argv[1], None)\n"
        "except InputError as error:\n    print(error.where)"
    )
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"

        def answer() -> None:
            while True:
                try:
                    peer = server.accept()[0]
                except OSError:
                    return
                with peer:
                    peer.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")

        if kind == "unreachable":
            server.close()
        threading.Thread(target=answer, daemon=True).start()
        line = [sys.executable, "-c", script, address]
        done = subprocess.run(line, capture_output=True, text=True, check=False)
        if kind == "not dask":
            server.shutdown(socket.SHUT_RDWR)
    assert (done.stdout, done.stderr) == (f"--scheduler {address}\n", "")
