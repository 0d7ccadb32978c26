"""A long conversation over SCPI with a server of the twin: every command, most of the errors."""

from __future__ import annotations

import re
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from macromicro.serve.scpi import Server
from macromicro.serve.station import Station
from tests.serve.quick import quick
from tests.waiting import until

from .record import frozen

SCRIPT = Path(__file__).with_name("conversation.txt")
PATIENCE_S = 60.0
VERSION = "1999.0"


@pytest.fixture
def link(tmp_path: Path) -> Iterator[socket.socket]:
    with (
        Station(settings=quick(), state=tmp_path / "position.json") as station,
        Server(station, port=0, folder=tmp_path) as server,
    ):
        # What is known of the position is told once the loop runs: before the client is there.
        until(lambda: any(event.kind == "trust" for event in station.events()[1]))
        with socket.create_connection(server.address, timeout=PATIENCE_S) as link:
            yield link


def _lines(link: socket.socket) -> Iterator[str]:
    text = b""
    while True:
        while b"\n" not in text:
            got = link.recv(65536)
            assert got, "the server hung up"
            text += got
        line, _, text = text.partition(b"\n")
        yield line.decode("latin-1")


def _answers(lines: Iterator[str]) -> tuple[list[str], str]:
    """The answers before the version and the errors that are asked for behind each command."""
    found: list[str] = []
    for line in lines:
        if found and found[-1] == VERSION and line != VERSION:
            return found[:-1], line
        found.append(line)
    raise AssertionError("the server hung up")


def _shown(line: str, answer: str) -> str:
    """An answer without what time and noise make of it: after `~` digits count for nothing."""
    return re.sub(r"[-+]?\d[\d.]*(E[-+]?\d+)?", "#", answer) if line.startswith("~") else answer


def test_conversation(link: socket.socket) -> None:
    found, lines = [], _lines(link)
    for line in SCRIPT.read_text(encoding="utf-8").splitlines():
        if not line or line.startswith("#"):
            continue
        link.sendall(f"{line.lstrip('~')}\nSYST:VERS?\nSYST:ERR:ALL?\n".encode())
        answers, errors = _answers(lines)
        found.append([line, *(_shown(line, text) for text in (*answers, errors))])
    frozen("scpi", found)
