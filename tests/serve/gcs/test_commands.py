"""The commands and their errors, by a raw socket, before a machine in the test's hand."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

import pytest
from fake_station import FakeStation
from tests.serve.scpi.client import Client
from tests.waiting import until

from macromicro.control.live import messages as m

Connect = Callable[[], Client]


def error(client: Client) -> int:
    return int(client.ask("ERR?"))


def table(client: Client, command: str) -> list[str]:
    """An answer of several lines, each but the last one with a space before its end."""
    found = [client.ask(command)]
    while found[-1].endswith(" "):
        found.append(client.line())
    return [line.removesuffix(" ") for line in found]


def test_it_says_what_it_is_and_what_it_knows(connect: Connect) -> None:
    client = connect()
    assert re.fullmatch(r"macromicro, two-stage positioner, 0, \S+", client.ask("*IDN?"))
    assert client.ask("CSV?") == "2.0" and client.ask("SAI?") == client.ask("SAI? ALL") == "1"
    listed = [line.split()[0] for line in table(client, "HLP?")[1:-1]]
    for name in ("MOV", "MVR", "ONT?", "#5", "#7", "#24", "SVO", "FRF", "STP", "HLT", "DRR?"):
        assert name in listed
    assert error(client) == 0


def test_places_are_told_in_mm(connect: Connect, fake: FakeStation) -> None:
    client = connect()
    assert client.ask("POS?") == client.ask("POS? 1") == "1=42.1234000"
    low, high = client.ask("TMN?"), client.ask("TMX? 1")
    limits = fake.snapshot().limits
    assert float(low.partition("=")[2]) >= limits.whole_low * 1e3 - 1e-6
    assert 150.0 < float(high.partition("=")[2]) <= limits.whole_high * 1e3 + 1e-6
    assert client.ask("FRF?") == "1=1"
    fake.trusted = False
    assert client.ask("FRF?") == "1=0"


def test_a_move_is_on_target_only_once_it_is_done(connect: Connect, fake: FakeStation) -> None:
    client = connect()
    client.send("MOV 1 50.5")
    assert client.ask("ONT?") == "1=0" and client.ask("\x05") == "1"
    assert fake.requests[-1] == m.MoveTo(0.0505, fake.holder, True)
    fake.end("done")
    assert client.ask("ONT?") == "1=1" and client.ask("\x05") == "0"
    assert error(client) == 0


@pytest.mark.parametrize(
    ("outcome", "number"),
    [("stopped", 10), ("lost", 10), ("limit", 7), ("stalled", 1024), ("fault", 1024)],
)
def test_a_move_that_fails_is_an_error_and_never_on_target(
    connect: Connect, fake: FakeStation, outcome: str, number: int
) -> None:
    client = connect()
    client.send("MOV 1 50")
    assert client.ask("ONT?") == "1=0"
    fake.end(outcome)
    assert client.ask("ONT?") == "1=0" and error(client) == number
    assert client.ask("ONT?") == "1=0" and error(client) == 0


@pytest.mark.parametrize("stop", ["STP\n", "HLT 1\n", "HLT\n", "\x18"])
def test_stops_overtake_and_set_error_10_once(
    connect: Connect, fake: FakeStation, stop: str
) -> None:
    client = connect()
    client.send("MOV 1 50")
    until(lambda: bool(fake.motion))
    client.socket.sendall(stop.encode())
    assert error(client) == 10 and fake.ended[1].outcome == "stopped"
    assert client.ask("ONT?") == "1=1" and error(client) == 0  # it is held where it is


def test_another_client_s_stop_is_an_error_here(connect: Connect, fake: FakeStation) -> None:
    client, other = connect(), connect()
    client.send("MOV 1 50")
    until(lambda: bool(fake.motion))
    other.send("STP")
    assert error(other) == 10
    assert error(client) == 10 and client.ask("ONT?") == "1=0"


@pytest.mark.parametrize(
    ("line", "number"),
    [
        ("MOV 1 9000", 7),
        ("MOV 2 1", 15),
        ("MOV 1", 24),
        ("MOV", 24),
        ("MOV 1 x", 25),
        ("MOV 1 nan", 25),
        ("SVO 1 2", 17),
        ("VEL 1 1", 34),
        ("RTR 0", 17),
        ("DRR? 1", 24),
        ("DRR? 1 5 99", 57),
        ("POS? 7", 15),
        ("XYZ 1", 2),
        ("CCL 5", 17),
    ],
)
def test_what_cannot_be_is_an_error(
    connect: Connect, fake: FakeStation, line: str, number: int
) -> None:
    client = connect()
    client.send(line)
    assert error(client) == number and error(client) == 0
    assert not fake.requests


def test_a_move_needs_the_servo_and_control(connect: Connect, fake: FakeStation) -> None:
    client, other = connect(), connect()
    fake.mode = "disabled"
    assert client.ask("SVO?") == "1=0"
    client.send("MOV 1 50")
    assert error(client) == 5 and fake.motion == 0
    client.send("SVO 1 1")
    assert client.ask("SVO?") == "1=1" and error(client) == 0
    other.send("MOV 1 50")
    assert error(other) == 51  # the first one has control
    client.send("SVO 1 0")
    assert client.ask("SVO?") == "1=0" and fake.requests[-1] == m.Disable(fake.holder)


def test_relative_moves_go_from_the_last_target(connect: Connect, fake: FakeStation) -> None:
    """Which the control loop knows."""
    client = connect()
    client.send("MVR 1 -1.5")
    assert client.ask("ONT?") == "1=0"
    assert fake.requests[-1] == m.MoveBy(pytest.approx(-0.0015), fake.holder, True)
    fake.target = 0.0411234
    assert client.ask("MOV?") == "1=41.1234000"
    fake.target = math.nan
    assert client.ask("MOV?") == "1=42.1234000"  # where it is


def test_referencing_is_busy_until_its_end(connect: Connect, fake: FakeStation) -> None:
    client = connect()
    client.socket.sendall(b"\x07")
    assert client.file.read(2) == b"\xb1\n"
    client.send("FRF")
    assert error(client) == 0 and fake.requests[-1] == m.Home(fake.holder)
    fake.go("homing")
    client.socket.sendall(b"\x07")
    assert client.file.read(2) == b"\xb0\n"
    assert client.ask("FRF?") == "1=0"
    fake.end("stalled")
    assert error(client) == 45


@pytest.mark.parametrize("connect", ["sesame"], indirect=True)
def test_a_token_is_the_password_of_the_command_level(connect: Connect, fake: FakeStation) -> None:
    client = connect()
    client.send("MOV 1 50")
    assert error(client) == 56
    client.send("CCL 1 guess")
    assert error(client) == 56
    client.send("STP")
    assert error(client) == 10  # which needs none
    client.send("CCL 1 sesame\nMOV 1 50")
    assert error(client) == 0 and fake.motion == 1


def test_a_client_that_goes_is_lost(connect: Connect, fake: FakeStation) -> None:
    client = connect()
    client.send("MOV 1 50")
    until(lambda: bool(fake.motion))
    client.close()
    until(lambda: 1 in fake.ended)
    assert fake.ended[1].outcome == "lost" and fake.holder == ""


def test_a_line_without_an_end_ends_the_connection(connect: Connect) -> None:
    client = connect()
    client.ask("ERR?")
    client.socket.sendall(b"x" * 5000)
    assert client.line() == ""
