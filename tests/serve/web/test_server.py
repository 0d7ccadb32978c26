"""The protocol: orders and their replies, stops that overtake, viewers that misbehave."""

from __future__ import annotations

import json
import math
import struct
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import pytest
from web_parts import Client, Station
from websockets.exceptions import ConnectionClosed

from macromicro.control.live import messages as m
from macromicro.serve.snapshot import Trouble
from macromicro.serve.web import WebServer, bins
from macromicro.serve.web._orders import Orders
from macromicro.serve.web.server import Bounds
from tests.waiting import until

Serve = Callable[..., WebServer]
Make = Callable[..., Client]


def names(station: Station) -> list[str]:
    return [type(request).__name__ for request in station.requests]


def test_hello_gets_all_that_is_to_be_shown(client: Make, fake: Station) -> None:
    viewer = client({"span": 2.0, "columns": 100, "view": 5})
    about = viewer.welcome
    assert about["admitted"] and about["open"] and "thesis" in about["programmes"]
    assert about["stages"] == ["macro", "micro"]
    assert about["limits"]["whole_high"] == fake.settings.live.limits.whole_high
    state = viewer.get("state")
    assert (state["mode"], state["position_m"]) == ("ready", 0.0421234)
    assert state["motor_v"] is None  # no number, which JSON has not
    assert [g["path"] for g in viewer.get("gains")].count("sequence.wait") == 1
    until(lambda: viewer.read() or viewer.frames)
    kind, view, count, channels = struct.unpack_from("<4I", viewer.frames[0])
    assert (kind, view, channels) == (bins.KIND, 5, len(bins.CHANNELS))
    assert 100 <= count <= 101
    assert fake.connected == [about["client"]]


def test_nothing_moves_by_looking(client: Make, fake: Station) -> None:
    client().get("state")
    assert fake.requests == [] and fake.emergencies == 0


def test_orders_need_control_and_stops_do_not(client: Make, fake: Station) -> None:
    viewer = client()
    refused = viewer.order("enable")
    assert not refused["ok"] and "control" in refused["reason"] and refused["remedy"]
    assert viewer.order("stop")["ok"] and viewer.order("emergency")["ok"]
    assert names(fake) == ["Stop"] and fake.emergencies == 1 and fake.mode == "disabled"
    assert viewer.order("take")["ok"] and viewer.order("enable")["ok"]
    other = client()
    assert not other.order("take")["ok"]
    reply = viewer.order("move to", value=50.0, unit="mm")
    assert reply["ok"] and reply["motion"] == 1
    assert fake.requests[-1].position == pytest.approx(0.05)
    assert not other.order("move to", value=60.0, unit="mm")["ok"]
    assert other.order("stop")["ok"]
    assert fake.ended[1].outcome == "stopped"
    assert viewer.order("release")["ok"] and other.order("take")["ok"]


def test_emergency_tells_how_long_it_took(client: Make) -> None:
    assert client().order("emergency")["safe_s"] == 0.001


def test_an_emergency_without_an_answer_is_told(
    client: Make, fake: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    viewer = client()
    monkeypatch.setattr(fake, "emergency", lambda client: math.nan)
    reply = viewer.order("emergency")
    assert not reply["ok"] and "power" in reply["remedy"]


def test_a_stop_overtakes_and_nothing_moves_behind_it(client: Make, fake: Station) -> None:
    """One order is on its way, one waits: after the stop neither may move anything."""
    viewer = client()
    viewer.order("take")
    fake.open.clear()
    first = viewer.begin("move to", value=50.0, unit="mm")
    until(lambda: "MoveTo" in fake.entered)
    second = viewer.begin("move to", value=60.0, unit="mm")
    stop = viewer.begin("stop")
    until(lambda: "Stop" in names(fake))  # at once, though an order is on its way
    refused = viewer.reply(second)
    assert not refused["ok"] and "stop" in refused["reason"]
    fake.open.set()
    assert viewer.reply(stop)["ok"]
    refused = viewer.reply(first)  # it had not begun
    assert not refused["ok"] and "stop" in refused["reason"]
    assert names(fake) == ["Stop"] and fake.motion == 0


def test_an_emergency_of_another_viewer_overtakes_too(client: Make, fake: Station) -> None:
    viewer, other = client(), client()
    viewer.order("take")
    fake.open.clear()
    first = viewer.begin("move to", value=50.0, unit="mm")
    until(lambda: "MoveTo" in fake.entered)
    second = viewer.begin("enable")
    emergency = other.begin("emergency")
    until(lambda: fake.emergencies == 1)
    fake.open.set()
    assert other.reply(emergency)["ok"]
    assert not viewer.reply(first)["ok"] and not viewer.reply(second)["ok"]
    assert fake.emergencies == 1 and fake.motion == 0 and fake.mode == "disabled"


@pytest.mark.parametrize("what", ["stop", "emergency"])
def test_an_order_being_made_up_is_overtaken_by_anybodys_stop(
    client: Make, fake: Station, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    """Also by one that the page's server knows nothing of."""
    viewer = client()
    viewer.order("take")
    making, go_on, real = threading.Event(), threading.Event(), Orders.request

    def slow(*given: Any) -> Any:
        making.set()
        assert go_on.wait(30.0)
        return real(*given)

    monkeypatch.setattr(Orders, "request", slow)
    first = viewer.begin("programme", name="thesis")
    assert making.wait(30.0)
    fake.request("scpi", m.Stop()) if what == "stop" else fake.emergency("scpi")
    go_on.set()
    refused = viewer.reply(first)
    assert not refused["ok"] and "stop" in refused["reason"]
    assert m.Programme not in {type(r) for r in fake.requests}


def test_a_reload_keeps_control_and_motion(client: Make, fake: Station) -> None:
    viewer = client()
    viewer.order("take")
    viewer.order("move to", value=50.0, unit="mm")
    viewer.close()
    again = client({"session": viewer.welcome["session"]})
    assert again.welcome["client"] == viewer.welcome["client"]
    state = again.get("state", lambda state: state["motion"] == 1)
    assert state["holder"] == again.welcome["client"]
    kinds = [item["kind"] for item in again.get("news")]
    assert "mode" in kinds
    assert again.order("stop")["ok"] and fake.gone == []
    finished = again.get("news", lambda items: any(i["kind"] == "finished" for i in items))
    assert finished[-1]["outcome"] == "stopped"


def test_the_same_page_twice_leaves_the_first(client: Make) -> None:
    viewer = client()
    again = client({"session": viewer.welcome["session"]})
    with pytest.raises(ConnectionClosed) as closed:
        while True:
            viewer.read()
    assert closed.value.rcvd is not None and closed.value.rcvd.code == 4000
    assert again.order("take")["ok"]


def test_a_guessed_session_is_a_new_one(client: Make, fake: Station) -> None:
    viewer = client()
    viewer.order("take")
    for key in ("", "x" * 32, None, 7, [viewer.welcome["session"]]):
        other = client({"session": key})
        assert other.welcome["client"] != viewer.welcome["client"]
        assert not other.order("enable")["ok"]


def test_a_page_that_does_not_come_back_is_lost(serve: Serve, fake: Station) -> None:
    fake.settings = fake.settings._replace(serve=fake.settings.serve._replace(client_timeout=0.2))
    viewer = Client(serve().address[1], {})
    viewer.order("take")
    viewer.order("move to", value=50.0, unit="mm")
    viewer.close()
    until(lambda: fake.gone == [viewer.welcome["client"]])
    assert fake.ended[1].outcome == "lost"


def test_the_loop_ends_a_jog_whose_button_is_no_longer_told_of(client: Make, fake: Station) -> None:
    viewer = client(bounds=Bounds(jog=0.3))
    viewer.order("take")
    viewer.put(do="keep")  # nothing jogs yet
    assert viewer.order("jog", stage="macro", speed=0.01)["ok"]
    assert viewer.order("jog", stage="macro", speed=0.01, hold=1.5)["ok"] is False  # it moves
    assert [r.hold for r in fake.requests if isinstance(r, m.Jog)] == [0.3, 1.5]
    assert fake.renewed == []
    viewer.put(do="keep")
    until(lambda: fake.renewed == [viewer.welcome["client"]])


def test_set_points_are_shown_to_the_machine_without_an_answer(client: Make, fake: Station) -> None:
    viewer = client()
    viewer.order("take")
    early = viewer.order("point", value=1.0, unit="mm")
    assert not early["ok"] and early["remedy"] == "begin with follow"
    assert viewer.order("follow", stage="macro", hold=0.1)["ok"]
    for k in range(1000):  # many more than of other messages are accepted
        viewer.put(do="point", value=k, velocity=0.5, unit="um", time=0.001 * k)
    until(lambda: len(fake.points) == 1000)
    assert fake.points[7] == (m.SetPoint(pytest.approx(7e-6), 0.5), 0.007)
    assert viewer.order("point", value=2.0, unit="mm")["ok"]
    assert not viewer.order("point", value=2.0)["ok"]
    assert not viewer.order("point", value=2.0, unit="mm", speed=1.0)["ok"]
    assert not viewer.order("points", x=2.0, y="a", unit="mm")["ok"]
    assert fake.points[-1] == (
        m.SetPoint(pytest.approx(2e-3), 0.0),
        pytest.approx(math.nan, nan_ok=True),
    )


def test_an_order_with_an_unknown_key_does_nothing_but_a_stop_is_heard(
    client: Make, fake: Station
) -> None:
    viewer = client()
    viewer.order("take")
    reply = viewer.order("limits", macro_low=600, macro_high=900)
    assert not reply["ok"] and "macro_low, macro_high" in reply["reason"]
    assert not viewer.order("limits")["ok"]
    assert not viewer.order("view", span=2.0, rows=7)["ok"]
    assert not viewer.order("state", motion=1)["ok"]
    assert fake.requests == []
    assert viewer.order("stop", now=True)["ok"] and viewer.order("emergency", why="x")["ok"]


def test_a_jog_ends_with_its_connection(client: Make, fake: Station) -> None:
    viewer = client(bounds=Bounds(jog=60.0))
    viewer.order("take")
    viewer.order("jog", stage="micro", speed=1e-4)
    viewer.close()
    until(lambda: fake.requests[-1] == m.Jog("micro", 0.0, client=viewer.welcome["client"]))


def test_a_token_is_needed_for_orders_but_not_for_stops(client: Make, fake: Station) -> None:
    viewer = client(token="open sesame", bounds=Bounds(pause=0.01))
    assert not viewer.welcome["admitted"]
    assert viewer.get("state")["mode"] == "ready"
    for what in ("take", "enable", "record", "end recording", "gains", "download"):
        assert "token" in viewer.order(what)["reason"]
    assert viewer.order("stop")["ok"] and viewer.order("emergency")["ok"]
    assert not viewer.order("login", token="sesame")["ok"]
    assert viewer.order("login", token="open sesame")["ok"]
    assert viewer.order("take")["ok"]
    again = client({"token": "open sesame"})
    assert again.welcome["admitted"]
    stolen = client({"session": viewer.welcome["session"]})
    assert not stolen.welcome["admitted"]  # the session alone does not open


@pytest.mark.parametrize(
    "message",
    [
        "",
        "nonsense",
        "[]",
        "null",
        '{"do": 7, "id": 99}',
        '{"id": {}}',
        b"\x00\xff",
        "{" * 4000,
        '{"do": "beat", "id": [1]}',
        '{"do": "move to", "value": 1e999, "unit": "mm"}',
        '{"do": "view", "columns": "many"}',
        '{"do": "view", "span": 11, "columns": 1e300}',
    ],
)
def test_garbage_is_answered_and_harms_nothing(
    client: Make, fake: Station, message: str | bytes
) -> None:
    viewer = client()
    viewer.socket.send(message)
    viewer.get("reply")
    assert viewer.order("take")["ok"] and fake.requests == []


@pytest.mark.parametrize(
    "hello", ["nonsense", '{"do": "enable"}', b"x", '{"do": "hello", "span": 3}']
)
def test_without_a_hello_there_is_nothing(serve: Serve, fake: Station, hello: Any) -> None:
    stranger = Client(serve().address[1])
    stranger.socket.send(hello)
    with pytest.raises(ConnectionClosed) as closed:
        while True:
            stranger.read()
    assert closed.value.rcvd is not None and closed.value.rcvd.code == 1008
    assert fake.requests == []


def test_a_silent_stranger_is_sent_away(serve: Serve) -> None:
    stranger = Client(serve(bounds=Bounds(patience=0.2)).address[1])
    with pytest.raises(ConnectionClosed):
        stranger.socket.recv(20.0)


def test_an_oversized_message_ends_the_connection(client: Make) -> None:
    viewer, other = client(), client()
    viewer.put(do="enable", more="x" * viewer.welcome["largest"])
    with pytest.raises(ConnectionClosed) as closed:
        while True:
            viewer.read()
    assert closed.value.rcvd is not None and closed.value.rcvd.code == 1009
    assert other.order("take")["ok"]


def test_a_flood_ends_the_connection_and_hinders_nobody(client: Make, fake: Station) -> None:
    viewer, other = client(), client()
    with pytest.raises(ConnectionClosed):
        for _ in range(5000):
            viewer.put(do="enable", id=1)
        while True:
            viewer.read()
    assert other.order("emergency")["ok"]


def test_too_many_orders_do_not_queue(client: Make, fake: Station) -> None:
    viewer = client(bounds=Bounds(waiting=3))
    viewer.order("take")
    fake.open.clear()
    numbers = [viewer.begin("fan", on=True) for _ in range(8)]
    assert "wait" in viewer.reply(numbers[-1])["reason"]
    fake.open.set()
    assert viewer.reply(numbers[0])["ok"]


def test_too_many_viewers_are_turned_away(serve: Serve) -> None:
    port = serve(bounds=Bounds(viewers=2)).address[1]
    first, second = Client(port, {}), Client(port, {})
    third = Client(port)
    third.put(do="hello")
    with pytest.raises(ConnectionClosed):
        third.socket.recv(10.0)
    first.close()
    until(lambda: _admitted(port))
    assert second.order("take")["ok"]


def _admitted(port: int) -> bool:
    try:
        Client(port, {}).close()
    except ConnectionClosed:
        return False
    return True


def _counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    made: list[int] = []
    frame = bins.Plots.frame

    def counted(*arguments: Any) -> bytes:
        data = frame(*arguments)
        made.append(len(data))
        return data

    monkeypatch.setattr(bins.Plots, "frame", counted)
    return made


@pytest.mark.slow
def test_for_a_slow_reader_nothing_piles_up(
    serve: Serve, fake: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No more is made than the connection's buffers take, while nobody reads."""
    made, fake.grow = _counted(monkeypatch), 60_000
    port = serve(bounds=Bounds(patience=600.0, frames=2000.0)).address[1]
    slow = Client(port, {"span": 60.0, "columns": 1200}, max_queue=16)
    before = -1
    deadline = time.monotonic() + 60.0
    while len(made) != before and time.monotonic() < deadline:
        before = len(made)
        time.sleep(1.0)
    assert len(made) == before
    assert sum(made) < 32e6
    quick = Client(port, {})
    assert quick.order("take")["ok"]  # nobody else waits for it
    slow.socket.socket.close()
    quick.close()


def test_a_reader_that_takes_nothing_is_sent_away(
    serve: Serve, fake: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    fake.grow = 60_000
    fake.settings = fake.settings._replace(serve=fake.settings.serve._replace(client_timeout=0.2))
    port = serve(bounds=Bounds(patience=0.5, frames=2000.0)).address[1]
    slow = Client(port, {"span": 60.0, "columns": 1200}, max_queue=16)
    until(lambda: fake.gone == [slow.welcome["client"]])


def test_news_and_faults_are_told_in_words(client: Make, fake: Station) -> None:
    viewer = client()
    fake.fault = Trouble(4, "encoder silent", "The encoder is silent.", "0.1 s", "See its plug.")
    fake.go("fault")
    fault = viewer.get("state", lambda state: state["fault"] is not None)["fault"]
    assert fault["remedy"] == "See its plug."
    items = viewer.get("news")
    assert items[-1]["to_mode"] == "fault" and items[-1]["evidence"] == {"error_mm": 0.25}


def test_gains_are_told_anew_after_a_change(client: Make, fake: Station) -> None:
    viewer = client()
    old = {g["path"]: g["value"] for g in viewer.get("gains")}["sequence.wait"]
    viewer.order("take")
    assert viewer.order("gains", changes=[["sequence.wait", old, 1.25]])["ok"]
    assert fake.requests[-1].changes == (("sequence.wait", 1.25),)
    seen = viewer.get("gains", lambda gains: True)
    assert {g["path"]: g["value"] for g in seen}["sequence.wait"] == 1.25
    refused = viewer.order("gains", changes=[["sequence.wait", old, 3.0]])
    assert not refused["ok"] and "1.25" in refused["reason"]


def test_gains_are_checked_against_those_of_this_moment(client: Make, fake: Station) -> None:
    """There and back at once, and a change that somebody else has just made."""
    viewer = client()
    old = {g["path"]: g["value"] for g in viewer.get("gains")}["sequence.wait"]
    viewer.order("take")
    for _ in range(10):
        assert viewer.order("gains", changes=[["sequence.wait", old, 1.25]])["ok"]
        assert viewer.order("gains", changes=[["sequence.wait", 1.25, old]])["ok"]
    fake.request(viewer.welcome["client"], m.SetGains((("sequence.wait", 9.0),)))
    stale = viewer.order("gains", changes=[["sequence.wait", old, 3.0]])
    assert not stale["ok"] and "9.0" in stale["reason"]


def test_recordings_of_others_are_handed_out_too(
    client: Make, fake: Station, tmp_path: Path
) -> None:
    own, other = tmp_path / "run.h5", tmp_path / "other" / "run.h5"
    other.parent.mkdir()
    for path, content in ((own, b"own"), (other, b"other")):
        path.write_bytes(content)
        fake.record(path)
        fake.end_recording()
    (tmp_path / "secret.h5").write_bytes(b"x")
    viewer = client()
    listed = viewer.get("state")["recordings"]
    assert [(r["name"], r["bytes"]) for r in listed] == [("run.h5", 3), ("run-2.h5", 5)]
    viewer.frames.clear()
    assert viewer.order("download", name="run-2.h5", offset=0)["ok"]
    assert any(frame.endswith(b"other") for frame in viewer.frames)
    assert not viewer.order("download", name="secret.h5", offset=0)["ok"]


def test_a_recording_belongs_to_who_holds_control(client: Make, fake: Station) -> None:
    """Another page neither begins one nor ends one, nor does any while nobody holds control."""
    own, other = client(), client()
    assert "control" in own.order("record")["reason"]
    own.order("take")
    assert "control" in other.order("record")["reason"] and not fake.recording.active
    assert own.order("record")["ok"]
    assert "control" in other.order("end recording")["reason"] and fake.recording.active
    assert own.order("end recording")["ok"] and not fake.recording.active


def test_a_recording_can_be_fetched_piece_by_piece(
    client: Make, fake: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("macromicro.serve.web._downloads.PIECE", 1000)
    viewer = client()
    viewer.order("take")
    name = viewer.order("record")["name"]
    with h5py.File(fake.recording.path, "w") as file:
        file["x"] = range(2000)
    assert not viewer.order("record")["ok"]  # one is under way
    assert not viewer.order("download", name=name, offset=0)["ok"]
    assert viewer.order("end recording")["rows"] == 12
    whole, size = b"", 1.0
    while len(whole) < size:
        viewer.frames.clear()
        assert viewer.order("download", name=name, offset=len(whole))["ok"]
        piece = next(f for f in viewer.frames if struct.unpack_from("<I", f)[0] == 2)
        _kind, number, length, _, size = struct.unpack_from("<4Id", piece)
        assert number == viewer.number and length == len(piece) - 24 > 0
        whole += piece[24:]
    with open(fake.recording.path, "rb") as made:
        assert whole == made.read()
    listed = viewer.get("state", lambda state: bool(state["recordings"]))["recordings"]
    assert listed == [{"name": name, "bytes": len(whole), "active": False}]
    for bad in ("../" + name, "/etc/passwd", name + "\0", ""):
        assert not viewer.order("download", name=bad, offset=0)["ok"]
    for offset in (-1, 0.5, len(whole) + 1, "0"):
        assert not viewer.order("download", name=name, offset=offset)["ok"]


def test_it_starts_and_stops_and_tells_the_station(fake: Station, tmp_path: Any) -> None:
    server = WebServer(fake, port=0, folder=tmp_path)  # type: ignore[arg-type]
    with server:
        viewer = Client(server.address[1], {})
        assert server.url == f"http://127.0.0.1:{server.address[1]}/"
    with pytest.raises(ConnectionClosed):
        while True:
            viewer.read()
    assert fake.gone == [viewer.welcome["client"]]
    server.stop()
    with server:  # again, at another port
        Client(server.address[1], {}).close()


def test_it_says_that_its_station_is_starting(client: Make, fake: Station) -> None:
    fake.started = False
    with pytest.raises(ConnectionClosed, match=r"4001 .* the machine is starting"):
        client()
    fake.started = True
    assert until(lambda: welcomed(client)).order("take")["ok"]


def welcomed(client: Make) -> Client | None:
    try:
        return client({})
    except ConnectionClosed:
        return None


def test_every_message_is_strict_json(client: Make, fake: Station) -> None:
    viewer = client()
    fake.told.append(m.Event(math.nan, "mode", "", "ready", "x", {"a": math.inf, "b": (1, None)}))
    items = viewer.get("news")
    assert items[-1]["time"] is None and items[-1]["evidence"] == {"a": None, "b": [1, None]}
    json.dumps(viewer.seen, allow_nan=False)


def test_who_watches_may_ask_for_the_state_and_for_an_end(client: Make, fake: Station) -> None:
    """Also without the token, as everybody is shown both."""
    holder, watcher = client({"token": "x"}, token="x"), client()
    holder.order("take")
    motion = holder.order("move to", value=1.0, unit="mm")["motion"]
    state = watcher.order("state")["state"]
    assert state["motion"] == motion and state["position_m"] == 0.0421234
    waiting = watcher.begin("wait", motion=motion)
    assert watcher.order("state")["ok"]  # asked later, answered before
    fake.end("stalled")
    end = watcher.reply(waiting)
    assert end["ok"] and end["finished"]["outcome"] == "stalled"
    assert not watcher.order("wait", motion="1")["ok"]


def test_a_program_gets_no_frames_until_it_asks(client: Make, fake: Station) -> None:
    program = client({"program": True, "frames": False})
    for _ in range(5):
        program.order("state")
        program.get("state", lambda state: True)
    assert not program.frames
    program.put(do="view", id=99, span=2.0, columns=100, view=7)
    until(lambda: program.read() is None)
    assert program.frames
