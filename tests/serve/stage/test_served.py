"""A real server of a machine of one stage, and a socket that gives it orders."""

from __future__ import annotations

import contextlib
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.serve.scpi.client import Client
from tests.serve.web.web_parts import Client as Page
from tests.systems import require_posix
from tests.warm import Command

EXAMPLES = Path(__file__).parents[3] / "examples" / "machines"
# A loaded test computer misses periods and answers late: that is not what is looked at here.
PATIENT = """
[serve]
miss_share = 1.0
loop_timeout = "10 s"
parent_timeout = "10 s"
reply_timeout = "60 s"
client_timeout = "60 s"
"""
SLOW = "SPE:MACR 10 MM/S"  # such a move is under way for seconds, however late the next order is


class Served(Client):
    """A connection that waits longer; the printed address of the page, and all before it."""

    page = said = ""

    def ask(self, text: str) -> str:
        self.socket.settimeout(300.0)
        return super().ask(text)

    def mm(self) -> float:
        return float(self.ask("POS?").split(",")[0])

    def fine(self) -> None:
        assert self.ask("SYST:ERR:ALL?") == '0,"No error"'


@contextlib.contextmanager
def served(folder: Path, text: str, *options: str) -> Iterator[Served]:
    require_posix()
    file = folder / "own.toml"
    file.write_text(text + PATIENT, encoding="utf-8")
    command = [sys.executable, "-m", "macromicro", "serve", "--config", str(file)]
    command += ["--scpi", "0", "--web", "0", "--state", str(folder / "position.json"), *options]
    with Command(command, stdout=subprocess.PIPE, text=True, cwd=folder) as process:
        try:
            assert process.stdout is not None
            said = ""
            for line in process.stdout:
                said += line
                if line.startswith("page:"):
                    break
            port = re.search(r"SCPI: .* port (\d+)", said)
            page = re.search(r"page: (\S+)", said)
            assert port and page, said
            client = Served(("127.0.0.1", int(port[1])))
            client.page, client.said = page[1], said
            yield client
            client.close()
        finally:
            process.send_signal(signal.SIGTERM)
            assert process.wait(120) == 128 + signal.SIGTERM


def example(name: str) -> str:
    return (EXAMPLES / f"{name}.toml").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def screw(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(tmp_path_factory.mktemp("screw"), example("screw")) as client:
        yield client


@pytest.fixture(scope="module")
def piezo(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(tmp_path_factory.mktemp("piezo"), example("piezo-100um")) as client:
        yield client


def test_an_axis_homes_and_moves(screw: Served) -> None:
    assert re.fullmatch(r"macromicro,axis own,0,\S+", screw.ask("*IDN?"))
    assert screw.ask("SYST:LOCK:REQ?") == "1"
    screw.send("ENAB")
    screw.send("MOVE:ABS 50 MM")
    assert "home first" in screw.ask("SYST:ERR?")
    assert screw.ask("HOME;*OPC?") == "1"
    assert screw.ask("POS:TRUS?") == '1,"homed"'
    low, high = (float(x) for x in screw.ask("LIM:ABS?").split(","))
    assert low < 0.0 and high == pytest.approx(81.28, abs=0.01)
    assert float(screw.ask("MOVE? MAX")) == pytest.approx(high, abs=1e-3)
    tolerance = 6.667e-3  # mm: four counts
    for target in (50.0, 10.0, 80.0):
        assert screw.ask(f"MOVE:ABS {target} MM;*OPC?") == "1"
        assert screw.mm() == pytest.approx(target, abs=tolerance)
    assert screw.ask("MOVE:REL -500 UM;*OPC?") == "1"
    assert screw.mm() == pytest.approx(79.5, abs=tolerance)
    assert screw.ask("MOVE:ABS MIN;*OPC?") == "1"
    assert screw.mm() == pytest.approx(low, abs=tolerance)
    screw.fine()
    # The weight of 4 kg is held while it rests.
    assert screw.ask("MODE?") == '"ready"' and abs(float(screw.ask("STAG1:OUTP?"))) > 0.5
    screw.send("MOVE:ABS 82 MM")
    assert "81.28" in screw.ask("SYST:ERR?")
    screw.send("MOVE:MICR 1 MM")
    assert "no micro-stage" in screw.ask("SYST:ERR?")
    fast = screw.ask("SPE:MACR?")
    screw.send(SLOW)
    screw.send("MOVE:ABS 80 MM")
    while screw.mm() < 5.0:
        time.sleep(0.02)
    screw.send("STOP")
    assert screw.ask("*OPC?") == "1"
    assert 5.0 < screw.mm() < 79.0
    rest = screw.mm()
    assert screw.ask("MODE?") == '"stopped"' and screw.mm() == pytest.approx(rest, abs=0.01)
    screw.send(f"SPE:MACR {fast} MM/S")


@pytest.mark.slow
def test_an_axis_that_turns_is_led_in_degrees(tmp_path: Path) -> None:
    with served(tmp_path, 'machine = "rotary"\n[load]\ninertia = "0.012 kg*m^2"\n') as client:
        assert client.ask("SYST:LOCK:REQ?;:ENAB;:HOME;*OPC?") == "1;1"
        for order, target in (("90 DEG", 90.0), ("0.5 TURN", 180.0), ("1 RAD", 57.2958)):
            assert client.ask(f"MOVE:ABS {order};*OPC?") == "1"
            assert client.mm() == pytest.approx(target, abs=0.036)
        client.fine()
        assert client.ask("LIM:ABS?") == "0,269.4"
        text = '[[moves]]\nmacro = ["30 deg", "0.25 turn"]\nhold = "0.1 s"\n'
        client.send(f"PROG:LOAD #{len(str(len(text)))}{len(text)}{text}")
        assert client.ask("PROG:RUN;*OPC?") == "1"
        client.fine()
        assert client.mm() == pytest.approx(90.0, abs=0.036)
        client.send("MOVE:ABS 10 MM")
        assert "accepted: DEG" in client.ask("SYST:ERR?")
        page = Page(int(client.page.rstrip("/").rpartition(":")[2]), {})
        limits = page.welcome["limits"]
        assert limits["unit"] == "deg" and limits["base"] == "rad"
        page.close()
        client.send("ABOR")
        assert client.ask("ENAB?") == "0" and float(client.ask("STAG1:OUTP?")) == 0.0


PLACES = """title = "three places"
[[moves]]
macro = ["10 mm", "60 mm", "20 mm"]
hold = "0.1 s"
"""
PROFILE = """[[profiles]]
macro = ["40 mm", "5 mm"]
velocity = "100 mm/s"
acceleration = "1 m/s^2"
hold = "0.1 s"
"""


MIXED = PLACES + PROFILE.replace("[40 mm", "[50 mm")


def block(text: str) -> str:
    return f"#{len(str(len(text)))}{len(text)}{text}"


@pytest.mark.slow
def test_programmes_run_live_and_gains_change(screw: Served) -> None:
    assert screw.ask("SYST:LOCK:REQ?;:ENAB;:HOME;*OPC?") == "1;1"
    screw.ask("SYST:ERR:ALL?")  # it may be enabled already
    assert screw.ask("PROG:CAT?") == '"usual"'
    tolerance = 6.667e-3
    for loaded, last in (
        ('"usual"', 0.0),
        (block(PLACES), 20.0),
        (block(PROFILE), 5.0),
        (block(MIXED), 5.0),
    ):
        screw.send(f"PROG:LOAD {loaded}")
        assert screw.ask("PROG:RUN;*OPC?") == "1"
        screw.fine()
        assert screw.mm() == pytest.approx(last, abs=tolerance)
    for text, words in (
        (PLACES.replace("60 mm", "82 mm"), "82 mm"),
        ('[[moves]]\nmicro = "1 mm"\nhold = "1 s"', "Accepted: one of to, hold"),
        (PROFILE.replace("100 mm/s", "9 m/s").replace("1 m/s", "90 m/s"), "guard.speed"),
    ):
        screw.send(f"PROG:LOAD {block(text)}")
        assert words in screw.ask("SYST:ERR?")
    names = screw.ask("GAIN:CAT?")
    assert '"position"' in names and '"notch.depth"' in names
    was = float(screw.ask('GAIN? "position"'))
    screw.send(f'GAIN "position",{0.5 * was}')
    screw.fine()
    assert float(screw.ask('GAIN? "position"')) == 0.5 * was
    assert screw.ask("MOVE:ABS 50 MM;*OPC?") == "1"
    assert screw.mm() == pytest.approx(50.0, abs=tolerance)
    screw.send('GAIN "velocity",1E6')
    assert "does not fit the others" in screw.ask("SYST:ERR?")
    screw.send('GAIN "position",-1')
    assert "accepted" in screw.ask("SYST:ERR?")
    fast = screw.ask("SPE:MACR?")
    screw.send(f"{SLOW};:MOVE:ABS 80 MM;:GAIN:DEF")
    assert "a motion is under way" in screw.ask("SYST:ERR?")
    screw.send("STOP")
    assert screw.ask("*OPC?") == "1" and "ended as stopped" in screw.ask("SYST:ERR:ALL?")
    screw.send(f"SPE:MACR {fast} MM/S;:GAIN:DEF")
    screw.fine()
    assert float(screw.ask('GAIN? "position"')) == was
    assert screw.ask("MOVE:ABS 30 MM;*OPC?") == "1"
    assert screw.mm() == pytest.approx(30.0, abs=tolerance)


def test_a_piezo_stage_knows_its_place(piezo: Served) -> None:
    assert piezo.ask("*IDN?").startswith("macromicro,piezo own,0,")
    assert piezo.ask("SYST:LOCK:REQ?;:POS:TRUS?").startswith("1;1,")
    piezo.send("ENAB")
    for target in (50.0, 12.345, 99.0):
        assert piezo.ask(f"MOVE:ABS {target} UM;*OPC?") == "1"
        assert piezo.mm() * 1e3 == pytest.approx(target, abs=0.02)
    assert piezo.ask("LIM:ABS?") == "0,0.1"
    piezo.fine()
    piezo.send("HOME")
    assert "absolute" in piezo.ask("SYST:ERR?")
    # Nor does it lose its place in an emergency stop, or where it is off.
    piezo.send("ABOR")
    assert piezo.ask("POS:TRUS?").startswith("1,") and piezo.ask("ENAB?") == "0"
    # Its hysteresis leaves it beside 0; enabled, it stays there until it is moved.
    piezo.send("ENAB")
    assert piezo.ask("MOVE:ABS 20 UM;*OPC?") == "1"
    assert piezo.mm() * 1e3 == pytest.approx(20.0, abs=0.02)
    assert piezo.ask("FAUL?").startswith("0,")
    assert piezo.ask("DIS;:SYST:LOCK:REL;:ENAB?") == "0"


@pytest.mark.slow
def test_the_guard_of_the_machine_switches_off_and_says_why(tmp_path: Path) -> None:
    text = example("piezo-100um") + '\n[guard]\nerror = "0.5 um"\n'
    with served(tmp_path, text) as client:
        client.ask("SYST:LOCK:REQ?")
        client.send("ENAB")
        client.ask("MOVE:ABS 90 UM;*OPC?")
        code, words = client.ask("FAUL?").split(",", 1)
        assert code == "206" and words.startswith('"following error"') and "0.0005 mm" in words
        assert client.ask("MODE?") == '"fault"' and float(client.ask("STAG1:OUTP?")) == 0.0
        client.send("FAUL:CLE")
        assert client.ask("FAUL?").startswith("0,") and client.ask("MODE?") == '"disabled"'


def test_the_page_greets_with_the_machine_and_its_travel(piezo: Served) -> None:
    page = Page(int(piezo.page.rstrip("/").rpartition(":")[2]), {})
    about = page.welcome
    assert about["model"] == "piezo own" and about["stages"] == ["macro"]
    limits = about["limits"]
    assert limits["whole_low"] == 0.0 and limits["whole_high"] == pytest.approx(1e-4)
    assert limits["pitch"] == pytest.approx(3.2e-9)
    state = page.get("state", lambda state: state["mode"] == "disabled")
    assert "home" not in state["possible"] and "enable" in state["possible"]
    # Its soft limits are those of its one place, not of the thesis' two stages.
    assert state["limits"] == {"whole_low": 0.0, "whole_high": limits["whole_high"]}
    assert page.order("take")["ok"]
    assert page.order("limits", values={"whole_low": 0.0, "whole_high": 5e-5})["ok"]
    assert piezo.ask("LIM:ABS?;:LIM:MACR?") == "0,0.05;0,15625"
    refused = page.order("limits", values={**state["limits"], "micro_high": 3.5})
    assert refused["remedy"].startswith("give all of whole_low, whole_high")
    page.close()
