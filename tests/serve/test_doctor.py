"""macromicro doctor: every line is true of this computer, and says what to do."""

from __future__ import annotations

import json
import os
import socket
import tomllib
from pathlib import Path
from typing import Any

import pytest

from macromicro.serve import health, warming
from macromicro.serve.health import FAIL, OK, WARN, Finding
from macromicro.serve.persist import Lock
from tests.command import command as macromicro
from tests.systems import linux

PROJECT = Path(__file__).parents[2] / "pyproject.toml"


def doctor(*options: str, **environment: str) -> tuple[int, str]:
    done = macromicro("doctor", *options, cwd=Path.cwd(), env=environment)
    assert not done.stderr, done.stderr
    return done.returncode, done.stdout


def test_what_fails_gives_status_1_and_a_remedy(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    status, text = doctor(MACROMICRO_CACHE=str(tmp_path / "file" / "cache"))
    assert status == 1
    lines = text.splitlines()
    bad = next(k for k, line in enumerate(lines) if line.startswith("fail compiler's cache"))
    assert "MACROMICRO_CACHE" in lines[bad + 1]
    assert not [line for line in lines if line[:5].strip() not in ("ok", "warn", "fail", "")]


def test_as_json_with_other_ports(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen(1)
        port = taken.getsockname()[1]
        status, text = doctor("--json", "--port", str(port), XDG_STATE_HOME=str(tmp_path))
    rows = {row["what"]: row for row in json.loads(text)}
    assert rows[f"port {port}, as asked"]["state"] == WARN
    assert rows["position file"]["state"] == OK
    assert str(tmp_path) in rows["position file"]["found"]
    failed = [row for row in rows.values() if row["state"] == FAIL]
    assert status == (1 if failed else 0)


def test_the_packages_are_those_of_the_project() -> None:
    project = tomllib.loads(PROJECT.read_text("utf-8"))["project"]
    names = {text.split(">")[0] for text in project["dependencies"]}
    assert set(health.NEEDED) == names
    for name, (_, extra) in health.EXTRAS.items():
        brought = project["optional-dependencies"][extra]
        assert name in {text.split(">")[0] for text in brought}


def test_missing_and_untested_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(health, "NEEDED", ("numpy", "no_such_package_here"))
    found = list(health.packages({"numpy": "0.1"}))
    assert [each.state for each in found] == [WARN, FAIL]
    assert "tested with 0.1" in found[0].found
    assert "pip install no_such_package_here" in found[1].remedy
    monkeypatch.setattr(health, "EXTRAS", {"no_such_package_here": ("magic", "wand")})
    (absent,) = health.extras()
    assert absent.state == OK
    assert (absent.found, "'macromicro[wand]'" in absent.remedy) == (
        "not installed: no magic",
        True,
    )


def test_the_constraints_are_those_of_this_checkout() -> None:
    assert health.constraints()["numpy"].count(".") == 2


@pytest.mark.parametrize(("names", "state"), [((), WARN), (("twin._bench",), WARN), (None, OK)])
def test_a_cold_cache_is_told(
    names: Any, state: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(health, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(warming, "cache_folder", lambda: tmp_path)
    every = ("twin._bench", "guarded._guard", "surveying._survey")
    for name in every if names is None else names:
        (tmp_path / f"{name}-12.py311.nbi").touch()
    found = health.compiler_cache()
    assert found.state == state
    assert ("empty" in found.found) == (names == ())  # other kernels are there
    assert ("1 kernels, none of the live bench" in found.found) == (names == ("twin._bench",))


def test_real_time_priority_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(health.os, "sched_setscheduler", refuse)
    found = health.realtime(37)
    assert found.state == WARN
    assert "rtprio 37" in found.remedy


@linux
def test_trying_the_priority_leaves_this_thread_as_it_was() -> None:
    before = os.sched_getscheduler(0)
    health.realtime(10)
    assert os.sched_getscheduler(0) == before


@pytest.mark.parametrize(("source", "state"), [("tsc", OK), ("hpet", WARN), ("acpi_pm", WARN)])
def test_clock_sources(source: str, state: str, tmp_path: Path) -> None:
    folder = tmp_path / "clocksource" / "clocksource0"
    folder.mkdir(parents=True)
    (folder / "current_clocksource").write_text(f"{source}\n")
    (found,) = health.clock(tmp_path)
    assert found.state == state
    assert source in found.found
    speed = tmp_path / "cpu" / "cpu0" / "cpufreq"
    speed.mkdir(parents=True)
    (speed / "scaling_governor").write_text("powersave\n")
    assert list(health.clock(tmp_path))[1].state == WARN


@pytest.mark.parametrize(("free", "state"), [(5e9, OK), (5e8, WARN), (5e7, FAIL)])
def test_disk(free: float, state: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(health.shutil, "disk_usage", lambda _: type("U", (), {"free": free}))
    (found,) = health.disk({"recordings": tmp_path / "not" / "there"})
    assert found.state == state
    assert "of recording" in found.found


def test_a_slower_loop_fills_a_disk_more_slowly(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(health.shutil, "disk_usage", lambda _: type("U", (), {"free": 1e10}))
    hours = []
    for period in (1e-3, 4e-3):
        (found,) = health.disk({"recordings": tmp_path}, period)
        hours.append(int(found.found.split(", ")[1].split()[0]))
    assert hours[0] > 5 and abs(hours[1] - 4 * hours[0]) <= 3


def test_a_machine_that_is_served_already(tmp_path: Path) -> None:
    path = tmp_path / "position.json"
    assert health.state_file(path).state == OK
    lock = Lock(path)
    lock.take()
    found = health.state_file(path)
    assert found.state == WARN
    assert f"process {os.getpid()}" in found.found
    lock.drop()
    assert health.state_file(path).state == OK


def test_browser(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert "no display" in health.browser().found
    monkeypatch.setenv("DISPLAY", ":9")
    monkeypatch.setattr(health.webbrowser, "get", lambda: type("B", (), {"name": "lynx"}))
    assert health.browser() == Finding("browser", OK, "lynx, display :9")


def test_what_serve_would_be_told_is_looked_at(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    below = str(tmp_path / "file" / "x")
    options = ("--rig", "nosuch:thing", "--host", "0.0.0.0", "--state", str(tmp_path))
    status, text = doctor(
        "--json", *options, "--record", below, "--scpi", "-1", "--web", "0", MACROMICRO_TOKEN=""
    )
    rows = {row["what"]: row for row in json.loads(text)}
    assert status == 1
    for what in ("rig", "address", "position file", "recording folder"):
        assert rows[what]["state"] == FAIL and rows[what]["remedy"], what
    assert "no module nosuch" in rows["rig"]["found"]
    assert "MACROMICRO_TOKEN" in rows["address"]["remedy"]
    assert rows["shared memory"]["state"] == OK
    assert not [what for what in rows if what.startswith("port ")]


def test_a_short_token_is_none_where_others_connect(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MACROMICRO_TOKEN", "short")
    assert health.address("0.0.0.0").state == FAIL and health.address("127.0.0.1").state == OK
    monkeypatch.setenv("MACROMICRO_TOKEN", "0123456789abcdef")
    assert health.address("0.0.0.0").state == OK


@linux
@pytest.mark.parametrize("place", ["/proc/x", "/proc/x/y"])
def test_a_file_system_that_takes_no_files(place: str) -> None:
    assert health.recording_folder(Path(place)).state == FAIL
    assert health.state_file(Path(place)).state == FAIL


def test_a_rigs_module_is_imported_and_its_factory_not_called(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "looked_at.py").write_text("def rig(seed):\n    raise SystemExit(9)\n")
    (tmp_path / "broken_rig.py").write_text("1 / 0\n")
    assert health.rig("looked_at:rig").state == OK
    assert "ZeroDivisionError" in health.rig("broken_rig:rig").found


def test_the_rigs_of_two_axes_are_looked_at_each(tmp_path: Path) -> None:
    (tmp_path / "xy.toml").write_text('machine = "xy"\n')
    words = ["--json", "--config", str(tmp_path / "xy.toml"), "--rig"]
    status, text = doctor(*words, "nosuch:x+nosuch:y", XDG_STATE_HOME=str(tmp_path))
    found = [row["found"] for row in json.loads(text) if row["what"] == "rig"]
    assert status == 1 and ["nosuch:x" in found[0], "nosuch:y" in found[1]] == [True, True]


def test_a_port_is_looked_at_on_the_address_that_is_asked_for() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.2", 0))
        taken.listen(1)
        port = taken.getsockname()[1]
        assert health.free_port(port, "SCPI", "127.0.0.2").state == WARN
        assert health.free_port(port, "SCPI", "127.0.0.3").state == OK
    assert health.free_port(port, "SCPI", "192.0.2.1").state == WARN
    assert health.address("nosuch.invalid").state == FAIL


def test_no_shared_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> int:
        raise OSError(38, "Function not implemented")

    monkeypatch.setattr(os, "memfd_create", refuse)
    found = health.shared_memory()
    assert found.state == FAIL and "make room in memory" in found.remedy
