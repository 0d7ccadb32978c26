"""A dask cluster in processes of its own: same results, and a worker may be lost."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from tests.command import command as macromicro

from macromicro.errors import InputError
from macromicro.sweeps import _cluster, run
from macromicro.sweeps._origin import code, running
from macromicro.sweeps.work import SweepError

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
    """A sweep of several chunks; the others can be resumed."""
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


def free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


def test_unreachable(make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing listens there; the folder is not made."""
    monkeypatch.setattr(_cluster, "_CONNECT", 0.5)
    address = f"tcp://127.0.0.1:{free_port()}"
    with pytest.raises(InputError, match=f"--scheduler {address}.*running dask scheduler"):
        swept(make(10), tmp_path / "out", address)
    assert not (tmp_path / "out").exists()


NO_ADDRESS = {
    "nonsense": "the port is missing",
    "": "the host is missing",
    "tcp://": "the host is missing",
    "tcp://:8786": "the host is missing",
    "tcp://a": "the port is missing",
    "tcp://a:b": "Port could not be cast",
    "tcp://a:99999": "out of range",
    "tcp://a:1/b": "only a host and a port",
    "xyz://a:1": "'xyz'",
    "tcp://a b:1": "not an address",
    "tcp://a\n:1": "not an address",
}


@pytest.mark.parametrize("address", NO_ADDRESS)
def test_no_address(make: Make, tmp_path: Path, address: str) -> None:
    """Said before dask is asked."""
    with pytest.raises(InputError, match=NO_ADDRESS[address]) as caught:
        swept(make(10), tmp_path / "out", address)
    assert caught.value.where.startswith("--scheduler") and "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "address, full",
    [
        ("10.0.0.1:8786", "tcp://10.0.0.1:8786"),
        ("tls://host.example:8786", "tls://host.example:8786"),
        ("tcp://[::1]:8786", "tcp://[::1]:8786"),
    ],
)
def test_addresses(address: str, full: str) -> None:
    assert _cluster.checked(address) == full


@pytest.mark.parametrize(
    "kind",
    # Dask tries for seconds where nobody listens.
    ["malformed", pytest.param("unreachable", marks=pytest.mark.slow), "not dask"],
)
def test_a_scheduler_that_is_none_is_one_line(make: Make, tmp_path: Path, kind: str) -> None:
    """The whole command, to the end of its process: no client is left that complains then."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def answer() -> None:
            while True:
                try:
                    peer = server.accept()[0]
                except OSError:
                    return
                with peer:
                    peer.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")

        threading.Thread(target=answer, daemon=True).start()
        address = {
            "malformed": "nonsense",
            "unreachable": f"tcp://127.0.0.1:{free_port()}",
            "not dask": f"tcp://127.0.0.1:{server.getsockname()[1]}",
        }[kind]
        spec = tmp_path / "spec.toml"
        spec.write_text('job = "macro-bench"\n[parameters]\nreference = ["10 counts"]\n')
        words = ["sweep", spec, "--out", tmp_path / "out", "--scheduler", address]
        done = macromicro(*words, cwd=tmp_path)
        server.shutdown(socket.SHUT_RDWR)
    assert done.returncode == 2 and done.stdout == ""
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"macromicro: --scheduler {address}: ")


def test_a_client_that_dask_refuses_is_left_closed() -> None:
    """An address that gets as far as dask: what was half built does not complain later."""
    script = (
        "from macromicro.errors import InputError\nfrom macromicro.sweeps import _cluster\n"
        "try:\n    _cluster._reached('nonsense', 'here')\n"
        "except InputError as error:\n    print(error.where)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert (done.stdout, done.stderr) == ("here\n", "")


def test_no_workers(make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_cluster, "_WORKERS", 0.3)
    with (
        distributed.LocalCluster(n_workers=0, processes=True, dashboard_address=":0") as empty,
        pytest.raises(InputError, match="the scheduler has no workers"),
    ):
        swept(make(10), tmp_path / "out", empty.scheduler_address)


def test_without_dask_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"checkout: .*-e '\.\[cluster\]'") as caught:
        _cluster.connect("tcp://127.0.0.1:1", code())
    assert "-e '.[cluster]'" in caught.value.accepted


@pytest.mark.parametrize("key", ["version", "sources", "sampler"])
def test_other_code_on_the_workers(workers: Any, key: str) -> None:
    """Of another version, of this one with other sources, or with another scipy."""
    other = code()._replace(**{key: "9.9.9"})
    with pytest.raises(InputError, match=r"macromicro .*9\.9\.9.* on every worker"):
        _cluster.connect(workers.scheduler_address, other)


def test_a_worker_of_other_code_that_joins_later(
    make: Make, tmp_path: Path, workers: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each answer tells its code: one that is not the sweep's is not journaled."""
    spec, out = make(20, block=4), tmp_path / "out"
    ready = run.check(run.Request(spec, out, None, workers.scheduler_address, factory=FACTORY))
    other = code()._replace(sources="0123456789abcdef")
    task = ready.task._replace(code=other)
    with pytest.raises(SweepError, match=rf"worker tcp://.* {code()}, this sweep is of {other}"):
        run.execute(ready._replace(task=task), *[lambda *_: None] * 2, lambda: False)
    assert json.loads((out / "sweep.json").read_text())["state"] == "begun"
    outcome = swept(spec, out, workers.scheduler_address, resume=True)
    assert (outcome.before, outcome.done) == (0, 20)


def test_what_runs_here_is_what_the_files_hold(workers: Any) -> None:
    with distributed.Client(workers.scheduler_address, set_as_default=False) as client:
        assert set(client.run(running).values()) == {code()}
