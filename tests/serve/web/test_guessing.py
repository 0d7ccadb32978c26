"""Wrong tokens are counted by address, whatever the number of connections."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from web_parts import Client, Station

from macromicro.serve.web.server import Bounds
from tests.waiting import until

Make = Callable[..., Client]


def test_a_new_connection_has_no_new_guesses(client: Make, fake: Station) -> None:
    rest: dict[str, Any] = {"token": "open sesame", "bounds": Bounds(pause=0.01, tries=3)}
    client(**rest)
    problems = []
    for k in range(6):
        viewer = client({"token": f"guess {k}"})
        problems.append(viewer.welcome["problem"])
        viewer.close()
    assert problems[:3] == ["this is not the token"] * 3
    assert all("wait" in words for words in problems[3:])
    late = client({"token": "open sesame"})
    assert not late.welcome["admitted"] and "wait" in late.welcome["problem"]
    assert "wait" in late.order("login", token="open sesame")["reason"]
    assert late.order("stop")["ok"] and late.order("emergency")["ok"]


def test_an_admitted_page_comes_back_while_its_address_is_shut_out(client: Make) -> None:
    own = client({"token": "open sesame"}, token="open sesame", bounds=Bounds(pause=0.01, tries=2))
    own.order("take")
    for k in range(2):
        client({"token": f"guess {k}"})
    assert own.order("fan", on=True)["ok"]  # whoever is in stays in
    own.close()
    again = client({"token": "open sesame", "session": own.welcome["session"]})
    assert again.welcome["admitted"] and again.order("fan", on=False)["ok"]
    assert not client({"token": "open sesame"}).welcome["admitted"]


def test_clients_that_are_gone_are_not_listed(client: Make, fake: Station) -> None:
    bounds = Bounds(pause=0.01)
    own = client({"token": "open sesame"}, token="open sesame", bounds=bounds)
    own.order("take")
    for k in range(4):
        client({"token": f"guess {k}"}).close()
    until(lambda: fake.connected == [own.welcome["client"]])
    own.close()  # the holder may come back: it is listed until it counts as lost
    other = client()
    wanted = [own.welcome["client"], other.welcome["client"]]
    other.get("state", lambda state: state["clients"] == wanted)
