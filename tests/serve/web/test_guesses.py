"""Wrong tokens are counted by address, whatever the number of connections."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from web_parts import Client, Station, until

from macromicro.serve.web import guesses
from macromicro.serve.web.bounds import Bounds
from macromicro.serve.web.guesses import Guesses, network

Make = Callable[..., Client]


def test_a_few_wrong_ones_shut_an_address_out_for_a_while(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr("macromicro.serve.web.guesses.time.monotonic", lambda: now[0])
    found = Guesses(3, 60.0)
    for _ in range(3):
        assert found.wait("192.0.2.1") == 0.0
        found.wrong("192.0.2.1")
        now[0] += 1.0
    assert found.wait("192.0.2.1") == pytest.approx(57.0)
    assert found.wait("192.0.2.2") == 0.0
    now[0] += 57.0
    assert found.wait("192.0.2.1") == 0.0
    found.wrong("192.0.2.1")  # one is forgotten, the others are not yet
    assert found.wait("192.0.2.1") == pytest.approx(1.0)


def test_memory_is_bounded() -> None:
    found = Guesses(1, 60.0)
    for k in range(3 * guesses.MOST):
        found.wrong(f"10.{k >> 16}.{k >> 8 & 255}.{k & 255}")
    assert len(found._wrong) == guesses.MOST


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("192.0.2.1", "192.0.2.2", False),
        ("2001:db8::1", "2001:db8::ffff:1", True),
        ("2001:db8::1", "2001:db8:0:1::1", False),
        ("fe80::1%eth0", "fe80::2", True),
        ("::ffff:192.0.2.1", "192.0.2.1", True),
        ("?", "?", True),
    ],
)
def test_an_address_that_is_changed_at_will_counts_once(one: str, other: str, same: bool) -> None:
    assert (network(one) == network(other)) == same


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
