"""A real server of a machine of one stage, and a socket that gives it orders."""

from __future__ import annotations

import contextlib
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.serve.scpi.client import Client
from tests.serve.web.web_parts import Client as Page

EXAMPLES = Path(__file__).parents[3] / "examples" / "machines"
# A loaded test computer misses periods: that is not what is looked at here.
PATIENT = '\n[serve]\nmiss_share = 1.0\nloop_timeout = "5 s"\nparent_timeout = "5 s"\n'


class Served(Client):
    """A connection that waits longer; the printed address of the page, and all before it."""

    page = said = ""

    def ask(self, text: str) -> str:
        self.socket.settimeout(60.0)
        return super().ask(text)

    def mm(self) -> float:
        return float(self.ask("POS?").split(",")[0])

    def fine(self) -> None:
        assert self.ask("SYST:ERR:ALL?") == '0,"No error"'


@contextlib.contextmanager
def served(folder: Path, text: str, *options: str) -> Iterator[Served]:
    file = folder / "own.toml"
    file.write_text(text + PATIENT, encoding="utf-8")
    command = [sys.executable, "-m", "macromicro", "serve", "--config", str(file)]
    command += ["--scpi", "0", "--web", "0", "--state", str(folder / "position.json"), *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=folder) as process:
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
            assert process.wait(30) == 128 + signal.SIGTERM


def example(name: str) -> str:
    return (EXAMPLES / f"{name}.toml").read_text(encoding="utf-8")


def test_an_axis_homes_and_moves(tmp_path: Path) -> None:
    with served(tmp_path, example("screw")) as client:
        assert re.fullmatch(r"macromicro,axis own,0,\S+", client.ask("*IDN?"))
        assert client.ask("SYST:LOCK:REQ?") == "1"
        client.send("ENAB")
        client.send("MOVE:ABS 50 MM")
        assert "home first" in client.ask("SYST:ERR?")
        assert client.ask("HOME;*OPC?") == "1"
        assert client.ask("POS:TRUS?") == '1,"homed"'
        low, high = (float(x) for x in client.ask("LIM:ABS?").split(","))
        assert low < 0.0 and high == pytest.approx(81.28, abs=0.01)
        assert float(client.ask("MOVE? MAX")) == pytest.approx(high, abs=1e-3)
        tolerance = 6.667e-3  # mm: four counts
        for target in (50.0, 10.0, 80.0):
            assert client.ask(f"MOVE:ABS {target} MM;*OPC?") == "1"
            assert client.mm() == pytest.approx(target, abs=tolerance)
        assert client.ask("MOVE:REL -500 UM;*OPC?") == "1"
        assert client.mm() == pytest.approx(79.5, abs=tolerance)
        assert client.ask("MOVE:ABS MIN;*OPC?") == "1"
        assert client.mm() == pytest.approx(low, abs=tolerance)
        client.fine()
        # The weight of 4 kg is held while it rests.
        assert client.ask("MODE?") == '"ready"' and abs(float(client.ask("STAG1:OUTP?"))) > 0.5
        client.send("MOVE:ABS 82 MM")
        assert "81.28" in client.ask("SYST:ERR?")
        client.send("MOVE:MICR 1 MM")
        assert "no micro-stage" in client.ask("SYST:ERR?")
        client.send("MOVE:ABS 80 MM")
        while client.mm() < 5.0:
            pass
        client.send("STOP")
        assert client.ask("*OPC?") == "1"
        assert 5.0 < client.mm() < 60.0
        rest = client.mm()
        assert client.ask("MODE?") == '"stopped"' and client.mm() == pytest.approx(rest, abs=0.01)
        client.send("ABOR")
        assert client.ask("ENAB?") == "0" and float(client.ask("STAG1:OUTP?")) == 0.0


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


def test_programmes_run_live_and_gains_change(tmp_path: Path) -> None:
    with served(tmp_path, example("screw")) as client:
        assert client.ask("SYST:LOCK:REQ?;:ENAB;:HOME;*OPC?") == "1;1"
        assert client.ask("PROG:CAT?") == '"usual"'
        tolerance = 6.667e-3
        for loaded, last in (
            ('"usual"', 0.0),
            (block(PLACES), 20.0),
            (block(PROFILE), 5.0),
            (block(MIXED), 5.0),
        ):
            client.send(f"PROG:LOAD {loaded}")
            assert client.ask("PROG:RUN;*OPC?") == "1"
            client.fine()
            assert client.mm() == pytest.approx(last, abs=tolerance)
        for text, words in (
            (PLACES.replace("60 mm", "82 mm"), "82 mm"),
            ('[[moves]]\nmicro = "1 mm"\nhold = "1 s"', "one stage"),
            (PROFILE.replace("100 mm/s", "9 m/s").replace("1 m/s", "90 m/s"), "guard.speed"),
        ):
            client.send(f"PROG:LOAD {block(text)}")
            assert words in client.ask("SYST:ERR?")
        names = client.ask("GAIN:CAT?")
        assert '"position"' in names and '"notch.depth"' in names
        was = float(client.ask('GAIN? "position"'))
        client.send(f'GAIN "position",{0.5 * was}')
        client.fine()
        assert float(client.ask('GAIN? "position"')) == 0.5 * was
        assert client.ask("MOVE:ABS 50 MM;*OPC?") == "1"
        assert client.mm() == pytest.approx(50.0, abs=tolerance)
        client.send('GAIN "velocity",1E6')
        assert "does not fit the others" in client.ask("SYST:ERR?")
        client.send('GAIN "position",-1')
        assert "accepted" in client.ask("SYST:ERR?")
        client.send("MOVE:ABS 80 MM;:GAIN:DEF")
        assert "a motion is under way" in client.ask("SYST:ERR?")
        client.ask("*OPC?")
        client.send("GAIN:DEF")
        client.fine()
        assert float(client.ask('GAIN? "position"')) == was
        assert client.ask("MOVE:ABS 30 MM;*OPC?") == "1"
        assert client.mm() == pytest.approx(30.0, abs=tolerance)


def test_a_piezo_stage_knows_its_place(tmp_path: Path) -> None:
    with served(tmp_path, example("piezo-100um")) as client:
        assert client.ask("*IDN?").startswith("macromicro,piezo own,0,")
        assert client.ask("SYST:LOCK:REQ?;:POS:TRUS?").startswith("1;1,")
        client.send("ENAB")
        for target in (50.0, 12.345, 99.0):
            assert client.ask(f"MOVE:ABS {target} UM;*OPC?") == "1"
            assert client.mm() * 1e3 == pytest.approx(target, abs=0.02)
        assert client.ask("LIM:ABS?") == "0,0.1"
        client.fine()
        client.send("HOME")
        assert "absolute" in client.ask("SYST:ERR?")
        # Nor does it lose its place in an emergency stop, or where it is off.
        client.send("ABOR")
        assert client.ask("POS:TRUS?").startswith("1,") and client.ask("ENAB?") == "0"
        # Its hysteresis leaves it beside 0; enabled, it stays there until it is moved.
        client.send("ENAB")
        assert client.ask("MOVE:ABS 20 UM;*OPC?") == "1"
        assert client.mm() * 1e3 == pytest.approx(20.0, abs=0.02)
        assert client.ask("FAUL?").startswith("0,")


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


def test_the_page_greets_with_the_machine_and_its_travel(tmp_path: Path) -> None:
    with served(tmp_path, example("piezo-100um")) as client:
        page = Page(int(client.page.rstrip("/").rpartition(":")[2]), {})
        about = page.welcome
        assert about["model"] == "piezo own" and about["stages"] == ["macro"]
        limits = about["limits"]
        assert limits["whole_low"] == 0.0 and limits["whole_high"] == pytest.approx(1e-4)
        assert limits["pitch"] == pytest.approx(3.2e-9)
        state = page.get("state")
        assert "home" not in state["possible"] and "enable" in state["possible"]
        page.close()
