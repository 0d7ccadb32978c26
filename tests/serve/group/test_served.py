"""A real server of a machine of several stages, and a socket that gives it orders."""

from __future__ import annotations

import json
import re
import socket
import time
from pathlib import Path

import pytest
from tests.serve.group.bed import PLOTTER
from tests.serve.stage.test_served import Served, block, example, served
from tests.serve.web.web_parts import Client as Page

from macromicro.recording import Recording

TEXT = PLOTTER.read_text(encoding="utf-8")
COUNTS = 3e-3  # mm: some counts of 0.5 um

ARC = """[[paths]]
x = "60 mm"
y = "20 mm"
[[paths]]
centre = ["60 mm", "30 mm"]
angle = "-90 deg"
"""


def point(client: Served) -> tuple[float, float]:
    x, y, trusted = client.ask("POS:POIN?").split(",")
    assert trusted == "1"
    return float(x), float(y)


def test_two_axes_home_move_jog_and_run_programmes(tmp_path: Path) -> None:
    with served(tmp_path, TEXT) as client:
        assert client.ask("*IDN?").startswith("macromicro,xy own,0,")
        assert client.ask("SYST:LOCK:REQ?") == "1"
        client.send("ENAB")
        client.send("MOVE:POIN 50 MM,30 MM")
        assert "home first" in client.ask("SYST:ERR?")
        assert client.ask("POS:POIN?").endswith(",0")
        assert client.ask("HOME;*OPC?") == "1"
        assert client.ask("POS:TRUS?") == '1,"homed"'
        for x, y in ((50.0, 30.0), (120.0, 10.0), (20.0, 60.0)):
            assert client.ask(f"MOVE:POIN {x} MM,{y} MM;*OPC?") == "1"
            assert point(client) == pytest.approx((x, y), abs=COUNTS)
        assert client.ask("MOVE:X 4 CM;*OPC?") == "1"
        assert client.ask("MOVE:Y MAX;*OPC?") == "1"
        x, y = point(client)
        assert x == pytest.approx(40.0, abs=COUNTS) and 69.0 < y < 74.0
        place, half, aim, volts = (float(v) for v in client.ask("POS:Y?").split(","))
        assert place == pytest.approx(y, abs=COUNTS) and aim == pytest.approx(y, abs=COUNTS)
        assert half == pytest.approx(0.25e-3) and abs(volts) < 24.0
        client.send("JOG:Y -5 MM/S")
        while point(client)[1] > y - 1.0:
            time.sleep(0.02)
        client.send("JOG:Y 0 MM/S")
        assert client.ask("*OPC?") == "1" and y - 5.0 < point(client)[1] < y - 1.0
        client.fine()
        for order, words in (
            ("MOVE:ABS 10 MM", "two axes"),
            ("MOVE:POIN 50 MM,90 MM", "y: position 90"),
            ("JOG:MACR 1 MM/S", "two axes"),
        ):
            client.send(order)
            assert words in client.ask("SYST:ERR?")
        client.send(f"PROG:LOAD {block(ARC)}")
        assert client.ask("PROG:RUN;*OPC?") == "1"
        assert point(client) == pytest.approx((50.0, 30.0), abs=COUNTS)
        client.fine()
        was = float(client.ask('GAIN? "y.position"'))
        client.send(f'GAIN "y.position",{0.5 * was}')
        client.fine()
        assert float(client.ask('GAIN? "y.position"')) == 0.5 * was
        client.send("MOVE:POIN 190 MM,5 MM")
        while point(client)[0] < 60.0:
            time.sleep(0.02)
        client.send("STOP")
        assert client.ask("*OPC?") == "1" and client.ask("MODE?") == '"stopped"'
        x, y = point(client)
        assert 60.0 < x < 180.0
        assert y - 30.0 == pytest.approx((x - 50.0) * -25.0 / 140.0, abs=0.05)  # on the line
        client.send("ABOR")
        assert client.ask("ENAB?") == "0" and float(client.ask("POS:Y?").split(",")[3]) == 0.0


@pytest.mark.slow
def test_a_recording_and_the_position_file_have_both_axes(tmp_path: Path) -> None:
    with served(tmp_path, TEXT) as client:
        page = Page(int(client.page.rstrip("/").rpartition(":")[2]), {})
        about, state = page.welcome, page.get("state")
        assert about["stages"] == ["x", "y"] and [a["name"] for a in about["axes"]] == ["x", "y"]
        assert about["axes"][1]["high"] < about["axes"][0]["high"]
        assert {"enable", "home"} & set(state["possible"]) == {"enable"}
        page.close()
        assert client.ask("SYST:LOCK:REQ?;:ENAB;:HOME;*OPC?") == "1;1"
        client.send("REC ON")
        client.ask("MOVE:POIN 30 MM,20 MM;*OPC?")
        client.send("REC OFF")
        client.fine()
    kept = json.loads((tmp_path / "position.json").read_text())
    assert kept["trusted"] and not kept["moving"]
    assert kept["encoder"] - kept["offset"] == pytest.approx(60000, abs=8)
    ((count, offset),) = kept["others"]
    assert count - offset == pytest.approx(40000, abs=8)
    file = next(tmp_path.rglob("*.h5"))
    recording = Recording.load(file)
    assert recording["position"][-1] == pytest.approx(30.0, abs=COUNTS)
    assert recording["y_position"][-1] == pytest.approx(20.0, abs=COUNTS)
    assert abs(recording["y_motor"]).max() > 0.1
    with served(tmp_path, TEXT) as client:  # a simulated machine confirms nothing
        trusted, why = client.ask("POS:TRUS?").split(",", 1)
        assert trusted == "0"
        assert "moved or reset" in why or "unconfirmed" in why


def test_a_fault_of_one_axis_is_told_as_its_own_and_stops_both(tmp_path: Path) -> None:
    with served(tmp_path, TEXT + '\n[y.guard]\nerror = "1 um"\n') as client:
        client.ask("SYST:LOCK:REQ?")
        client.send("ENAB;:HOME")
        client.ask("*OPC?")
        client.ask("MOVE:POIN 100 MM,50 MM;*OPC?")
        code, words = client.ask("FAUL?").split(",", 1)
        assert code == "406" and words.startswith('"y: following error"') and "both axes" in words
        assert client.ask("MODE?") == '"fault"'
        assert float(client.ask("POS:X?").split(",")[3]) == 0.0
        client.send("FAUL:CLE")
        assert client.ask("FAUL?").startswith("0,") and client.ask("MODE?") == '"disabled"'


@pytest.mark.slow
def test_two_axes_and_a_piezo_home_move_and_run_programmes(tmp_path: Path) -> None:
    with served(tmp_path, example("xyz"), "--gcs", "0") as client:
        assert client.ask("*IDN?").startswith("macromicro,x_y_z own,0,")
        assert client.ask("SYST:LOCK:REQ?;:ENAB;:HOME;*OPC?") == "1;1"
        assert client.ask("MOVE:POIN 50 MM,30 MM,20 UM;*OPC?") == "1"
        places = [float(each) for each in client.ask("POS:POIN?").split(",")]
        assert places == pytest.approx([50.0, 30.0, 0.020, 1.0], abs=0.02)
        assert places[2] == pytest.approx(0.020, abs=1e-4)
        assert client.ask("MOVE:Z MAX;*OPC?;:MOVE:Z:REL -10 UM;*OPC?") == "1;1"
        assert float(client.ask("POS:Z?").split(",")[0]) == pytest.approx(0.090, abs=1e-4)
        client.send("JOG:Z -10 UM/S;:JOG:Z 0 UM/S")
        assert client.ask("*OPC?") == "1"
        client.fine()
        for order, words in (
            ("MOVE:POIN 50 MM,30 MM", "-109"),
            ("MOVE:POIN 50 MM,30 MM,1 MM", "z: position 1"),
            ("MOVE:ABS 10 MM", "3 stages"),
            ("MOVE:W 1 MM", "-113"),
        ):
            client.send(order)
            assert words in client.ask("SYST:ERR?"), order
        assert '"z.integral"' in client.ask("GAIN:CAT?")
        client.send('PROG:LOAD "usual"')
        assert client.ask("PROG:RUN;*OPC?") == "1"
        client.fine()
        with socket.create_connection(("127.0.0.1", gcs_port(client))) as other:
            file = other.makefile("rw", newline="\n")
            assert client.ask("SYST:LOCK:REL;*OPC?") == "1"  # before the other one asks for it
            file.write("MOV X 10 Z 0.03\nSAI?\n")
            file.flush()
            assert [file.readline().strip() for _ in range(3)] == ["X", "Y", "Z"]
            while client.ask("MOVE:NUMB?") != "0":
                time.sleep(0.05)
        places = [float(each) for each in client.ask("POS:POIN?").split(",")]
        assert places == pytest.approx([10.0, 0.0, 0.030, 1.0], abs=0.03)


def gcs_port(client: Served) -> int:
    found = re.search(r"GCS.* port (\d+)", client.said)
    assert found
    return int(found[1])
