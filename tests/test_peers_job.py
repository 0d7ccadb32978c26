"""The common job of benchmarks/peers: every definition of it gives the same trajectory."""

from __future__ import annotations

import importlib
import math
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control import macro as control
from macromicro.control.stage_law import Sample, Target
from macromicro.kernel import compiled
from macromicro.models import macro

PEERS = Path(__file__).resolve().parents[1] / "benchmarks" / "peers"
NAMES = (
    "job", "compiling", "loops", "preisach_rate", "environments", "peers",
)  # fmt: skip

needs_c = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler (cc) here")


@pytest.fixture(scope="module")
def peers() -> Iterator[dict[str, ModuleType]]:
    """The benchmark's modules, which find each other in their own folder."""
    before = {name: sys.modules.pop(name) for name in NAMES if name in sys.modules}
    sys.path.insert(0, str(PEERS))
    try:
        yield {name: importlib.import_module(name) for name in NAMES}
    finally:
        sys.path.remove(str(PEERS))
        for name in NAMES:
            sys.modules.pop(name, None)
        sys.modules.update(before)


def trajectory(peers: dict[str, ModuleType], job: Any, kernel: Any) -> Any:
    out = np.empty((2, job.samples))
    kernel(*peers["loops"].arguments(job), out)
    return out


def by_hand(peers: dict[str, ModuleType], job: Any) -> Any:
    """The equations in the head of job.py, with what the Python peers share."""
    common = peers["job"]
    out = np.empty((2, job.samples))
    x = v = last = 0.0
    for k in range(job.samples):
        seen = math.floor(x)
        error = job.target - seen
        u = common.effort(job, error, last)
        last = error
        out[:, k] = seen, u
        x, v = x + job.dt * v, job.b * common.net(job, u) - job.a * v
    return out


def jobs(peers: dict[str, ModuleType]) -> list[Any]:
    """The job, a move back, one that never saturates and one with a lower rail."""
    job = peers["job"].default()
    return [
        job,
        job._replace(target=-1234.0, samples=3000),
        job._replace(target=40.0, before=-0.009, samples=3000),
        job._replace(rail=3.7, samples=3000),
        job._replace(width=0.0, samples=3000),
    ]


def test_the_job_is_the_package_s_default(peers: dict[str, ModuleType]) -> None:
    """(4.10) with the minus sign, 3 V, 5 V, (4.3), (4.5): 2800 counts, 10 s at 1 kHz."""
    job = peers["job"].default()
    assert tuple(job) == (
        0.0124593, -0.0112178, 3.0, 5.0, -0.95833, 165.72, 1e-3, 0.364, 0.636, 3.0, 5.0,
        2800.0, 10_000,
    )  # fmt: skip


def test_the_job_survives_its_file(peers: dict[str, ModuleType], tmp_path: Path) -> None:
    job = peers["job"].default()._replace(now=0.1 + 0.2)
    assert peers["job"].read(peers["job"].written(job, tmp_path / "job.json")) == job


def test_compiled_interpreted_and_by_hand_agree_in_every_sample(
    peers: dict[str, ModuleType],
) -> None:
    for job in jobs(peers):
        fast = trajectory(peers, job, compiled(macro.rollout))
        assert np.array_equal(fast, trajectory(peers, job, macro.rollout))
        assert np.array_equal(fast, by_hand(peers, job))
        assert np.array_equal(fast[0], np.floor(fast[0]))
        assert np.ptp(fast[0]) > 30.0


def test_closed_loop_is_the_rollout(peers: dict[str, ModuleType]) -> None:
    job = peers["job"].default()
    model, law = peers["loops"].parts(job)
    found = macro.closed_loop(model, law, np.full(job.samples, job.target), counted=True)
    assert np.array_equal(found, trajectory(peers, job, compiled(macro.rollout)))
    assert abs(found[0][-1] - job.target) <= 2.0


def test_without_an_encoder_the_law_sees_the_position_itself(peers: dict[str, ModuleType]) -> None:
    job = peers["job"].default()._replace(samples=2000)
    model, law = peers["loops"].parts(job)
    aim = np.full(job.samples, job.target)
    x, volts = macro.closed_loop(model, law, aim)
    error = aim - x
    for k in (0, 1, 500, 1999):
        memory = control.rest(error[k - 1] if k else 0.0)
        target, sample = Target(aim[k], 0.0, 0.0), Sample(k * job.dt, x[k])
        assert control.step(law, memory, target, sample, job.dt)[1] == volts[k]
    assert not np.array_equal(x, np.floor(x))


@given(st.floats(-1e12, 1e12))
def test_whole_is_floor(x: float) -> None:
    assert macro.whole(x) == math.floor(x)


@pytest.mark.parametrize("n", [-3.0, 0.0, 7.0, 2800.0, 2.0**40])
def test_whole_beside_a_whole_number(n: float) -> None:
    for x in (n, math.nextafter(n, math.inf), math.nextafter(n, -math.inf), n + 0.5):
        assert macro.whole(x) == math.floor(x)
        assert compiled(macro.whole)(x) == math.floor(x)


@needs_c
@pytest.mark.parametrize("flags", ["PLAIN", "NATIVE"])
def test_c_and_the_package_agree_in_every_sample(
    peers: dict[str, ModuleType], tmp_path: Path, flags: str
) -> None:
    """Exactly: the same operations in the same order, and the compiler may not fuse them."""
    chosen = getattr(peers["compiling"], flags)
    place = peers["compiling"].library("loop.c", tmp_path, chosen)
    for job in jobs(peers):
        loop = peers["loops"].in_c(job, place)
        loop.run()
        assert np.array_equal(loop.out, trajectory(peers, job, compiled(macro.rollout)))


@needs_c
def test_preisach_in_c_and_the_package_agree_in_every_sample(
    peers: dict[str, ModuleType], tmp_path: Path
) -> None:
    rate = peers["preisach_rate"]
    table = rate.table()
    in_c = rate.in_c(peers["compiling"].library("preisach.c", tmp_path), table)
    for u in rate.inputs(20_000).values():
        mine = rate.outputs(rate.in_package(table), u)
        assert np.array_equal(mine, rate.outputs(in_c, u))
        assert np.ptp(mine) > 0.5


def test_without_a_compiler_the_reason_is_told(
    peers: dict[str, ModuleType], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(peers["compiling"].NoCompilerError, match="no C compiler"):
        peers["compiling"].library("loop.c", tmp_path)


@needs_c
def test_what_the_compiler_says_is_passed_on(peers: dict[str, ModuleType], tmp_path: Path) -> None:
    with pytest.raises(peers["compiling"].NoCompilerError, match="absent"):
        peers["compiling"].library("absent.c", tmp_path)


def test_a_peer_that_fails_is_a_row_with_the_reason(
    peers: dict[str, ModuleType], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file that is not there, an installation that fails; both leave the next row alone."""
    room = peers["peers"]
    job = peers["job"].default()._replace(samples=50)

    def refuse(name: str) -> Path:
        raise peers["environments"].NoEnvironmentError(f"{name} cannot be had")

    monkeypatch.setattr(peers["environments"], "python", refuse)
    monkeypatch.setattr(
        room,
        "PEERS",
        (
            room.Peer("nothing", "absent.py"),
            room.Peer("pathsim", "peer_pathsim.py", "pathsim", "pathsim"),
            room.Peer("plain Python", "peer_python.py"),
        ),
    )
    missing, refused, plain = room.measure(job, tmp_path, [])
    assert "absent.py" in missing.failed
    assert missing.warm is None
    assert refused.failed == "not installed: pathsim cannot be had"
    assert refused.version
    assert plain.failed == ""
    assert (plain.counts_off, plain.volts_off, plain.differing) == (0.0, 0.0, 0)
    room.show([missing, refused, plain])


def test_every_peer_has_its_file_and_its_pins(peers: dict[str, ModuleType]) -> None:
    for peer in peers["peers"].PEERS:
        assert (PEERS / peer.file).is_file()
        if peer.environment:
            text = peers["environments"].requirements(peer.environment).read_text(encoding="utf-8")
            lines = text.splitlines()
            assert lines
            assert all(line.count("==") == 1 for line in lines)
            assert "/" not in text
            assert "@" not in text
            assert peers["environments"].version(peer.environment, peer.package)
