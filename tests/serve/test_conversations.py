"""Conversations with the servers of GCS, the page and EPICS; the station has no machine."""

from __future__ import annotations

import asyncio
import re
from pathlib import Path
from typing import Any

import pytest

from macromicro.serve._instrument import Instrument
from macromicro.serve.gcs import GcsServer
from macromicro.serve.web import WebServer
from tests.frozen.record import frozen
from tests.serve.fake_station import FakeStation
from tests.serve.scpi.client import Client as Socket
from tests.serve.virtual_time import run
from tests.serve.web.web_parts import Client, Station

# A line, or `done` and other outcomes, with which the motion under way ends.
GCS = """
*IDN?|CSV?|SAI?|HLP?|POS?|POS? 1|POS? 2|ERR?|ERR?|TMN?|TMX?|SVO?|FRF?|VEL?|VEL 1 0.01|ERR?|ONT?
MOV 1 20|MOV?|ERR?|done|ONT?|MVR 1 2|stalled|ERR?|MOV 1 2000|ERR?|MOV 1|ERR?|MOV 1 x|ERR?
MOV 3 1|ERR?|FRF|done|FRF 1|emergency|ERR?|SVO 1 0|SVO?|MOV 1 5|ERR?|SVO 1 1|SVO 1 2|ERR?
RTR?|RTR 0|ERR?|RTR 1000|RTR?|HDR?|DRL?|DRR? 1 2 1 2|DRR? 0 1|ERR?|NON|ERR?|CCL 1 x|STP|ERR?
"""
PAGE: tuple[dict[str, Any], ...] = (
    {"do": "home"},
    {"do": "take"},
    {"do": "move to", "value": 12.5, "unit": "mm"},
    {"do": "done"},
    {"do": "move to", "value": 12.5, "unit": "furlong"},
    {"do": "move to", "value": 900, "unit": "mm"},
    {"do": "move to", "value": 12.5, "unit": "mm", "rplace": True},
    {"do": "move by", "value": 1, "unit": "mm"},
    {"do": "stop"},
    {"do": "move macro", "value": 600, "replace": True},
    {"do": "stalled"},
    {"do": "jog", "stage": "macro", "value": 1, "unit": "mm"},
    {"do": "wait", "motion": 1},
    {"do": "wait", "motion": "x"},
    {"do": "gains", "changes": [["macro.kp", 1, 2]]},
    {"do": "gains", "changes": []},
    {"do": "limits", "values": None},
    {"do": "limits", "values": {"whole": 1}},
    {"do": "programme", "name": "nothing"},
    {"do": "programme", "uploaded": True},
    {"do": "record"},
    {"do": "end recording"},
    {"do": "settings"},
    {"do": "dance"},
    {"do": ["stop"]},
    {"do": "state"},
    {"do": "emergency"},
    {"do": "release"},
    {"do": "release"},
)
EPICS: tuple[tuple[str, Any], ...] = (
    ("enable", 1),
    ("whole", 50.0),
    ("whole", 5000.0),
    ("whole.RLV", 1.0),
    ("whole.TWF", 1),
    ("whole.HOMF", 1),
    ("whole.SPMG", "Pause"),
    ("whole", 20.0),
    ("whole.SPMG", "Go"),
    ("micro", 0.5),
    ("macro.JOGF", 0),
    ("whole.STOP", 1),
    ("disable", 1),
    ("whole", 10.0),
    ("emergency", 1),
    ("release", 1),
)


def _plain(text: str) -> str:
    """Without what differs between runs: ports, versions and names by date."""
    text = re.sub(r"127\.0\.0\.1[: ]#?\d+", "CLIENT", text)
    return re.sub(r"live-\d+-\d+|\b\d+\.\d+\.(dev)?\d+[+\w.]*", "NAME", text)


def test_gcs() -> None:
    fake, found = FakeStation(), []
    with GcsServer(fake) as server:  # type: ignore[arg-type]
        client = Socket(server.address)
        for word in GCS.replace("\n", "|").strip("|").split("|"):
            if word in ("done", "stalled", "emergency"):
                fake.end(word)
                continue
            client.send(f"{word}\nCSV?")
            lines = [client.line()]
            while lines[-1] != "2.0" or (word == "CSV?" and len(lines) < 2):
                lines.append(client.line())
            found.append([word, *map(_plain, lines[:-1])])
        client.close()
    frozen("gcs", found)


def _told(found: Any) -> Any:
    if isinstance(found, dict):
        hidden = ("session", "version", "client", "safe_s", "text")
        return {key: _told(value) for key, value in found.items() if key not in hidden}
    if isinstance(found, list):
        return [_told(each) for each in found]
    return _plain(found) if isinstance(found, str) else found


def test_page(tmp_path: Path) -> None:
    fake, found = Station(), []
    fake.grow = 0
    with WebServer(fake, port=0, folder=tmp_path) as server:  # type: ignore[arg-type]
        client = Client(server.address[1], {})
        found.append(["hello", _told(client.welcome)])
        found.append(["gains", _told(client.get("gains"))])
        for order in PAGE:
            if order["do"] in ("done", "stalled"):
                fake.end(order["do"])
            else:
                number = client.begin(**order)
                answer = client.get("reply", lambda value, number=number: value == number)
                found.append([order, _told(answer)])
        client.close()
    frozen("page", found)


def test_epics() -> None:
    pytest.importorskip("caproto")
    from macromicro.serve.epics._machine import Channels

    async def talk() -> list[Any]:
        fake, found = FakeStation(), []
        served = Channels(Instrument(fake))  # type: ignore[arg-type]
        channels = served.named("P")

        def values() -> dict[str, Any]:
            return {name: made.value for name, made in channels.items() if "trace" not in name}

        await served.look()
        before = values()
        found.append(["", _told(before)])
        for name, value in EPICS:
            put = asyncio.create_task(channels[f"P:{name}"].write(value))
            await asyncio.sleep(0.5)
            if fake.motion:
                fake.end("done")
            (problem,) = await asyncio.gather(put, return_exceptions=True)
            await asyncio.sleep(0.5)
            await served.look()
            after = values()
            changed = {key: each for key, each in after.items() if each != before[key]}
            found.append([name, value, _told(changed), "" if problem is None else str(problem)])
            before = after
        return found

    frozen("epics", run(talk()))
