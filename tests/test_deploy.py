"""The files in deploy/: a unit that systemd takes, a container whose user is not root."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
import threading
import tomllib
from pathlib import Path

import pytest

from macromicro.serve.hosts import SCPI_PORT, WEB_PORT

ROOT = Path(__file__).parents[1]
UNIT, CONTAINER = ROOT / "deploy" / "macromicro.service", ROOT / "deploy" / "Containerfile"
MOST = 30  # tenths of systemd's exposure level: "OK" is below 5.0


def instructions() -> list[tuple[str, str]]:
    """Those of the Containerfile, with their lines joined."""
    text = re.sub(r"^#.*\n", "", CONTAINER.read_text(encoding="utf-8"), flags=re.MULTILINE)
    lines = text.replace("\\\n", " ").splitlines()
    return [(line.split()[0], line.partition(" ")[2].strip()) for line in lines if line.strip()]


def settings() -> dict[str, list[str]]:
    """The unit's, by key."""
    text = UNIT.read_text(encoding="utf-8").replace("\\\n", " ")
    found: dict[str, list[str]] = {}
    for key, value in re.findall(r"^(\w+)=(.*)$", text, re.MULTILINE):
        found.setdefault(key, []).append(value)
    return found


def test_systemd_takes_the_unit(tmp_path: Path) -> None:
    """Here with a program that is there; no message, and little that the service might do."""
    if shutil.which("systemd-analyze") is None:
        pytest.skip("no systemd-analyze here")
    unit = tmp_path / UNIT.name
    text = UNIT.read_text(encoding="utf-8")
    unit.write_text(text.replace("/opt/macromicro/bin/macromicro", sys.executable))
    for words in (("verify",), ("security", "--offline=true", f"--threshold={MOST}")):
        done = subprocess.run(
            ["systemd-analyze", "--no-pager", *words, unit],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0 and not done.stderr, done.stderr + done.stdout[-300:]


def test_the_unit_listens_to_nobody_else_and_hides_the_system() -> None:
    told = settings()
    assert told["ExecStart"] == ["/opt/macromicro/bin/macromicro serve"]  # no --host
    assert told["DynamicUser"] == ["yes"] and told["NoNewPrivileges"] == ["yes"]
    assert told["ProtectSystem"] == ["strict"] and told["ProtectHome"] == ["yes"]
    assert told["CapabilityBoundingSet"] == [""]
    assert told["SuccessExitStatus"] == ["143"]
    assert "MemoryDenyWriteExecute" not in told  # it would forbid the compiler


@pytest.mark.parametrize("main", ["", "alive"])
def test_a_stop_asks_the_server_and_waits_for_it(main: str, tmp_path: Path) -> None:
    """Until what it started is done; where the server is gone, nothing is waited for."""
    words = shlex.split(settings()["ExecStop"][0].replace("$$", "$"))
    assert words[:2] == ["/bin/sh", "-c"] and len(words) == 3
    env = {"PATH": "/usr/bin:/bin"}
    if not main:
        assert subprocess.run(words, env=env, check=False, timeout=60).returncode == 0
        return
    calm = "trap 'sleep 0.3; touch safe; exit 143' TERM; touch begun; while :; do sleep 0.05; done"
    server = subprocess.Popen(["/bin/sh", "-c", calm], cwd=tmp_path)
    ended = threading.Thread(target=server.wait)
    ended.start()
    try:
        while not (tmp_path / "begun").exists():
            assert server.poll() is None
        env["MAINPID"] = str(server.pid)
        assert subprocess.run(words, env=env, check=False, timeout=60).returncode == 0
        assert (tmp_path / "safe").exists()
    finally:
        server.kill()
        ended.join()
    assert server.returncode == 143


def test_the_container_s_files_are_there_and_its_user_is_not_root() -> None:
    found = instructions()
    bases = [value.split()[0] for key, value in found if key == "FROM"]
    assert set(bases) == {"debian:13-slim"}
    for key, value in found:
        if key == "COPY" and not value.startswith("--from"):
            assert all((ROOT / source).exists() for source in value.split()[:-1]), value
    user = next(value for key, value in found if key == "USER")
    assert user.isdigit() and int(user) > 0
    assert [key for key, _ in found].index("USER") < [key for key, _ in found].index("ENTRYPOINT")
    assert dict(found)["EXPOSE"].split() == [str(SCPI_PORT), str(WEB_PORT)]
    assert dict(found)["ENTRYPOINT"] == '["macromicro"]' and dict(found)["CMD"] == '["serve"]'
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (extras,) = re.findall(r'"\.\[([\w,]+)\]"', CONTAINER.read_text(encoding="utf-8"))
    assert set(extras.split(",")) <= set(project["optional-dependencies"])
