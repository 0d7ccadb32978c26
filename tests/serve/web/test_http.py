"""Who is let in: names, origins, tokens; and the headers of every answer."""

from __future__ import annotations

import http.client
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from websockets.datastructures import Headers
from websockets.exceptions import InvalidStatus
from websockets.http11 import Request

from macromicro.errors import InputError
from macromicro.serve.hosts import is_loopback
from macromicro.serve.web import WebServer
from macromicro.serve.web._http import Gate
from tests.waiting import until

LONG = "open sesame, and be quick"
Serve = Callable[..., WebServer]


def asked(host: str, origin: str | None = None) -> Request:
    headers = Headers({"Host": host})
    if origin is not None:
        headers["Origin"] = origin
    return Request("/live", headers)


@pytest.mark.parametrize(
    ("host", "ours"),
    [
        ("localhost:8080", True),
        ("LOCALHOST", True),
        ("127.0.0.1:8080", True),
        ("[::1]:8080", True),
        ("192.168.7.4:80", True),  # no DNS leads there
        ("bench.lab:8080", True),
        ("evil.example", False),
        ("localhost.evil.example", False),
        ("127.0.0.1.evil.example", False),
        ("localhost:80@evil.example", False),
        ("", False),
        ("a b", False),
        ("[evil]:1", False),
    ],
)
def test_only_names_of_this_server_are_answered(host: str, ours: bool) -> None:
    gate = Gate(names=["Bench.lab"])
    assert (gate.host(asked(host)) is not None) == ours
    assert gate.same_origin(asked(host, f"http://{host}")) == ours


@pytest.mark.parametrize(
    "origin",
    [
        None,
        "",
        "null",
        "http://evil.example",
        "http://127.0.0.1",
        "http://127.0.0.1:8081",
        "http://localhost:8080",
        "ws://127.0.0.1:8080",
        "http://127.0.0.1:8080/",
        "file://",
    ],
)
def test_another_origin_is_not_the_page(origin: str | None) -> None:
    assert not Gate().same_origin(asked("127.0.0.1:8080", origin))


def test_two_hosts_or_origins_are_none() -> None:
    request = asked("127.0.0.1:1", "http://127.0.0.1:1")
    assert Gate().same_origin(request)
    request.headers["Origin"] = "http://evil.example"
    assert not Gate().same_origin(request)
    request.headers["Host"] = "evil.example"
    assert Gate().host(request) is None


@pytest.mark.parametrize(
    ("host", "own"), [("localhost", True), ("127.3.2.1", True), ("::1", True), ("0.0.0.0", False)]
)
def test_loopback(host: str, own: bool) -> None:
    assert is_loopback(host) == own


def get(server: WebServer, path: str, host: str | None = None, method: str = "GET") -> Any:
    connection = http.client.HTTPConnection("127.0.0.1", server.address[1], timeout=10)
    name = f"127.0.0.1:{server.address[1]}" if host is None else host
    connection.putrequest(method, path, skip_host=True)
    connection.putheader("Host", name)
    connection.endheaders()
    response = connection.getresponse()
    body = response.read()
    connection.close()
    return response, body


def test_every_answer_keeps_the_page_to_itself(serve: Serve) -> None:
    server = serve()
    for path, status in (("/", 200), ("/main.js", 200), ("/style.css", 200), ("/secret", 404)):
        response, body = get(server, path)
        assert response.status == status and body
        policy = response.getheader("Content-Security-Policy")
        assert "default-src 'none'" in policy and "frame-ancestors 'none'" in policy
        assert "unsafe" not in policy and "http:" not in policy
        assert response.getheader("X-Content-Type-Options") == "nosniff"
        assert response.getheader("X-Frame-Options") == "DENY"
        assert response.getheader("Server") is None
        assert response.getheader("Set-Cookie") is None
        assert response.getheader("Access-Control-Allow-Origin") is None


@pytest.mark.parametrize(
    "path", ["/../server.py", "/%2e%2e/server.py", "//etc/passwd", "/static/main.js", "/live/x"]
)
def test_only_the_pages_files_can_be_had(serve: Serve, path: str) -> None:
    response, _ = get(serve(), path)
    assert response.status == 404


def test_the_page_names_nothing_elsewhere_and_no_inline_code(serve: Serve) -> None:
    _, body = get(serve(), "/")
    page = body.decode()
    assert "://" not in page and "onclick" not in page and "style=" not in page
    assert page.count("<script") == page.count("></script>") == 2 and "<style" not in page


def test_a_foreign_name_gets_no_page(serve: Serve) -> None:
    server = serve()
    response, body = get(server, "/", host="evil.example")
    assert response.status == 421 and b"<html" not in body
    assert get(server, "/", host="localhost")[0].status == 200


def test_the_refusal_of_a_name_says_what_to_do(serve: Serve) -> None:
    _, body = get(serve(), "/", host="bench.lab")
    assert b"--name NAME" in body and b"bench" not in body
    named = serve(names=["bench.lab"])
    assert get(named, "/", host=f"bench.lab:{named.address[1]}")[0].status == 200


def test_a_server_that_others_reach_knows_its_own_names(
    fake: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("socket.gethostname", lambda: "Bench")
    monkeypatch.setattr("socket.getfqdn", lambda name="": "bench.lab.example")
    with WebServer(fake, "0.0.0.0", 0, token=LONG, folder=tmp_path) as server:
        for name in ("bench", "bench.local", "bench:80"):
            assert get(server, "/", host=name)[0].status == 200
        until(lambda: get(server, "/", host="bench.lab.example")[0].status == 200)
        assert get(server, "/", host="evil.example")[0].status == 421


def test_a_server_of_this_computer_alone_does_not(
    serve: Serve, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("socket.gethostname", lambda: "bench")
    assert get(serve(), "/", host="bench")[0].status == 421


def test_a_host_given_by_name_is_a_name(fake: Any) -> None:
    server = WebServer(fake, "bench.lab", 0, token=LONG)
    assert server._gate.host(asked("bench.lab:80")) == "bench.lab:80"


def test_another_method_is_refused(serve: Serve) -> None:
    try:
        status = get(serve(), "/", method="POST")[0].status
    except http.client.HTTPException:
        return
    assert status in (400, 405)


@pytest.mark.parametrize("origin", [None, "http://evil.example", "null"])
def test_a_socket_of_another_origin_is_refused(client: Any, origin: str | None) -> None:
    own = client()
    with pytest.raises(InvalidStatus) as refused:
        client(origin=origin)
    assert refused.value.response.status_code == 403
    assert own.order("take")["ok"]


def test_a_host_that_others_reach_needs_a_token(fake: Any) -> None:
    with pytest.raises(InputError, match="token"):
        WebServer(fake, "0.0.0.0", 0)
    with pytest.raises(InputError, match="token"):
        WebServer(fake, "127.0.0.1", 0, token=" ")
    with pytest.raises(InputError, match="token: it has 11 characters"):
        WebServer(fake, "0.0.0.0", 0, token="open sesame")
    WebServer(fake, "0.0.0.0", 0, token=LONG)


def test_a_port_in_use_is_named(serve: Serve, fake: Any) -> None:
    port = serve().address[1]
    with pytest.raises(InputError, match=f"port {port}.*in use"):
        WebServer(fake, port=port).start()
    with pytest.raises(InputError, match="port"):
        WebServer(fake, port=70_000).start()
    with pytest.raises(InputError, match="host"):
        WebServer(fake, host="192.0.2.1", port=0, token=LONG).start()
