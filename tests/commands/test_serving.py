"""macromicro serve as a person starts it: what it refuses, what it says, where it writes."""

from __future__ import annotations

import http.client
import os
import re
import signal
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import faulty
from macromicro.recording import Recording
from macromicro.serve import persist
from tests.command import command
from tests.systems import linux, posix
from tests.warm import Command

RUN = (sys.executable, "-m", "macromicro", "serve")
SLOW = """
import os, sys, time
import faulty.bench

def rig(seed):
    print("opening", file=sys.stderr, flush=True)
    while not os.path.exists("go"):
        time.sleep(0.01)
    return faulty.bench.twin(seed)
"""


class Server:
    """The command in a folder of its own; `said` is its output up to "Ctrl-C ends it"."""

    def __init__(self, folder: Path, *options: str, token: str = "") -> None:
        (folder / "live.toml").write_text(
            "[serve]\nmiss_share = 1.0\nparent_timeout = '5 s'\nloop_timeout = '5 s'\n"
        )
        self.folder, self.errors = folder, folder / "stderr"
        with self.errors.open("w") as errors:
            self.process = Command(
                [*RUN, "--scpi", "0", "--web", "0", "--config", "live.toml", *options],
                cwd=folder,
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
                env={**os.environ, "XDG_STATE_HOME": str(folder), "MACROMICRO_TOKEN": token},
            )
        self.said = ""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.said += line
            if line.startswith("Ctrl-C"):
                break
        else:
            raise AssertionError(self.errors.read_text())

    def scpi(self) -> socket.socket:
        found = re.search(r"^SCPI: \S+ port (\d+)$", self.said, re.MULTILINE)
        assert found is not None
        return socket.create_connection(("127.0.0.1", int(found[1])), 30.0)

    def end(self) -> int:
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(60.0)


Begin = Callable[..., Server]


@pytest.fixture
def begin(tmp_path: Path) -> Iterator[Begin]:
    made = []

    def serve(*options: str, token: str = "") -> Server:
        made.append(Server(tmp_path, *options, token=token))
        return made[-1]

    yield serve
    for each in made:
        each.process.kill()
        each.process.wait()


def ask(client: socket.socket, text: str) -> str:
    client.sendall(text.encode() + b"\n")
    with client.makefile("r") as lines:
        return lines.readline().strip()


def refused(folder: Path, *options: str) -> str:
    """The message of a command that ends with status 2 and starts nothing."""
    alone = ("serve", "--scpi", "0", "--web", "-1")
    done = command(*alone, *options, cwd=folder, env={"XDG_STATE_HOME": str(folder / "home")})
    assert (done.returncode, done.stdout) == (2, "")
    return done.stderr.splitlines()[-1]


@linux
@pytest.mark.parametrize("option", ["--state", "--record"])
@pytest.mark.parametrize("place", ["/proc/x/y.json", "file/below"])
def test_places_that_cannot_be_are_named_before_anything_starts(
    option: str, place: str, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("no folder")
    said = refused(tmp_path, option, place)
    assert said.startswith(f"macromicro: {option} {place}: ") and "Choose a" in said


def test_a_folder_is_no_position_file_and_gets_no_neighbours(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    assert refused(tmp_path, "--state", "folder").startswith("macromicro: --state folder: ")
    assert not list(tmp_path.glob("folder?*"))


def test_a_file_is_no_folder_for_recordings(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    said = refused(tmp_path, "--record", "file")
    assert said.startswith("macromicro: --record file: not a folder")
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.parametrize("rig", ["nosuch", "", "os:nosuch", "os:getcwd", "nosuch:thing"])
def test_a_rig_that_is_none_is_bad_input(rig: str, tmp_path: Path) -> None:
    said = refused(tmp_path, f"--rig={rig}")
    assert said.startswith("macromicro: --rig") and said.count("\n") <= 1
    assert any(remedy in said for remedy in ("accepted: ", "Expected: ", "Put the module"))


@posix
def test_a_recording_gets_its_folder_and_a_position_that_cannot_be_kept_is_told_once(
    begin: Begin, tmp_path: Path
) -> None:
    server = begin("--state", "kept/position.json")
    kept = tmp_path / "kept"
    while not (kept / "position.json").exists():  # The start saves too; its file is in use.
        assert server.process.poll() is None
    kept.rename(tmp_path / "gone")
    kept.write_text("in the way")
    with server.scpi() as client:
        ask(client, "SYST:LOCK:REQ?")
        client.sendall(b'REC ON,"first"\n')
        assert ask(client, "SYST:ERR?") == '0,"No error"'
        for _ in range(3):
            client.sendall(b"ENAB\nHOME\n")
            assert "cannot be saved" in ask(client, "SYST:ERR?")
    while "cannot be saved" not in server.errors.read_text():
        assert server.process.poll() is None
    assert server.end() == 130
    assert server.errors.read_text().count("cannot be saved") == 1
    assert (tmp_path / "results" / "serve" / "first.h5").stat().st_size > 0


@posix
def test_while_it_starts_its_page_and_ctrl_c_are_answered(tmp_path: Path) -> None:
    (tmp_path / "slow.py").write_text(SLOW)
    process = subprocess.Popen(
        [*RUN, "--scpi", "0", "--web", "0", "--rig", "slow:rig", "--state", "position.json"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(faulty.__file__).parents[1])},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    page = re.fullmatch(r"starting slow:rig, (\S+/)(;.*)?\n", process.stderr.readline())
    assert page is not None
    while process.stderr.readline() != "opening\n":
        assert process.poll() is None
    with urllib.request.urlopen(page[1], timeout=30.0) as answer:
        assert b"Positioner" in answer.read()
    process.send_signal(signal.SIGINT)
    assert "interrupted; stopping once it has started" in process.stderr.readline()
    (tmp_path / "go").touch()
    out, _ = process.communicate(timeout=120.0)
    assert (process.returncode, out) == (130, "")


def reached(server: Server, *names: str) -> dict[str, int]:
    """Statuses of the page by the name that was printed and others."""
    found = re.search(r"^page: http://(\S+):(\d+)/$", server.said, re.MULTILINE)
    assert found is not None and found[1] != "0.0.0.0"
    status = {}
    for name in (found[1], *names):
        page = http.client.HTTPConnection("127.0.0.1", int(found[2]), timeout=30.0)
        page.request("GET", "/", headers={"Host": f"{name}:{found[2]}"})
        status[name] = page.getresponse().status
        page.close()
    return status


@posix
def test_names_reach_the_page_and_log_and_recording_tell_who_did_what(
    begin: Begin, tmp_path: Path
) -> None:
    secret = "a token that is long"
    names = ("--host", "0.0.0.0", "--name", "Bench.lab")
    server = begin(*names, "--log", "logs/serve.log", "--record", "made", token=secret)
    status = reached(server, "bench.lab", "localhost", "evil.example")
    assert list(status.values()) == [200, 200, 200, 421]
    with server.scpi() as client:
        name = ask(client, "SYST:CLI?").strip('"')
        assert ask(client, 'SYST:AUTH "a wrong guess";:SYST:ERR?').startswith("-203,")
        assert ask(client, f'SYST:AUTH "{secret}";:SYST:LOCK:REQ?;:ENAB;:FAN ON;STOP;*OPC?')
    with server.scpi() as browser:
        browser.sendall(b"POST / HTTP/1.1\r\n\r\nABOR\r\n")
        assert browser.recv(10) == b""
    assert server.end() == 130
    text = (tmp_path / "logs" / "serve.log").read_text()
    (file,) = (tmp_path / "made").iterdir()
    events = Recording.load(file).events
    for what in ("Enable", "Fan", "Stop"):
        assert f"INFO order: {what} by {name}" in text
        assert ("order", name, what) in [event[1:4] for event in events]
    assert f"WARNING token: this is not the token by {name}" in text
    assert "WARNING foreign: sent HTTP by scpi 127.0.0.1:" in text
    assert secret not in text and "guess" not in text
    assert secret not in str(events) and "EmergencyStop" not in text


@posix
def test_the_end_of_its_terminal_is_an_orderly_end(tmp_path: Path) -> None:
    """SIGHUP, as from a closed window or a lost ssh: at rest, kept, and exit status 129."""
    (tmp_path / "live.toml").write_text(
        "[serve]\nmiss_share = 1.0\nparent_timeout = '5 s'\nloop_timeout = '5 s'\n"
    )
    master, slave = os.openpty()
    options = ("--scpi", "0", "--web", "-1", "--state", "position.json", "--record", "made")

    def attached() -> None:
        os.login_tty(slave)
        signal.signal(signal.SIGHUP, signal.SIG_DFL)  # these tests may run under nohup

    process = subprocess.Popen(
        [*RUN, *options, "--config", "live.toml"],
        cwd=tmp_path,
        start_new_session=True,
        preexec_fn=attached,  # noqa: PLW1509 - no threads here
    )
    os.close(slave)
    try:
        said = b""
        while b"Ctrl-C ends it" not in said:
            said += os.read(master, 1000)
        found = re.search(rb"SCPI: \S+ port (\d+)", said)
        assert found is not None
        with socket.create_connection(("127.0.0.1", int(found[1])), 30.0) as client:
            assert ask(client, "SYST:LOCK:REQ?") == "1"
            assert ask(client, "ENAB;:JOG:MACR 1 MM/S;:SYST:ERR?") == '0,"No error"'
            os.close(master)  # the system sends SIGHUP
            assert process.wait(60.0) == 129
    finally:
        process.kill()
        process.wait()
    kept = persist.load(tmp_path / "position.json")
    assert isinstance(kept, persist.Kept) and not kept.moving
    (file,) = (tmp_path / "made").iterdir()
    assert np.allclose(Recording.load(file)["motor"][-5:], 0.0)
