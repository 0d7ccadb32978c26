"""Orders that no page would give, before the true machine: its loop goes on."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from web_parts import Client

from macromicro.control.live.messages import Accepted, Enable
from macromicro.serve.station import Station
from macromicro.serve.web import WebServer
from macromicro.serve.web.server import Bounds

BOUNDS = Bounds(views=1e3, rate=1e4, burst=1e4)
HUGE = 10**400
VALUES: list[Any] = [HUGE, -HUGE, 1e308, -1e308, "x", "\ud800", None, True, [], {}, [[[]]]]


def orders() -> Iterator[dict[str, Any]]:
    """Every order with every value in each of its places."""
    for value in VALUES:
        for what in ("move to", "move by", "move micro"):
            for unit in ("mm", "m", value):
                yield {"do": what, "value": value, "unit": unit}
        yield {"do": "move macro", "value": value}
        yield {"do": "jog", "stage": "micro", "speed": value}
        yield {
            "do": "jog",
            "stage": "micro",
            "speed": 1e-4,
            "hold": value if value is not True else 0,
        }
        yield {"do": "follow", "stage": value, "hold": 0.1}
        yield {"do": "follow", "stage": "macro", "hold": value}
        yield {"do": "point", "value": value, "velocity": value, "unit": "mm", "time": value}
        yield {"do": "points", "x": value, "y": 0.0, "unit": value}
        yield {"do": "capture", "signals": value}
        yield {"do": "capture", "signals": [value], "trigger": value}
        yield {"do": "capture", "signals": ["t"], "trigger": {"kind": value, "threshold": value}}
        yield {"do": "capture", "signals": ["t"], "before": value, "repeat": value}
        yield {"do": "captured", "seen": value}
        yield {"do": "jog", "stage": value, "speed": 0.0}
        yield {"do": "fan", "on": value if value is not True else 1}
        yield {"do": "programme", "name": value}
        for path in ("pid.kp", "sequence.wait", "macro_law", "pid", "", value):
            yield {"do": "gains", "changes": [[path, value, value]]}
        yield {"do": "gains", "changes": value}
        yield {"do": "view", "span": value}
        yield {"do": "view", "columns": value, "view": value, "span": 11}
        yield {"do": "login", "token": value}
        yield {"do": "download", "name": value, "offset": value}
        yield {"do": value}


@pytest.fixture(scope="module")
def viewer(station: Station, profile: Path) -> Iterator[Client]:
    with WebServer(station, port=0, folder=profile, bounds=BOUNDS) as server:
        client = Client(server.address[1], {})
        yield client
        client.order("release")
        client.close()


def test_garbage_of_every_order_ends_nothing(viewer: Client, station: Station) -> None:
    old = {g["path"]: g["value"] for g in viewer.get("gains")}
    station.emergency()
    station.release(station.snapshot().holder)  # a page that is still open
    assert viewer.order("take")["ok"]
    for order in orders():
        viewer.put(do="beat")
        reply = viewer.order(order.pop("do"), **order)
        fine = order.get("span") is None and "token" not in order
        assert not reply["ok"] or not fine or order == {"stage": "micro", "speed": 0.0}, order
    for path in ("pid.kp", "sequence.wait"):
        for value in VALUES:
            reply = viewer.order("gains", changes=[[path, old[path], value]])
            assert not reply["ok"] and "control" not in reply["reason"], (path, value)
    now = station.snapshot()
    assert now.running and now.fault is None and now.motion == 0
    assert station.request(viewer.welcome["client"], Enable()) == Accepted()
    assert viewer.order("emergency")["ok"]
