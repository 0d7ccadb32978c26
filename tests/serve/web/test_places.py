"""Who gets a place: viewers that may not command keep nobody out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from web_parts import Client, Station
from websockets.exceptions import ConnectionClosed

from macromicro.serve.web import WebServer
from macromicro.serve.web.server import Bounds
from tests.waiting import until

Serve = Callable[..., WebServer]


def far(monkeypatch: pytest.MonkeyPatch) -> None:
    """Viewers seem to be of other computers."""
    monkeypatch.setattr("macromicro.serve.client.is_loopback", lambda host: False)


def ended(viewer: Client) -> int:
    """The code with which it is sent away."""
    with pytest.raises(ConnectionClosed) as closed:
        while True:
            viewer.read()
    assert closed.value.rcvd is not None
    return closed.value.rcvd.code


def test_viewers_without_a_token_keep_its_holder_not_out(
    serve: Serve, fake: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    far(monkeypatch)
    port = serve(token="open sesame", bounds=Bounds(viewers=2)).address[1]
    strangers = [Client(port, {}), Client(port, {})]
    third = Client(port)
    third.put(do="hello")
    assert ended(third) == 1013
    own = Client(port, {"token": "open sesame"})
    assert own.order("take")["ok"] and own.order("stop")["ok"]
    assert ended(strangers[0]) == 1013
    assert strangers[1].order("stop")["ok"]
    own.close()
    for each in (strangers[1], own):
        each.close()


def test_the_holder_comes_back_where_all_places_are_taken(
    serve: Serve, fake: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    port = serve(bounds=Bounds(viewers=2)).address[1]
    own = Client(port, {})
    own.order("take")
    own.close()
    others = [Client(port, {}), until(lambda: _viewer(port))]
    again = Client(port, {"session": own.welcome["session"]})
    assert again.order("fan", on=True)["ok"]
    assert ended(others[0]) == 1013
    for each in (again, others[1]):
        each.close()


def _viewer(port: int) -> Client | None:
    try:
        return Client(port, {})
    except ConnectionClosed:
        return None


def test_silent_connections_keep_nobody_out(serve: Serve, fake: Station) -> None:
    port = serve(bounds=Bounds(silent=4)).address[1]
    silent = [Client(port) for _ in range(8)]
    own: Any = Client(port, {})
    assert own.order("emergency")["ok"]
    assert ended(silent[0]) == 1013
    for each in (*silent, own):
        each.close()
