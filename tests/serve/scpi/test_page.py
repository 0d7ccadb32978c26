"""docs/scpi.md says what the server does now."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import make_scpi
import pytest

from macromicro.serve.door._connection import Bounds
from macromicro.serve.scpi import Server
from macromicro.serve.scpi._message import MOST_UNITS
from macromicro.serve.scpi.errors import QUEUE
from macromicro.serve.scpi.tree import COMMANDS

DOCS = Path(__file__).parents[3] / "docs"
PAGE = DOCS / "scpi.md"


def test_page_is_up_to_date() -> None:
    """`python docs/make_scpi.py` brings it up to date."""
    assert PAGE.read_text(encoding="utf-8") == make_scpi.render()


def test_page_lists_every_command_once() -> None:
    rows = re.findall(r"^\| `([^`]+)` \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert rows == [c.header for c in COMMANDS]


def test_page_names_the_limits() -> None:
    text = " ".join(PAGE.read_text(encoding="utf-8").split())
    bounds = Bounds()
    assert f"line of at most {bounds.line // 1024} KiB" in text
    assert f"blocks of at most {bounds.block // 2**20} MiB" in text
    assert f"{MOST_UNITS} commands in a message, {bounds.rate:.0f} simple" in text
    assert f"{bounds.clients} clients" in text and f"queue of {QUEUE}" in text
    assert f"Up to {bounds.messages} messages" in text and f"for {bounds.unread:.0f} s" in text


def test_page_s_session_runs(station: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its Python, with a station whose motions end at once and another port."""
    pyvisa = pytest.importorskip("pyvisa")
    block = re.search(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert block is not None
    request, station.mode = station.request, "disabled"

    def at_once(client: str, order: Any, since: Any = None) -> Any:
        reply = request(client, order, since)
        if station.motion:
            station.end("done")
        return reply

    monkeypatch.setattr(station, "request", at_once)
    with Server(station, port=0) as server:
        found: dict[str, Any] = {}
        code = block[1].replace("5025", str(server.address[1]))
        exec(compile(code, str(PAGE), "exec"), found)
        assert len(found["place"]) == 2000
        assert found["positioner"].query("SYST:ERR?") == '0,"No error"'
        found["positioner"].close()
    assert pyvisa is not None
    assert [type(r).__name__ for r in station.requests] == ["Enable", "Home", "MoveTo"]


@pytest.mark.parametrize(
    ("mode", "outcome", "last"),
    [("disabled", "done", '0,"No error"'), ("holding", "done", '0,"No error"'),
     ("ready", "stalled", "-240,")],
)  # fmt: skip
def test_the_line_of_pyvisa_tells_whether_the_move_was_made(
    station: Any, monkeypatch: pytest.MonkeyPatch, capsys: Any, mode: str, outcome: str, last: str
) -> None:
    """Enabled before or not; what went wrong is in what it prints."""
    pytest.importorskip("pyvisa")
    text = (DOCS / "serve.md").read_text(encoding="utf-8")
    block = re.search(r"With PyVISA.*?```python\n(.*?)```", text, re.DOTALL)
    assert block is not None
    request, station.mode = station.request, mode

    def at_once(client: str, order: Any, since: Any = None) -> Any:
        reply = request(client, order, since)
        if station.motion:
            station.end("done" if type(order).__name__ == "Home" else outcome)
        return reply

    monkeypatch.setattr(station, "request", at_once)
    with Server(station, port=0) as server:
        found: dict[str, Any] = {}
        exec(compile(block[1].replace("5025", str(server.address[1])), "serve.md", "exec"), found)
        found["stage"].close()
    assert "MoveTo" in [type(r).__name__ for r in station.requests]
    assert capsys.readouterr().out.startswith(f"1;1;42.1234,0.0357,1;{last}")
