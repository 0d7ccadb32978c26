"""Who gets a place: viewers that may not command keep nobody out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from web_parts import Client, Station, until
from websockets.exceptions import ConnectionClosed

from macromicro.serve.web import WebServer, places
from macromicro.serve.web.bounds import Bounds
from macromicro.serve.web.places import ADMITTED, HOLDER, NEIGHBOUR, STRANGER, Places

Serve = Callable[..., WebServer]


class Guest:
    def __init__(self, rank: int = STRANGER) -> None:
        self.rank = rank
        self.dismissed = False

    def dismiss(self) -> None:
        self.dismissed = True


def test_a_higher_rank_takes_the_place_of_the_oldest_of_the_lowest() -> None:
    found = Places(3, 8)
    guests = [Guest(ADMITTED), Guest(), Guest()]
    assert all(found.claim(guest) for guest in guests)
    assert not found.claim(Guest())
    assert found.claim(Guest(ADMITTED)) and guests[1].dismissed and not guests[2].dismissed
    assert found.claim(Guest(NEIGHBOUR)) and guests[2].dismissed
    assert found.claim(Guest(ADMITTED))
    assert not found.claim(Guest(ADMITTED)) and not guests[0].dismissed
    assert found.claim(Guest(HOLDER)) and guests[0].dismissed


def test_whoever_logs_in_later_is_no_stranger() -> None:
    found = Places(1, 8)
    guest = Guest()
    found.claim(guest)
    guest.rank = ADMITTED
    assert not found.claim(Guest(ADMITTED))
    found.leave(guest)
    assert found.claim(Guest())


def test_a_page_takes_its_own_place_again() -> None:
    found = Places(1, 8)
    old, new = Guest(ADMITTED), Guest(ADMITTED)
    assert found.claim(old) and found.claim(new, instead=old)
    assert not old.dismissed and not found.claim(Guest(ADMITTED))


def test_of_the_silent_ones_the_oldest_goes() -> None:
    found = Places(2, 3)
    guests = [Guest() for _ in range(5)]
    for guest in guests:
        found.arrive(guest)
    assert [guest.dismissed for guest in guests] == [True, True, False, False, False]
    assert found.claim(guests[2])
    found.arrive(Guest())
    assert not guests[3].dismissed


def far(monkeypatch: pytest.MonkeyPatch) -> None:
    """Viewers seem to be of other computers."""
    monkeypatch.setattr("macromicro.serve.web.connection.is_loopback", lambda host: False)


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
    assert places.HOLDER > places.ADMITTED
