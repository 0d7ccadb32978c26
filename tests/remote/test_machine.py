"""The synchronous client before a server whose machine is under the test's hand."""

from __future__ import annotations

import inspect
import math
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.systems import posix
from tests.waiting import until
from web_parts import Station

from macromicro.control.live import messages as m
from macromicro.errors import InputError
from macromicro.remote import _link
from macromicro.remote.asynchronous import AsyncMachine
from macromicro.remote.failures import ConnectionLost, MotionFailed, RequestRefused
from macromicro.remote.machine import Machine, connect
from macromicro.serve.requests import REQUESTS
from macromicro.serve.snapshot import Trouble
from macromicro.serve.web import WebServer

Make = Callable[..., Machine]


def last(fake: Station) -> Any:
    return fake.requests[-1]._replace(client="")


def test_every_request_of_the_table_is_a_verb() -> None:
    for kind in REQUESTS:
        for client in (Machine, AsyncMachine):
            verb = inspect.signature(getattr(client, kind.name.replace(" ", "_")))
            taken = [name for name in verb.parameters if name not in ("self", "wait", "replace")]
            assert len(taken) >= len(kind.fields), kind.name
            assert ("replace" in verb.parameters) == kind.replaces, kind.name


@pytest.mark.parametrize(
    ("verb", "given", "wanted"),
    [
        ("move_to", ("12.5 mm",), m.MoveTo(0.0125)),
        ("move_to", (0.01,), m.MoveTo(0.01)),
        ("move_by", ("-3 um",), m.MoveBy(-3e-6)),
        ("move_macro", (120,), m.MoveMacro(120.0)),
        ("move_micro", ("0.1 mm",), m.MoveMicro(1e-4)),
        ("move_macro_by", (3,), m.MoveMacroBy(3)),
        ("move_micro_by", ("0.1 mm",), m.MoveMicroBy(1e-4)),
        ("move_point", ("1 mm", 0.002), m.MovePoint({"x": 0.001, "y": 0.002})),
        ("move_axis", ("y", "4 mm"), m.MoveAxis("y", 0.004)),
        ("move_point_by", ("1 mm", -0.002), m.MovePointBy({"x": 0.001, "y": -0.002})),
        ("move_axis_by", ("y", "-4 mm"), m.MoveAxisBy("y", -0.004)),
        ("home", (), m.Home()),
        ("jog", ("macro", "5 mm/s"), m.Jog("macro", 0.005, 0.4)),  # as long as the client lives
        ("jog", ("micro", -0.001), m.Jog("micro", -0.001, 0.4)),
    ],
)
def test_what_moves_goes_out_in_base_units(
    client: Make, fake: Station, verb: str, given: tuple[Any, ...], wanted: Any
) -> None:
    stage = client()
    rest = {} if verb == "jog" else {"wait": False}
    getattr(stage, verb)(*given, **rest)
    assert last(fake) == wanted and fake.holder != ""


def test_what_moves_nothing_goes_out_too(client: Make, fake: Station) -> None:
    stage = client()
    fake.mode = "disabled"
    for act, wanted in (
        (stage.enable, m.Enable()),
        (stage.zero, m.Zero()),
        (lambda: stage.fan(True), m.Fan(True)),
        (stage.clear, m.ClearFault()),
        (lambda: stage.limits(stage.state.limits), m.SetLimits(fake.s.limits)),
        (lambda: stage.limits(None), m.SetLimits(None)),
        (lambda: stage.set_speed("macro", "5 mm/s"), m.SetSpeed("macro", 0.005)),
        (lambda: stage.gains({"sequence.wait": 1.5}), m.SetGains((("sequence.wait", 1.5),))),
        (stage.stop, m.Stop()),
        (stage.disable, m.Disable()),
    ):
        act()
        assert last(fake) == wanted
    stage.emergency()
    assert fake.emergencies == 1


def test_a_refusal_says_why_and_what_helps(client: Make, fake: Station) -> None:
    stage = client()
    fake.mode = "disabled"
    with pytest.raises(RequestRefused, match="disabled; enable it first") as refusal:
        stage.move_to(0.01)
    assert refusal.value.reason == "the positioner is disabled" and not refusal.value.beyond
    assert refusal.value.remedy == "enable it first"
    with pytest.raises(RequestRefused) as refusal:
        stage.move_to(9.0)
    assert refusal.value.beyond
    with pytest.raises(RequestRefused, match=r"fake holds|holds control"):
        client()  # the first one has it
    with pytest.raises(InputError, match=r"gains: 'none'"):
        stage.gains({"none": 1.0})


@pytest.mark.parametrize(
    ("verb", "given", "words"),
    [
        ("move_to", ("12 V",), r"move to, position: '12 V'; accepted"),
        ("move_to", (math.nan,), "a number in m"),
        ("move_macro", ("3 mm",), "a whole number"),
        ("move_axis", ("z", 0.0), "accepted: x, y"),
        ("jog", ("macro", "3 mm"), "mm/s|m/s"),
        ("programme", ("nothing.toml",), "no such file"),
    ],
)
def test_what_cannot_be_does_not_go_out(
    client: Make, fake: Station, verb: str, given: tuple[Any, ...], words: str
) -> None:
    stage = client()
    with pytest.raises(InputError, match=words):
        getattr(stage, verb)(*given)
    assert not fake.requests


def begin(stage: Machine, fake: Station) -> tuple[threading.Thread, list[Any]]:
    """A move that is waited for in a thread, under way; what became of it."""
    found: list[Any] = []

    def move() -> None:
        try:
            found.append(stage.move_to(0.05))
        except Exception as error:
            found.append(error)

    thread = threading.Thread(target=move)
    thread.start()
    until(lambda: fake.motion)
    return thread, found


def test_a_move_returns_at_its_end_and_not_before(client: Make, fake: Station) -> None:
    stage = client()
    thread, found = begin(stage, fake)
    assert stage.state.motion == 1 and not found
    fake.end("done")
    thread.join(10.0)
    assert found[0].wait()["position"] == 0.01 and found[0].number == 1
    assert stage.move_to(0.02, wait=False).words == "move to 20 mm"


@pytest.mark.parametrize(
    ("outcome", "remedy"), [("stopped", "ask again"), ("stalled", "what blocks it")]
)
def test_a_move_that_is_not_done_is_a_failure(
    client: Make, fake: Station, outcome: str, remedy: str
) -> None:
    stage = client()
    thread, found = begin(stage, fake)
    fake.end(outcome)
    thread.join(10.0)
    failure = found[0]
    assert isinstance(failure, MotionFailed) and failure.outcome == outcome
    assert str(failure).startswith(f"move to 50 mm ended as {outcome} at 10 mm; ")
    assert remedy in failure.remedy and failure.evidence == {"error_mm": 1}


def test_a_fault_names_itself_and_its_remedy(client: Make, fake: Station) -> None:
    stage = client()
    thread, found = begin(stage, fake)
    fake.fault = Trouble(3, "stuck", "carriage stuck", "0 counts", "free it")
    fake.end("fault")
    thread.join(10.0)
    assert found[0].remedy == "carriage stuck; free it"
    assert stage.state.fault == fake.fault


def test_a_wait_may_end_before_the_motion(client: Make, fake: Station) -> None:
    stage = client()
    motion = stage.move_to(0.05, wait=False)
    with pytest.raises(TimeoutError):
        motion.wait(0.05)
    assert fake.motion == motion.number
    fake.end("done")
    assert motion.wait()["outcome"] == "done"


def test_the_context_stops_what_it_moves_and_nothing_else(client: Make, fake: Station) -> None:
    with client() as stage:
        stage.move_to(0.05, wait=False)
    assert fake.ended[1].outcome == "stopped" and fake.holder == ""
    with pytest.raises(ConnectionLost, match="closed; connect again"):
        stage.enable()
    fake.acquire("another one")
    fake.request("another one", m.MoveTo(0.01))
    with client(control=False) as watcher:
        assert watcher.state.motion == 2
        with pytest.raises(RequestRefused, match="does not hold control"):
            watcher.move_to(0.01)
    assert fake.motion == 2  # it goes on
    with client(control=False) as watcher:
        watcher.stop()
    assert fake.ended[2].outcome == "stopped"


def test_a_jog_ends_with_the_context(client: Make, fake: Station) -> None:
    with client() as stage:
        stage.jog("macro", 0.01)
        fake.end("stopped")
    assert isinstance(fake.requests[-1], m.Stop)
    with client() as stage:
        stage.jog("macro", 0.01)
        fake.end("stopped")
        stage.stop()
        before = len(fake.requests)
    assert len(fake.requests) == before  # nothing was left to stop


def test_a_client_that_is_killed_is_lost_at_once(server: WebServer, fake: Station) -> None:
    """However long the server lets a page come back."""
    host, port = server.address
    script = (
        f"import macromicro, sys\nstage = macromicro.connect({host!r}, {port}, token='sesame')\n"
        "stage.move_to(0.05, wait=False)\nprint('moving', flush=True)\n"
        "sys.stdin.read()\n"
    )
    command = [sys.executable, "-c", script]
    with subprocess.Popen(command, stdout=-1, stdin=-1, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "moving\n"
        assert fake.motion == 1
        process.kill()
    until(lambda: fake.ended)
    assert fake.ended[1].outcome == "lost" and fake.holder == ""


@posix
def test_an_interrupted_wait_stops_the_machine(client: Make, fake: Station) -> None:
    stage = client()

    def interrupt() -> None:
        until(lambda: fake.motion)
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)

    # A shell's background job begins with Ctrl-C ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    threading.Thread(target=interrupt).start()
    try:
        with pytest.raises(KeyboardInterrupt):
            stage.move_to(0.05)
    finally:
        signal.signal(signal.SIGINT, before)
    until(lambda: fake.ended)
    assert fake.ended[1].outcome == "stopped"


def test_the_token_is_asked_for_and_the_environment_has_it(
    server: WebServer, fake: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(RequestRefused, match="not the token; token="):
        connect(*server.address, token="guess")
    with pytest.raises(RequestRefused, match="not given the token; log in"):
        connect(*server.address)
    with connect(*server.address, control=False) as watcher:
        watcher.stop()  # which needs none
    monkeypatch.setenv("MACROMICRO_TOKEN", "sesame")
    with connect(*server.address):
        assert fake.holder


def test_nobody_there_is_said_with_a_remedy(server: WebServer) -> None:
    host, port = server.address
    server.stop()
    with pytest.raises(ConnectionLost, match=rf"ws://{host}:{port}/live.*; start the server"):
        connect(host, port)


def test_a_machine_that_is_starting_is_waited_for(
    request: pytest.FixtureRequest, fake: Station
) -> None:
    fake.started = False
    client = request.getfixturevalue("client")
    threading.Timer(0.5, setattr, (fake, "started", True)).start()
    assert client(timeout=5.0).about["client"]


def test_a_machine_that_never_starts_is_not_waited_for_for_ever(
    request: pytest.FixtureRequest, fake: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_link, "START_S", 0.3)
    fake.started = False
    client = request.getfixturevalue("client")
    with pytest.raises(ConnectionLost, match="the machine is starting"):
        client(timeout=5.0)


def test_a_server_that_ends_fails_what_waits(
    client: Make, server: WebServer, fake: Station
) -> None:
    stage = client()
    thread, found = begin(stage, fake)
    server.stop()
    thread.join(10.0)
    assert isinstance(found[0], ConnectionLost) and "connect again" in found[0].remedy
    with pytest.raises(ConnectionLost):
        stage.enable()


def test_a_loop_that_ends_fails_what_waits(client: Make, fake: Station) -> None:
    stage = client()
    thread, found = begin(stage, fake)
    fake.running = False
    thread.join(10.0)
    assert isinstance(found[0], RequestRefused) and "loop process has ended" in found[0].reason


@pytest.mark.slow
def test_a_motion_that_never_was_is_not_waited_for(client: Make, fake: Station) -> None:
    stage = client()
    with pytest.raises(RequestRefused, match="no motion 77"):
        stage.run(stage._inner.link.order("wait", motion=77))


def test_the_state_is_that_of_now(client: Make, fake: Station) -> None:
    stage = client()
    now = stage.state
    assert now.mode == fake.mode and now.running and now.trusted == fake.trusted
    assert (now.position, now.uncertainty) == (0.0421234, 35.7e-6)
    assert now.holder == fake.holder and now.fault is None and now.temperature == 61.5
    assert "move to" in now.possible or not now.trusted
    fake.running = False
    assert stage.state.running is False and stage.position == 0.0421234


def test_traces_grow_without_a_gap(client: Make, fake: Station) -> None:
    stage = client()
    for k, shown in enumerate(stage.traces(2.0)):
        assert shown.low.shape == shown.high.shape == (len(shown.names), len(shown.time))
        np.testing.assert_allclose(np.diff(shown.time), 2e-3)
        assert np.all(shown.low <= shown.high)
        if k == 5:
            break
    assert shown.names[-1] == "position" and len(shown.time) == 1000
    assert shown.time[-1] == pytest.approx(fake.written * 1e-3, abs=0.5)
    stage.fan(True)  # the connection goes on


def test_a_programme_is_a_name_or_a_file(client: Make, fake: Station, tmp_path: Path) -> None:
    stage = client()
    name = stage.about["programmes"][0]
    stage.programme(name, wait=False)
    assert isinstance(last(fake), m.Programme)
    fake.end("done")
    rows = "\n".join(f"{k * 0.5},{100 + k % 7 * (k < 2999)}" for k in range(3001))  # many pieces
    file = tmp_path / "own.csv"
    file.write_text(f"t_s,macro_counts\n{rows}\n")
    stage.programme(file, wait=False)
    assert len(last(fake).plan.target) == 3000


def test_a_recording_is_fetched(client: Make, fake: Station, tmp_path: Path) -> None:
    stage = client()
    with pytest.raises(RequestRefused, match="no recording; record"):
        stage.save_recording(tmp_path / "none.h5")
    stage.record()
    data = bytes(range(256)) * 2000  # more than one piece
    Path(fake.recording.path).write_bytes(data)
    assert stage.save_recording(tmp_path / "got.h5") == 12
    assert (tmp_path / "got.h5").read_bytes() == data
