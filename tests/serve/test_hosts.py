"""Names under which the page is reached, and what is printed of an address."""

from __future__ import annotations

import pytest

from macromicro.errors import InputError
from macromicro.serve import hosts


@pytest.fixture(autouse=True)
def own_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hosts.socket, "gethostname", lambda: "Stage-PC")


@pytest.mark.parametrize(
    ("host", "bound", "names", "shown"),
    [
        ("127.0.0.1", "127.0.0.1", (), "127.0.0.1"),
        ("0.0.0.0", "0.0.0.0", ("stage-pc",), "stage-pc"),
        ("::", "::", ("stage-pc",), "stage-pc"),
        ("10.0.0.7", "10.0.0.7", (), "10.0.0.7"),
        ("Bench.lab", "10.0.0.7", ("bench.lab",), "Bench.lab"),
        ("localhost", "127.0.0.1", ("localhost",), "127.0.0.1"),
    ],
)
def test_names_and_what_is_printed(
    host: str, bound: str, names: tuple[str, ...], shown: str
) -> None:
    assert hosts.names(host) == names
    assert hosts.reachable_address(host, bound) == shown


def test_a_computer_without_a_usable_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hosts.socket, "gethostname", lambda: "stage_pc")
    assert hosts.names("0.0.0.0") == ()
    assert hosts.reachable_address("0.0.0.0", "0.0.0.0") == "0.0.0.0"


@pytest.mark.parametrize("name", ["", "a:80", "http://a", "a b", "-a", "a" * 300])
def test_what_is_no_name(name: str) -> None:
    with pytest.raises(InputError, match=r"--name.*without scheme and port"):
        hosts.names("127.0.0.1", (name,))


def test_addresses_of_pages() -> None:
    assert hosts.url("::1", 80) == "http://[::1]:80/"
    assert hosts.url("bench.lab", 8080) == "http://bench.lab:8080/"
