"""Clients of other protocols: nothing of what they send is done, whatever it contains."""

from __future__ import annotations

import functools
import http.server
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests import browser
from tests.serve.fake_station import FakeStation
from tests.serve.scpi.client import Client
from tests.waiting import until

from macromicro.serve.door import _first_line
from macromicro.serve.door._first_line import FirstLine, ForeignProtocol, Grammar
from macromicro.serve.gcs import GcsServer
from macromicro.serve.gcs.server import GRAMMAR as GCS
from macromicro.serve.scpi import Server
from macromicro.serve.scpi.server import GRAMMAR as SCPI
from macromicro.serve.web import WebServer

DEADLY = b"\nSYST:LOCK:REQ?;:ENAB\nHOME\nABOR\nSTOP\nSVO 1 1\nFRF\nMOV 1 100\nSTP\n"
FOREIGN = {
    "POST": (b"POST / HTTP/1.1\r\nHost: 127.0.0.1:5025\r\n\r\n", "HTTP"),
    "GET with commands": (b"GET /;ABOR; HTTP/1.1\r\nHost: x\r\n", "HTTP"),
    "lower case": (b"get /;abor; http/1.1\r\n", "HTTP"),
    "without a version": (b"GET /;ABOR;", "HTTP"),
    "behind empty lines": (b"\r\n\n  \nGET /;ABOR; HTTP/1.1\r\n", "HTTP"),
    "a command for a method": (b"STOP / HTTP/1.1\r\n", "HTTP"),
    "a command and more": (b"ABOR;STOP HTTP/1.1\r\n", "HTTP"),
    "OPTIONS": (b"OPTIONS * HTTP/1.1\r\n", "HTTP"),
    "CONNECT": (b"CONNECT 127.0.0.1:5025 HTTP/1.1\r\n", "HTTP"),
    "through a proxy": (b"GET http://127.0.0.1:5025/ HTTP/1.1\r\n", "HTTP"),
    "a header line": (b"Host: 127.0.0.1\r\n", "HTTP"),
    "HTTP/2": (b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", "HTTP"),
    "TLS": (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", "TLS"),
    "TURN": (b"\x00\x03\x00\x08\x21\x12\xa4\x42", "no SCPI"),
    "SSH": (b"SSH-2.0-OpenSSH_9.2p1\r\n", "SSH"),
    "PJL": (b"\x1b%-12345X@PJL INFO STATUS\r\n", "a printer's language"),
    "PJL alone": (b"@PJL INFO ID\r\n", "a printer's language"),
    "RTSP": (b"DESCRIBE rtsp://127.0.0.1/ RTSP/1.0\r\n", "RTSP"),
    "SIP": (b"INVITE sip:bob@127.0.0.1 SIP/2.0\r\n", "SIP"),
    "Redis": (b"*1\r\n$4\r\nPING\r\n", "no SCPI"),
    "JSON": (b'{"do": "STOP"}', "no SCPI"),
    "telnet": (b"\xff\xfd\x03", "no SCPI"),
    "a long address": (b"GET /" + b"a" * 5000 + b";ABOR; HTTP/1.1\r\n", "HTTP"),
}
OWN = (
    b"*IDN?",
    b"  :SYST:REM",
    b"SYST:LOCK:REQ?;:ENAB;HOME",
    b"\r\nSTOP",
    b"MOVE:ABS 42.123 MM;*OPC?",
    b"JOG:MACR 5 MM/S",
    b"PROG:LOAD #3600title = 'a'",
    b'SYST:AUTH "the token HTTP/1.1"',
    b"FORM REAL,64",
    b"NONSENSE",
    b"STAG2:POS?\r",
)


GCS_OWN = (
    b"*IDN?",
    b"  \r\nPOS?",
    b"MOV 1 100.5",
    b"MVR X -0.5 Y .25",
    b"svo 1 1\r",
    b"CCL 1 a/token HTTP/1.1 more",
    b"VEL? X Y",
    b"XYZ 1",
)


@pytest.mark.parametrize("grammar", [SCPI, GCS], ids=["scpi", "gcs"])
@pytest.mark.parametrize("cut", [1, 3, 10_000])
@pytest.mark.parametrize(("data", "name"), FOREIGN.values(), ids=FOREIGN)
def test_a_stranger_is_known_by_its_first_line(
    grammar: Grammar, data: bytes, name: str, cut: int
) -> None:
    line, data = FirstLine(grammar), data + DEADLY
    with pytest.raises(ForeignProtocol) as found:
        for start in range(0, len(data), cut):
            assert line.take(data[start : start + cut]) == b""
    if cut > 10:
        assert str(found.value) in (name, f"no {grammar.name}")


def test_strangers_are_named() -> None:
    for data, name in FOREIGN.values():
        with pytest.raises(ForeignProtocol, match=name):
            FirstLine(SCPI).take(data + DEADLY)


@pytest.mark.parametrize(
    ("grammar", "data"), [*((SCPI, own) for own in OWN), *((GCS, own) for own in GCS_OWN)]
)
@pytest.mark.parametrize("cut", [1, 10_000])
def test_own_clients_are_heard(grammar: Grammar, data: bytes, cut: int) -> None:
    line, heard, sent = FirstLine(grammar), b"", 0
    while not heard:  # GCS needs no newline behind a carriage return
        heard = line.take((data + b"\n")[sent : sent + cut])
        sent += cut
    assert (data + b"\n").lstrip(b"\r\n ").startswith(heard) and sent >= len(data)


@pytest.mark.parametrize("byte", [b"\x05", b"\x07", b"\x18"])
def test_single_bytes_of_gcs_wait_for_no_newline(byte: bytes) -> None:
    assert FirstLine(GCS).take(byte) == byte
    line = FirstLine(GCS)
    assert line.take(b"POS? 1") == b"" and line.take(byte) == b"POS? 1" + byte


def test_a_first_line_is_not_held_without_end() -> None:
    line = FirstLine(SCPI)
    assert line.take(b"\n \r" * 100_000) == b""
    assert line.take(b"PROG:LOAD #800010000") == b""
    assert len(line.take(b"x" * 10_000)) == 10_020


# What a page of another origin can make a browser send, to each port of the package.
ATTACKS = """
const [ports, done] = [arguments[0], arguments[1]];
const deadly =
  "\\nSYST:LOCK:REQ?;:ENAB\\nHOME\\nABOR\\nSTOP\\nSVO 1 1\\nFRF\\nMOV 1 100\\nSTP\\n";
const hello = '{"do": "hello"}', orders = ["emergency", "stop", "take"];
const tried = [];
function form(url) {
  const frame = document.createElement("iframe"), form = document.createElement("form");
  frame.name = "f" + Math.random();
  const field = document.createElement("textarea");
  field.name = deadly, field.value = deadly;
  form.append(field);
  Object.assign(form, {action: url, method: "POST", enctype: "text/plain", target: frame.name});
  document.body.append(frame, form);
  form.submit();
}
function image(url) {
  document.body.append(Object.assign(new Image(), {src: url}));
}
function socket(url) {
  return new Promise(ended => {
    let opened = false;
    const live = new WebSocket(url);
    live.onopen = () => {
      opened = true;
      live.send(hello);
      for (const what of orders) live.send(JSON.stringify({do: what, id: 1}));
      live.send(deadly);
    };
    live.onclose = () => ended(opened);
    setTimeout(() => ended(opened), 3000);
  });
}
(async () => {
  const opened = [];
  for (const host of ports) {
    const url = "http://" + host, post = {mode: "no-cors", method: "POST", body: deadly};
    const headers = {"Content-Type": "text/plain;\\tSTOP"};
    for (const [path, how] of [
      ["/", post], ["/", {...post, headers}], ["/;ABOR;", {mode: "no-cors"}],
      ["/live", post], ["/live;STOP", {method: "STOP", body: deadly}],
      ["/", {...post, method: "PUT", mode: "cors"}], ["/;ABOR;?;STOP;", {credentials: "include"}],
    ]) {
      const ended = new AbortController();
      setTimeout(() => ended.abort(), 3000);
      let read = "";
      try {
        read = await (await fetch(url + path, {...how, signal: ended.signal})).text();
      } catch (error) {}
      tried.push(read);
    }
    navigator.sendBeacon(url + "/", deadly);
    form(url + "/");
    image(url + "/;ABOR;");
    opened.push(await socket("ws://" + host + "/live"));
    opened.push(await socket("ws://" + host + "/;ABOR;"));
  }
  setTimeout(() => done([tried.join(""), opened]), 1000);
})();
"""


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *what: Any) -> None:
        pass


@pytest.fixture
def evil(tmp_path: Path) -> Iterator[int]:
    """The port of somebody else's site."""
    (tmp_path / "index.html").write_text("<!doctype html><title>games</title><body>")
    handler = functools.partial(Quiet, directory=str(tmp_path))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as site:
        thread = threading.Thread(target=site.serve_forever, daemon=True)
        thread.start()
        yield site.server_address[1]
        site.shutdown()
        thread.join()


@pytest.fixture(scope="module")
def visitor(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A browser, for which somebody else's DNS leads a name to this computer."""
    browser.needed()
    made = browser.driver(tmp_path_factory.mktemp("browser"), "127.0.0.1", "evil.example")
    made.set_script_timeout(90)
    yield made
    made.quit()


@pytest.mark.parametrize(
    "name", ["127.0.0.1", "evil.example"], ids=["other origin", "rebound name"]
)
def test_no_page_of_another_site_drives_the_machine(
    visitor: Any, evil: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """A real browser, every port that this package opens, every kind of request that needs no
    consent; also where the site's own name was led to this computer."""
    station: Any = FakeStation()
    heard: list[bytes] = []
    take = _first_line.FirstLine.take

    def noted(line: FirstLine, data: bytes) -> bytes:
        heard.append(data)
        return take(line, data)

    monkeypatch.setattr(_first_line.FirstLine, "take", noted)
    station.rig, station.recorded = "twin", ()
    with (
        Server(station, port=0, folder=tmp_path) as server,
        GcsServer(station) as controller,
        WebServer(station, port=0, folder=tmp_path) as page,
    ):
        ports = [f"{name}:{each.address[1]}" for each in (server, controller, page)]
        visitor.get(f"http://{name}:{evil}/")
        read, opened = visitor.execute_async_script(ATTACKS, ports)
        assert sum(data.startswith(b"POST / HTTP/1.1") for data in heard) >= 6
        assert any(data.startswith(b"GET /;ABOR; HTTP/1.1") for data in heard)
        assert station.requests == [] and station.emergencies == 0 and station.holder == ""
        assert opened == [False] * 6
        assert "macromicro" not in read
        for each in (server, controller):
            client = Client(each.address)
            until(lambda client=client: client.ask("*IDN?").startswith("macromicro,"))
            client.close()
